//! The bridge at work: its threads, and what they count.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::{self, ScopedJoinHandle};
use std::time::Duration;

use isochrone_ipc::{Domain, thread_remedy};
use isochrone_processes::Stop;
use isochrone_recording::message::Definitions;

use crate::bridge::{Events, LinkCounts, Watch, from_ros, to_ros};
use crate::config::{Config, FromRos, Profile, ToRos};
use crate::dds::{Dds, Graph};
use crate::failure::Failure;
use crate::names::dds_topic;
use crate::operate::{diagnostics, parameters};
use crate::terminal;

/// Between two looks at events and at the end.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Most links that are named when it starts.
const MOST_SHOWN: usize = 8;

/// How long a session lasts at most.
const FOR_EVER: Duration = Duration::from_secs(u32::MAX as u64);

fn no_thread(cause: std::io::Error) -> Failure {
    Failure::found(format!("cannot start a thread: {cause}; {}", thread_remedy()))
}

/// What the threads do, and what is counted of it.
struct Plan<'a> {
    config: &'a Config,
    definitions: &'a Definitions,
    domain: &'a Domain,
    takes_over: bool,
    to_ros: Vec<(ToRos, Arc<LinkCounts>)>,
    from_ros: Vec<(FromRos, Arc<LinkCounts>)>,
}

/// Bridges until it is to stop, and says then what was counted.
pub(crate) fn run(
    config: &Config,
    definitions: &Definitions,
    domain: &Domain,
    takes_over: bool,
    stop: &Stop,
) -> Result<(), Failure> {
    let counts = |from: &str, to: &str| Arc::new(LinkCounts::new(from, to));
    let to = config.to_ros.iter().map(|it| (it.clone(), counts(&it.service, &it.shown_topic())));
    let from = config.from_ros.iter().map(|it| (it.clone(), counts(&it.topic, &it.service)));
    let (to_ros, from_ros) = (to.collect(), from.collect());
    let plan = Plan { config, definitions, domain, takes_over, to_ros, from_ros };
    let mut watch = Watch::of(plan.to_ros.iter().map(|(_, counts)| counts));
    let mut ended = Ok(());
    let mut is_first = true;
    while !stop.is_due() && ended.is_ok() {
        ended = plan.session(&mut watch, std::mem::take(&mut is_first), stop);
    }
    for counts in plan.counts() {
        terminal::note(&counts.text());
    }
    ended
}

impl Plan<'_> {
    fn counts(&self) -> impl Iterator<Item = &Arc<LinkCounts>> {
        let to_ros = self.to_ros.iter().map(|(_, counts)| counts);
        to_ros.chain(self.from_ros.iter().map(|(_, counts)| counts))
    }

    /// What is bridged, for those who started it.
    fn start(&self) -> String {
        let Config { domain, is_local, parameters, diagnostics, .. } = self.config;
        let links = self.counts().map(|counts| counts.name.clone());
        let parameters = parameters.iter().map(|node| format!("parameters of {node}"));
        let diagnostics = diagnostics.iter().map(|_| "diagnostics".to_owned());
        let all: Vec<String> = links.chain(parameters).chain(diagnostics).collect();
        let shown = all[..all.len().min(MOST_SHOWN)].join(", ");
        let more = match all.len() - all.len().min(MOST_SHOWN) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let alone = if *is_local { ", this machine alone" } else { "" };
        format!("bridging {shown}{more}; DDS domain {domain}{alone}. Press Ctrl-C to end it.")
    }

    /// Bridges until it is to stop, a thread fails, or Unix time goes back where a best-effort topic is read.
    fn session(&self, watch: &mut Watch, is_first: bool, stop: &Stop) -> Result<(), Failure> {
        let dds = Dds::join(self.config.domain, self.config.is_local)?;
        let mut graph = Graph::open(&dds, self.config, self.definitions)?;
        let mut events = Events::of(&dds, self.types());
        let is_best_effort =
            |(link, _): &(FromRos, _)| link.quality_of_service.profile == Profile::SensorData;
        let hears_the_clock = self.from_ros.iter().any(is_best_effort);
        let stop = stop.within(FOR_EVER);
        let (dds, stop) = (&dds, &stop);
        let counts: Vec<_> = self.counts().cloned().collect();
        let of_ros = self.config.parameters.iter();
        let of_ros: Vec<_> = of_ros.map(|node| (node, self.config.node_of_ros(node))).collect();
        thread::scope(|scope| {
            let mut threads: Vec<ScopedJoinHandle<'_, Result<(), Failure>>> = Vec::new();
            let builder = |name: &str| thread::Builder::new().name(name.to_owned());
            if !self.to_ros.is_empty() {
                let work = || to_ros(self.domain, dds, &self.to_ros, self.definitions, stop);
                threads.push(builder("to_ros").spawn_scoped(scope, work).map_err(no_thread)?);
            }
            if !self.from_ros.is_empty() {
                let work = || from_ros(self.domain, self.takes_over, dds, &self.from_ros, stop);
                threads.push(builder("from_ros").spawn_scoped(scope, work).map_err(no_thread)?);
            }
            for (node, of_ros) in &of_ros {
                let work = || parameters(self.domain, dds, node, of_ros, self.definitions, stop);
                threads.push(builder("parameters").spawn_scoped(scope, work).map_err(no_thread)?);
            }
            if let Some(wanted) = &self.config.diagnostics {
                let work =
                    || diagnostics(self.domain, dds, wanted, &counts, self.definitions, stop);
                threads.push(builder("diagnostics").spawn_scoped(scope, work).map_err(no_thread)?);
            }
            if is_first {
                terminal::note(&self.start());
            }
            while !stop.is_due() && threads.iter().all(|thread| !thread.is_finished()) {
                graph.tend(dds);
                watch.tell(self.domain);
                if events.tell(dds) && hears_the_clock {
                    tracing::warn!(
                        "joins the domain of DDS again, as best-effort topics are silent after that"
                    );
                    break;
                }
                thread::sleep(LOOK_INTERVAL);
            }
            stop.flag().store(true, Ordering::Relaxed);
            let joined = threads.into_iter().map(|thread| match thread.join() {
                Ok(ended) => ended,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            joined.collect()
        })
    }

    /// The types of the topics, by the names in DDS.
    fn types(&self) -> HashMap<String, String> {
        let mut types = HashMap::new();
        for (link, _) in &self.to_ros {
            if let Some(outgoing) = &link.message {
                types.insert(dds_topic(&link.topic), outgoing.message.dds_name());
            }
        }
        for (link, _) in &self.from_ros {
            types.insert(dds_topic(&link.topic), link.message.message.dds_name());
        }
        types
    }
}
