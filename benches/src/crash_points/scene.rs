//! The processes around the one that is struck.

use std::fs;
use std::thread;
use std::time::Duration;

use isochrone_ipc::IsolatedDomain;
use serde_json::Value;

use super::output::Output;
use super::peer::Peer;
use super::point::{Circumstance, Role};
use super::roles::{
    FRESH, INPUT, LIVING, NODE, NodeFile, OUTPUT, PREDECESSOR, command, publish, run, subscribe,
};
use super::stage::{Findings, SET_WITHIN, Stage, wait};
use super::watch::Watch;
use crate::Failure;

/// What the subscriber writes whose frames are to flow all the time.
const PULSE_REPORT: &str = "pulse.json";

/// Processes of one domain. They are killed when this is dropped.
#[derive(Debug)]
pub(super) struct Company<'a> {
    stage: &'a Stage,
    peers: Vec<Peer>,
    /// What is to arrive next.
    pub(super) watches: Vec<Watch>,
    /// Frames that are to flow all the time.
    pulse: Option<Watch>,
    /// Those of the processes that were there before the blow.
    living: usize,
    // The last field: dropped when its processes are gone.
    pub(super) domain: IsolatedDomain,
}

impl<'a> Company<'a> {
    /// Nobody, in a domain of their own.
    pub(super) fn new(stage: &'a Stage) -> Result<Self, Failure> {
        Ok(Self::within(stage, stage.domain()?))
    }

    /// Nobody, in this domain.
    pub(super) fn within(stage: &'a Stage, domain: IsolatedDomain) -> Self {
        Self { stage, peers: Vec::new(), watches: Vec::new(), pulse: None, living: 0, domain }
    }

    /// Those that are there before the process that will be struck.
    pub(super) fn gather(
        stage: &'a Stage,
        role: Role,
        circumstance: Circumstance,
    ) -> Result<Self, Failure> {
        let mut company = Self::new(stage)?;
        match circumstance {
            Circumstance::Cold => {}
            Circumstance::Beside => company.surround(role)?,
            Circumstance::Restart => {
                company.surround(role)?;
                company.living = company.peers.len();
                company.lose(role)?;
            }
            Circumstance::Dead => {
                company.all_fresh()?;
                let mut findings = Findings::default();
                company.expect_frames(SET_WITHIN, &mut findings);
                if !findings.wrong.is_empty() {
                    return Err(format!("before the blow, {}", findings.wrong.join("; ")).into());
                }
                company.peers.clear();
            }
        }
        company.living = company.peers.len();
        Ok(company)
    }

    fn surround(&mut self, role: Role) -> Result<(), Failure> {
        if role != Role::Publisher {
            self.publisher(LIVING)?;
        }
        if role != Role::Node {
            self.node(NODE)?;
        }
        // The last of them depends on the process that is struck.
        let pulse = if role == Role::Node { INPUT } else { OUTPUT };
        let arguments = format!("{} --report {PULSE_REPORT}", subscribe(pulse));
        let pulse = self.start(Role::Subscriber, "living subscriber", &arguments)?;
        if role == Role::Node {
            self.subscriber(OUTPUT)?;
        }
        let watch = Watch::new("living subscriber", &pulse, None);
        self.pulse = Some(watch.clone());
        match wait(SET_WITHIN, || watch.is_met()) {
            Some(_) => Ok(()),
            None => Err(format!("before the blow, {}", watch.unmet()).into()),
        }
    }

    /// Starts a process of this role, and kills it as soon as it works.
    fn lose(&mut self, role: Role) -> Result<(), Failure> {
        let output = self.start(role, "predecessor", &command(role, PREDECESSOR))?;
        let heard = self.hears(role, PREDECESSOR, &output);
        if wait(SET_WITHIN, || heard.as_ref().is_none_or(Watch::is_met)).is_none() {
            let said = output.errors();
            return Err(format!("before the blow, the predecessor does not work: {said}").into());
        }
        self.peers.truncate(self.living);
        Ok(())
    }

    /// What shows to the living that a process of this role works: what it prints is `output`, and what
    /// it sends, if it is a publisher, `value`.
    pub(super) fn hears(&self, role: Role, value: f64, output: &Output) -> Option<Watch> {
        let reader = self.living_subscriber()?;
        let (output, value) = match role {
            Role::Publisher => (&reader, value),
            Role::Node => (&reader, LIVING),
            Role::Subscriber => (output, LIVING),
        };
        Some(Watch::new("living subscriber", output, Some(value)))
    }

    /// A publisher, a node and a subscriber, and what they are to bring about.
    pub(super) fn all_fresh(&mut self) -> Result<(), Failure> {
        self.publisher(FRESH)?;
        self.node(NODE)?;
        self.subscriber_of(OUTPUT, Some(FRESH)).map(drop)
    }

    pub(super) fn publisher(&mut self, value: f64) -> Result<(), Failure> {
        self.start(Role::Publisher, "publisher", &publish(value)).map(drop)
    }

    pub(super) fn node(&mut self, node: NodeFile) -> Result<(), Failure> {
        self.start(Role::Node, "node", &run(node)).map(drop)
    }

    pub(super) fn subscriber(&mut self, service: &str) -> Result<Output, Failure> {
        let who = format!("subscriber of {service}");
        self.start(Role::Subscriber, &who, &subscribe(service))
    }

    /// A subscriber that is to receive this value, or anything.
    pub(super) fn subscriber_of(
        &mut self,
        service: &str,
        value: Option<f64>,
    ) -> Result<Output, Failure> {
        let output = self.subscriber(service)?;
        self.watches.push(Watch::new(&format!("subscriber of {service}"), &output, value));
        Ok(output)
    }

    fn start(&mut self, role: Role, who: &str, arguments: &str) -> Result<Output, Failure> {
        let peer = Peer::start(role, who, self.stage.command(&self.domain, arguments))?;
        let output = peer.output.clone();
        self.peers.push(peer);
        Ok(output)
    }

    /// The last of the subscribers of before the blow.
    pub(super) fn living_subscriber(&self) -> Option<Output> {
        self.peers.get(..self.living)?.last().map(|peer| peer.output.clone())
    }

    /// Those that came after the blow.
    pub(super) fn fresh(&self) -> &[Peer] {
        self.peers.get(self.living..).unwrap_or_default()
    }

    /// What has not arrived.
    pub(super) fn unmet(&self) -> Vec<String> {
        self.watches.iter().filter(|watch| !watch.is_met()).map(Watch::unmet).collect()
    }

    /// What was to arrive is to arrive from now on.
    pub(super) fn watch_anew(&mut self) {
        self.watches.iter_mut().for_each(Watch::anew);
    }

    /// Waits for what is to arrive; a process that ended is the end of waiting.
    pub(super) fn expect_frames(&mut self, within: Duration, findings: &mut Findings) -> bool {
        let (peers, watches) = (&mut self.peers, &self.watches);
        let mut ended = Vec::new();
        let arrived = wait(within, || {
            ended = peers.iter_mut().filter_map(Peer::has_ended).collect();
            !ended.is_empty() || watches.iter().all(Watch::is_met)
        });
        let is_well = arrived.is_some() && ended.is_empty();
        if is_well {
            findings.recovered = arrived;
        } else if ended.is_empty() {
            findings.wrong.extend(self.unmet());
            findings.wrong.extend(self.fresh().iter().map(said));
        }
        findings.wrong.append(&mut ended);
        self.watches.clear();
        is_well
    }

    /// Whether those that ran go on.
    pub(super) fn expect_pulse(&mut self, findings: &mut Findings) -> bool {
        let living = self.peers.iter_mut().take(self.living);
        let ended: Vec<String> = living.filter_map(Peer::has_ended).collect();
        findings.wrong.extend(ended.iter().map(|ended| format!("of the living, {ended}")));
        let Some(pulse) = &mut self.pulse else { return ended.is_empty() };
        pulse.anew();
        let beats = self.stage.wait_for(|| pulse.is_met()).is_some();
        if !beats {
            findings.wrong.push(pulse.unmet());
        }
        beats && ended.is_empty()
    }

    /// Ends one process after the other, readers first. Whoever lived all the time lost no frame.
    pub(super) fn end(self, findings: &mut Findings) -> IsolatedDomain {
        let Self { peers, pulse, domain, .. } = self;
        for peer in peers.into_iter().rev() {
            findings.take(peer.end());
        }
        if pulse.is_some() {
            findings.take(lost_nothing(&domain));
        }
        domain
    }
}

fn lost_nothing(domain: &IsolatedDomain) -> Result<(), String> {
    let report = fs::read_to_string(domain.folder().join(PULSE_REPORT)).unwrap_or_default();
    let report: Value = serde_json::from_str(&report).unwrap_or_default();
    match report.pointer("/links/0/lost").and_then(Value::as_u64) {
        Some(0) => Ok(()),
        Some(lost) => Err(format!("the living subscriber lost {lost} frames")),
        None => Err("the living subscriber does not report what it lost".to_owned()),
    }
}

fn said(peer: &Peer) -> String {
    format!("the {} said: {}", peer.who(), peer.output.errors().trim_end().replace('\n', " | "))
}

/// A little longer than it takes two ports to see each other.
pub(super) fn let_connections_settle() {
    thread::sleep(Duration::from_millis(20));
}
