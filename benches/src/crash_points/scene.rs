//! The processes around the one that is struck.

use std::thread;
use std::time::Duration;

use super::output::Output;
use super::peer::Peer;
use super::point::{Circumstance, Role};
use super::stage::{Findings, Stage};
use crate::Failure;
use crate::domain::Domain;

/// A node that hands its input on.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeFile {
    pub(super) file: &'static str,
    name: &'static str,
    output: &'static str,
}

pub(super) const INPUT: &str = "crash/in";
pub(super) const OUTPUT: &str = "crash/out";
pub(super) const SECOND_OUTPUT: &str = "crash/second";
pub(super) const NODE: NodeFile = NodeFile { file: "node.toml", name: "crash", output: OUTPUT };
/// Where the first runs, the fresh node is another.
pub(super) const SECOND_NODE: NodeFile =
    NodeFile { file: "second.toml", name: "second", output: SECOND_OUTPUT };

/// What the publishers that live on, that are struck and that come afterwards send.
pub(super) const LIVING: f64 = 5.0;
pub(super) const VICTIM: f64 = 7.0;
pub(super) const FRESH: f64 = 9.0;

/// A process ends by then even if nobody is left to end it.
const LIFE: &str = "--seconds 60";
/// Frames that come one after another are a stream.
const STREAM: u64 = 5;

impl NodeFile {
    pub(super) fn config(&self) -> String {
        let Self { name, output, .. } = self;
        format!(
            r#"
[node]
name = "{name}"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "{INPUT}"
default = -1.0
[[output]]
service = "{output}"
signals = ["x"]
"#
        )
    }
}

pub(super) fn publish(value: f64) -> String {
    format!("publish {INPUT} --value {value} --rate 500 {LIFE}")
}

pub(super) fn run(node: NodeFile) -> String {
    format!("run {} {LIFE}", node.file)
}

pub(super) fn subscribe(service: &str) -> String {
    format!("subscribe {service} --csv - {LIFE}")
}

/// The command of the process that is struck.
pub(super) fn victim(role: Role) -> String {
    match role {
        Role::Publisher => publish(VICTIM),
        Role::Node => run(NODE),
        Role::Subscriber => subscribe(OUTPUT),
    }
}

/// Frames that a process is to receive from now on.
#[derive(Debug, Clone)]
pub(super) struct Watch {
    who: String,
    output: Output,
    rows: u64,
    value: Option<f64>,
}

impl Watch {
    pub(super) fn new(who: &str, output: &Output, value: Option<f64>) -> Self {
        let (output, rows) = (output.clone(), output.feed().rows);
        Self { who: who.to_owned(), output, rows, value }
    }

    pub(super) fn is_met(&self) -> bool {
        let feed = self.output.feed();
        feed.rows >= self.rows + STREAM && self.value.is_none_or(|value| feed.last == Some(value))
    }

    fn anew(&mut self) {
        self.rows = self.output.feed().rows;
    }

    fn unmet(&self) -> String {
        let feed = self.output.feed();
        let wanted = self.value.map_or_else(String::new, |value| format!(" with {value}"));
        let last = feed.last.map_or_else(String::new, |last| format!(", the last with {last}"));
        format!("the {} received {} frames{last}, none{wanted}", self.who, feed.rows - self.rows)
    }
}

/// Processes of one domain. They are killed when this is dropped.
#[derive(Debug)]
pub(super) struct Company<'a> {
    stage: &'a Stage,
    peers: Vec<Peer>,
    /// What is to arrive next.
    pub(super) watches: Vec<Watch>,
    /// Subscribers whose frames are to flow all the time.
    pulses: Vec<Watch>,
    /// Those of the processes that were there before the blow.
    living: usize,
    // The last field: dropped when its processes are gone.
    pub(super) domain: Domain,
}

impl<'a> Company<'a> {
    pub(super) fn new(stage: &'a Stage) -> Result<Self, Failure> {
        let domain = stage.domain()?;
        let (peers, watches, pulses) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { stage, peers, watches, pulses, living: 0, domain })
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
            Circumstance::Dead => {
                company.all_fresh()?;
                let mut findings = Findings::default();
                company.expect_frames(&mut findings);
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
        let pulse = match role {
            Role::Node => self.subscriber(INPUT)?,
            _ => self.subscriber(OUTPUT)?,
        };
        if role == Role::Node {
            self.subscriber(OUTPUT)?;
        }
        let watch = Watch::new("living subscriber", &pulse, None);
        self.pulses.push(watch.clone());
        match self.stage.wait_for(|| watch.is_met()) {
            Some(_) => Ok(()),
            None => Err(format!("before the blow, {}", watch.unmet()).into()),
        }
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
    pub(super) fn expect_frames(&mut self, findings: &mut Findings) -> bool {
        let (peers, watches) = (&mut self.peers, &self.watches);
        let mut ended = Vec::new();
        let arrived = self.stage.wait_for(|| {
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
        self.pulses.iter_mut().for_each(Watch::anew);
        let pulses = &self.pulses;
        let beats = self.stage.wait_for(|| pulses.iter().all(Watch::is_met)).is_some();
        if !beats {
            let unmet = pulses.iter().filter(|pulse| !pulse.is_met()).map(Watch::unmet);
            findings.wrong.extend(unmet);
        }
        beats && ended.is_empty()
    }

    /// Ends one process after the other, readers first, and counts what they leave.
    pub(super) fn end(self, findings: &mut Findings) -> Domain {
        let Self { peers, domain, .. } = self;
        for peer in peers.into_iter().rev() {
            findings.take(peer.end());
        }
        domain
    }
}

fn said(peer: &Peer) -> String {
    format!("the {} said: {}", peer.who(), peer.output.errors().trim_end().replace('\n', " | "))
}

/// A little longer than it takes two ports to see each other.
pub(super) fn let_connections_settle() {
    thread::sleep(Duration::from_millis(20));
}
