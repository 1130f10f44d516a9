//! Which services are recorded, and which of them are yet to be found.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use isochrone_ipc::Participant;

use super::Service;
use super::source::Source;
use crate::failure::Failure;
use crate::{list, terminal};

/// Names of services that isochrone's own nodes use begin so.
const RESERVED: &str = "isochrone/";
/// Between two looks at the names of all services.
const NAMES_INTERVAL: Duration = Duration::from_millis(250);
/// Between two looks at who publishes them. Each service is opened for that, so it takes longer.
const PUBLISHERS_INTERVAL: Duration = Duration::from_secs(2);

/// What is wanted.
pub(super) struct Wanted {
    /// Nodes, and services that were not found yet; `None`: all services.
    names: Option<Vec<String>>,
    /// Nodes that were found. They stay wanted, as they may open further services.
    nodes: HashSet<String>,
    /// Services that are recorded, or cannot be.
    known: HashSet<String>,
    /// The names of all services, and when they were looked at.
    seen: Option<(Vec<String>, Instant)>,
    /// When it was looked at who publishes them.
    publishers_seen: Option<Instant>,
}

impl Wanted {
    pub(super) fn new(names: &[String]) -> Self {
        let names = (!names.is_empty()).then(|| names.to_vec());
        Self {
            names,
            nodes: HashSet::new(),
            known: HashSet::new(),
            seen: None,
            publishers_seen: None,
        }
    }

    /// Opens what has come to be.
    pub(super) fn find(
        &mut self,
        participant: &Participant<Service>,
        sources: &mut Vec<Source>,
    ) -> Result<(), Failure> {
        let has_changed = self.look_at_names(participant)?;
        let mut found = match (&self.names, &self.seen) {
            (Some(names), _) | (None, Some((names, _))) => names.clone(),
            (None, None) => Vec::new(),
        };
        let takes_all = self.names.is_none();
        found.retain(|name| {
            let is_own = takes_all && name.starts_with(RESERVED);
            !is_own && !self.known.contains(name) && !self.nodes.contains(name)
        });
        for name in &found {
            let is_found = self.open(participant, name, sources)?;
            if is_found && let Some(names) = &mut self.names {
                names.retain(|wanted| wanted != name);
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

    /// Looks at the names of all services, if it is time; returns whether they have changed.
    fn look_at_names(&mut self, participant: &Participant<Service>) -> Result<bool, Failure> {
        let is_wanted = self.names.as_ref().is_none_or(|names| !names.is_empty());
        let is_fresh = |(_, looked): &(_, Instant)| looked.elapsed() < NAMES_INTERVAL;
        if !is_wanted || self.seen.as_ref().is_some_and(is_fresh) {
            return Ok(false);
        }
        let names = participant.frame_service_names().map_err(Failure::found)?;
        let has_changed = self.seen.as_ref().is_none_or(|(seen, _)| *seen != names);
        self.seen = Some((names, Instant::now()));
        Ok(has_changed)
    }

    /// Says what does not exist yet.
    pub(super) fn say_waiting(&self, participant: &Participant<Service>) {
        let missing = self.names.iter().flatten().filter(|name| !self.nodes.contains(*name));
        for name in missing {
            let meant = match list::similar(participant, name) {
                Some(similar) => format!("; did you mean \"{similar}\"?"),
                None => String::new(),
            };
            terminal::note(&format!(
                "waiting for service or node \"{name}\", which does not exist yet{meant}"
            ));
        }
    }

    /// Opens the services of nodes.
    fn find_nodes(
        &mut self,
        participant: &Participant<Service>,
        sources: &mut Vec<Source>,
    ) -> Result<(), Failure> {
        let services = participant.frame_services().map_err(Failure::found)?;
        let wanted = self.names.clone().unwrap_or_default();
        for node in &wanted {
            let telemetry = format!("{RESERVED}{node}/telemetry");
            let Some(telemetry) = services.iter().find(|service| service.name == telemetry) else {
                continue;
            };
            let of_node = services.iter().filter(|service| {
                let mut publishers = service.publishers.iter();
                !service.name.starts_with(RESERVED)
                    && publishers.any(|publisher| telemetry.publishers.contains(publisher))
            });
            for service in of_node {
                if self.open(participant, &service.name, sources)? {
                    self.nodes.insert(node.clone());
                }
            }
        }
        Ok(())
    }

    /// Opens a service, unless it is recorded already; returns whether it exists. One that was named and
    /// cannot be recorded is a failure; one that is there by chance is left out.
    fn open(
        &mut self,
        participant: &Participant<Service>,
        name: &str,
        sources: &mut Vec<Source>,
    ) -> Result<bool, Failure> {
        if self.known.contains(name) {
            return Ok(true);
        }
        match Source::open(participant, name) {
            Ok(None) => return Ok(false),
            Ok(Some(source)) => sources.push(source),
            Err(error) if self.names.is_some() => return Err(Failure::found(error)),
            Err(error) => {
                terminal::note(&format!("note: \"{name}\" is not recorded: {error}"));
            }
        }
        self.known.insert(name.to_owned());
        Ok(true)
    }
}
