//! Which services are recorded, and which of them are yet to be found.

use std::collections::{BTreeMap, HashSet};
use std::time::{Duration, Instant};

use isochrone_ipc::ipc::Service;
use isochrone_ipc::{OpenError, Participant, descriptor_shortage};
use isochrone_model::OWN_SERVICES;

use super::left_out::LeftOut;
use super::source::Source;
use crate::base::failure::Failure;
use crate::base::terminal;
use crate::list;

/// Stands for services that came while they could not be looked for.
pub(super) const EVERY: &str = "*";
/// Between two looks at the names of all services.
const NAMES_INTERVAL: Duration = Duration::from_millis(250);
/// Between two tries where the last one failed.
const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// This many attempts to open a service take longer than two looks at the names.
const TRIES: u32 = 50;
/// Between two looks at who publishes them. Each service is opened for that, so it takes longer.
const PUBLISHERS_INTERVAL: Duration = Duration::from_secs(2);

/// The services and nodes to record.
pub(super) struct RecordSelection {
    /// Nodes, and services that were not found yet; `None`: all services.
    names: Option<Vec<String>>,
    /// Nodes that were found. They stay wanted, as they may open further services.
    nodes: HashSet<String>,
    /// Services that are recorded.
    known: HashSet<String>,
    /// Services that could not be opened, and why.
    refused: BTreeMap<String, String>,
    /// Services that are listed and are not there when they are opened, and how often that was so.
    absent: BTreeMap<String, u32>,
    /// When something failed last.
    failed_at: Option<Instant>,
    /// Why the names could not be looked at; said once.
    failure: Option<String>,
    /// The names of all services, and when they were looked at.
    seen: Option<(Vec<String>, Instant)>,
    /// When it was looked at who publishes them.
    publishers_seen: Option<Instant>,
}

impl RecordSelection {
    pub(super) fn new(names: &[String]) -> Self {
        let names = (!names.is_empty()).then(|| names.to_vec());
        Self {
            names,
            nodes: HashSet::new(),
            known: HashSet::new(),
            refused: BTreeMap::new(),
            absent: BTreeMap::new(),
            failed_at: None,
            failure: None,
            seen: None,
            publishers_seen: None,
        }
    }

    /// Whether services or nodes were named.
    pub(super) fn is_named(&self) -> bool {
        self.names.is_some()
    }

    /// Opens what there is.
    ///
    /// # Errors
    /// The services cannot be looked at, or one that was named cannot be recorded.
    pub(super) fn begin<'p>(
        &mut self,
        participant: &'p Participant<Service>,
        sources: &mut Vec<Source<'p>>,
    ) -> Result<(), Failure> {
        if let Err(error) = self.look(participant, sources) {
            self.failure = Some(error.to_string());
            return Err(Failure::found(error));
        }
        match self.refused.values().next() {
            Some(why) if self.names.is_some() => Err(Failure::found(why)),
            _ => Ok(()),
        }
    }

    /// Opens services that have appeared. A failure is reported and tried again; it does not end the recording.
    pub(super) fn find<'p>(
        &mut self,
        participant: &'p Participant<Service>,
        sources: &mut Vec<Source<'p>>,
    ) {
        let was_just_now = |failed: Instant| failed.elapsed() < RETRY_INTERVAL;
        if self.failed_at.is_some_and(was_just_now) {
            return;
        }
        self.failed_at = None;
        if let Err(error) = self.look(participant, sources) {
            self.failed_at = Some(Instant::now());
            let why = error.to_string();
            if self.failure.as_ref() != Some(&why) {
                terminal::note(&format!(
                    "warning: services that come now are not found: {why}; it is tried again each second"
                ));
                self.failure = Some(why);
            }
        } else if self.failure.take().is_some() {
            terminal::note("note: services that come now are found again");
        }
    }

    fn look<'p>(
        &mut self,
        participant: &'p Participant<Service>,
        sources: &mut Vec<Source<'p>>,
    ) -> Result<(), OpenError> {
        let has_changed = self.look_at_names(participant)?;
        for name in self.missing() {
            let is_found = self.open(participant, &name, sources);
            match &mut self.names {
                Some(names) if is_found => names.retain(|wanted| *wanted != name),
                None if !is_found => *self.absent.entry(name).or_default() += 1,
                _ => {}
            }
        }
        let was_long_ago = |looked: Instant| looked.elapsed() >= PUBLISHERS_INTERVAL;
        let is_wanted = self.names.as_ref().is_some_and(|names| !names.is_empty());
        if is_wanted && (has_changed || self.publishers_seen.is_none_or(was_long_ago)) {
            self.publishers_seen = Some(Instant::now());
            self.find_nodes(participant, sources)?;
        }
        Ok(())
    }

    /// The names that are not recorded yet.
    fn missing(&self) -> Vec<String> {
        let takes_all = self.names.is_none();
        let seen = || self.seen.as_ref().map(|(names, _)| names);
        let wanted = self.names.as_ref().or_else(seen).into_iter().flatten();
        let is_missing = |name: &&String| {
            let is_own = takes_all && name.starts_with(OWN_SERVICES);
            !is_own && !self.known.contains(*name) && !self.nodes.contains(*name)
        };
        wanted.filter(is_missing).cloned().collect()
    }

    /// The names that were never recorded.
    pub(super) fn left_out(&self) -> Vec<LeftOut> {
        let mut names = self.missing();
        // A listed service may have ended since; one that was listed twice has not.
        let is_there = |name: &String| self.absent.get(name).is_some_and(|tries| *tries >= TRIES);
        names.retain(|name| self.names.is_some() || is_there(name));
        names.extend(self.refused.keys().cloned());
        names.sort();
        names.dedup();
        let left_out = |service: String| {
            let refused = self.refused.get(&service).or(self.failure.as_ref()).cloned();
            // Without descriptors, iceoryx2 says of what is there that it is not.
            let refused = refused.or_else(descriptor_shortage);
            let absent = match self.names {
                Some(_) => "no such service or node was found",
                None => "it could not be opened while it was there",
            };
            let is_absent = refused.is_none() && self.names.is_some();
            LeftOut { service, why: refused.unwrap_or_else(|| absent.to_owned()), is_absent }
        };
        let mut left_out: Vec<_> = names.into_iter().map(left_out).collect();
        if let (None, Some(why)) = (&self.names, &self.failure) {
            left_out.push(LeftOut { service: EVERY.into(), why: why.clone(), is_absent: false });
        }
        left_out
    }

    /// Looks at the names of all services, if it is time; returns whether they have changed.
    fn look_at_names(&mut self, participant: &Participant<Service>) -> Result<bool, OpenError> {
        let is_wanted = self.names.as_ref().is_none_or(|names| !names.is_empty());
        let is_fresh = |(_, looked): &(_, Instant)| looked.elapsed() < NAMES_INTERVAL;
        if !is_wanted || self.seen.as_ref().is_some_and(is_fresh) {
            return Ok(false);
        }
        let names = participant.frame_service_names()?;
        let has_changed = self.seen.as_ref().is_none_or(|(seen, _)| *seen != names);
        self.seen = Some((names, Instant::now()));
        Ok(has_changed)
    }

    /// Says what does not exist yet.
    pub(super) fn say_waiting(&self, participant: &Participant<Service>) {
        let missing = self.names.iter().flatten().filter(|name| !self.nodes.contains(*name));
        for name in missing {
            let suggestion = match list::similar(participant, name) {
                Some(similar) => format!("; did you mean \"{similar}\"?"),
                None => String::new(),
            };
            terminal::note(&format!(
                "waiting for service or node \"{name}\", which does not exist yet{suggestion}"
            ));
        }
    }

    /// Opens the services of nodes.
    fn find_nodes<'p>(
        &mut self,
        participant: &'p Participant<Service>,
        sources: &mut Vec<Source<'p>>,
    ) -> Result<(), OpenError> {
        let services = participant.frame_services()?;
        let wanted = self.names.clone().unwrap_or_default();
        for node in &wanted {
            let telemetry = format!("{OWN_SERVICES}{node}/telemetry");
            let Some(telemetry) = services.iter().find(|service| service.name == telemetry) else {
                continue;
            };
            let of_node = services.iter().filter(|service| {
                let mut publishers = service.publishers.iter();
                !service.name.starts_with(OWN_SERVICES)
                    && publishers.any(|publisher| telemetry.publishers.contains(publisher))
            });
            for service in of_node {
                if self.open(participant, &service.name, sources) {
                    self.nodes.insert(node.clone());
                }
            }
        }
        Ok(())
    }

    /// Opens a service, unless it is recorded already; returns whether it is now.
    fn open<'p>(
        &mut self,
        participant: &'p Participant<Service>,
        name: &str,
        sources: &mut Vec<Source<'p>>,
    ) -> bool {
        if self.known.contains(name) {
            return true;
        }
        match Source::open(participant, name) {
            Ok(None) => return false,
            Ok(Some(source)) => sources.push(source),
            Err(error) => {
                self.failed_at = Some(Instant::now());
                let why = error.to_string();
                if self.refused.get(name) != Some(&why) {
                    terminal::note(&format!("warning: \"{name}\" is not recorded: {why}"));
                    self.refused.insert(name.to_owned(), why);
                }
                return false;
            }
        }
        self.refused.remove(name);
        self.known.insert(name.to_owned());
        true
    }
}
