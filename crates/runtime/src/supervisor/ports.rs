//! The supervisor's ports. Ports stay in the thread that opens them.

use std::mem;
use std::sync::Arc;

use isochrone_ipc::{FrameLayout, LayoutAnnouncer, ListedNode, OpenError, RealTime, Service};
use isochrone_model::Access;

use super::layouts::Resolver;
use super::server::Serving;
use super::telemetry::Telemetry;
use crate::error::PrepareError;
use crate::node::operating::Shared;
use crate::redundancy::relay::Relay;
use crate::redundancy::twin::Twin;
use crate::task::bindings::Desk;
use crate::task::outputs::Output;

/// The supervisor's ports.
pub(super) struct Ports<S: Service> {
    pub(super) control: Option<Serving<S>>,
    telemetry: Option<Telemetry<S>>,
    /// Telemetry that is to be reopened with other signals.
    next_layout: Option<FrameLayout>,
    announcers: Vec<LayoutAnnouncer<S>>,
    /// For each task, one for each service that it reads.
    pub(super) resolvers: Vec<Vec<Resolver<S>>>,
    /// Where this is one of two processes of the node.
    relay: Option<Relay<S>>,
    /// Whether this process held the node when it served last.
    held: bool,
    /// Dropped last.
    participant: Arc<RealTime<S>>,
}

/// What the supervisor opens.
pub(crate) struct NodeServices {
    /// For each task, for each service that it reads.
    pub(crate) desks: Vec<Vec<Desk>>,
    /// What all tasks publish.
    pub(crate) outputs: Vec<Output>,
    pub(crate) control: Access,
}

impl<S: Service + 'static> Ports<S> {
    /// Opens the node's telemetry. It has one publisher at most, so this is refused if the node runs already.
    pub(super) fn open(
        participant: Arc<RealTime<S>>,
        node: &str,
        layout: &FrameLayout,
        twin: Option<Arc<Twin>>,
    ) -> Result<Self, OpenError> {
        let open = |twin| Relay::open(participant.ordinary(), node, twin);
        let relay = twin.map(open).transpose()?;
        Ok(Self {
            held: relay.as_ref().is_none_or(Relay::holds),
            relay,
            control: None,
            telemetry: Some(Telemetry::open(&participant, node, layout)?),
            next_layout: None,
            announcers: Vec::new(),
            resolvers: Vec::new(),
            participant,
        })
    }

    /// Opens everything else, after the tasks have opened their ports.
    pub(super) fn open_all(
        &mut self,
        node: &str,
        shared: &Shared,
        services: NodeServices,
    ) -> Result<(), PrepareError> {
        let NodeServices { desks, outputs, control } = services;
        let ordinary = self.participant.ordinary();
        let resolver = |desk| Resolver::open(ordinary, desk);
        let of_task = |desks: Vec<Desk>| desks.into_iter().map(resolver).collect();
        self.resolvers = desks.into_iter().map(of_task).collect::<Result<_, _>>()?;
        let announcer =
            |output: Output| LayoutAnnouncer::open(ordinary, &output.service, node, &output.layout);
        self.announcers = outputs.into_iter().map(announcer).collect::<Result<_, _>>()?;
        if control != Access::Off {
            self.control = Some(Serving::open(&self.participant, node, control, shared)?);
        }
        Ok(())
    }

    /// Retries failed connections, and announces layouts to new readers.
    pub(super) fn tend(&mut self, node: &str) {
        self.participant.tend();
        for resolver in self.resolvers.iter_mut().flatten() {
            resolver.tend(self.participant.ordinary());
        }
        for announcer in &mut self.announcers {
            announcer.tend(self.participant.ordinary());
        }
        self.reopen_telemetry(node);
        if let Some(telemetry) = &mut self.telemetry {
            telemetry.tend(&self.participant);
        }
    }

    /// Reports to the other process of the node, or listens to it.
    pub(super) fn tend_twin(&mut self, shared: &Shared, is_thorough: bool) {
        if let Some(relay) = &mut self.relay {
            relay.tend(shared, is_thorough);
        }
    }

    /// Whether this process holds the node.
    fn holds(&self) -> bool {
        self.relay.as_ref().is_none_or(Relay::holds)
    }

    /// Answers requests that can be answered, and begins new ones; in a process that holds the node.
    pub(super) fn serve(&mut self) {
        let holds = self.holds();
        let held = mem::replace(&mut self.held, holds);
        if let Some(control) = &mut self.control {
            // What waits right after a takeover the other process may have carried out.
            if holds && held {
                control.serve(self.participant.ordinary());
            } else {
                control.stand_by(self.participant.ordinary());
            }
        }
    }

    /// Serves requests for the last time.
    pub(super) fn end_requests(&mut self) {
        let holds = self.holds();
        if let Some(control) = self.control.as_mut().filter(|_| holds) {
            control.end(self.participant.ordinary());
        }
    }

    /// The telemetry of the signals of the current configuration.
    pub(super) fn telemetry(&mut self) -> Option<&mut Telemetry<S>> {
        let term = self.relay.as_ref().map(Relay::term);
        if term == Some(None) {
            // The other process publishes it.
            return None;
        }
        let telemetry = self.telemetry.as_mut().filter(|_| self.next_layout.is_none())?;
        term.flatten().into_iter().for_each(|term| telemetry.go_on(term));
        Some(telemetry)
    }

    /// Publishes other signals, as soon as possible.
    pub(super) fn change_telemetry(&mut self, layout: FrameLayout) {
        self.next_layout = Some(layout);
    }

    fn reopen_telemetry(&mut self, node: &str) {
        // A process that is stopped during its start must not delay the clients of this node.
        let ready = self.next_layout.take_if(|_| self.participant.ordinary().may_open_at_once());
        let Some(layout) = ready.filter(|_| self.telemetry.is_some()) else { return };
        // A service has one publisher at a time.
        self.telemetry = None;
        self.telemetry = Telemetry::open(&self.participant, node, &layout)
            .inspect_err(|error| {
                tracing::error!(
                    "the node goes on without telemetry of its new configuration: {error}"
                );
            })
            .ok();
    }

    /// The publishers of a service; `None`: they cannot be determined without waiting.
    pub(super) fn publishers(&self, service: &str) -> Option<Vec<ListedNode>> {
        self.participant.ordinary().publishers_at_once(service)
    }
}
