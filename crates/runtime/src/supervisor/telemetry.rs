//! Telemetry: all signals of a node and the timing of its cycles, for observers.
//!
//! The supervisor publishes the snapshots that the cycles take, as one frame service of the node,
//! `isochrone/<node>/telemetry`. Eight observers therefore cost the cycle no more than none.

use isochrone_control::telemetry_service_name;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::Plan;
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, OpenError, RealTime, Service, Stamp,
};

use crate::node::alarms::Alarm;
use crate::task::snapshots::{MAX_SIGNALS, Snapshots, signals};

/// Publishes the snapshots of a node.
pub(crate) struct Telemetry<S: Service> {
    publisher: FramePublisher<S>,
    announcer: LayoutAnnouncer<S>,
    frames: u64,
}

impl<S: Service> Telemetry<S> {
    /// Opens the service.
    pub(crate) fn open(
        participant: &RealTime<S>,
        node: &str,
        layout: &FrameLayout,
    ) -> Result<Self, OpenError> {
        let service = telemetry_service_name(node);
        let ordinary = participant.ordinary();
        let publisher = FramePublisher::open(ordinary, &service, layout)?;
        let announcer = LayoutAnnouncer::open(ordinary, &service, node, layout)?;
        Ok(Self { publisher, announcer, frames: 0 })
    }

    /// Announces the layout to new readers; call it about fifty times a second.
    pub(crate) fn tend(&mut self, participant: &RealTime<S>) {
        self.announcer.tend(participant.ordinary());
    }

    /// Publishes with this term from now on.
    pub(crate) fn go_on(&mut self, term: u64) {
        self.publisher.go_on(term, self.publisher.next_sequence());
    }

    /// Takes the newest values.
    pub(crate) fn take(&mut self, snapshots: &Snapshots) {
        if let Some(values) = self.publisher.values_mut() {
            values.copy_from_slice(snapshots.values());
        }
    }

    /// Publishes the values that were taken.
    pub(crate) fn publish(&mut self) {
        let now_ns = Monotonic.now_ns();
        let stamp = Stamp { cycle: self.frames, release_ns: now_ns, ..Stamp::default() };
        self.frames += 1;
        // Observers notice a missing frame by the sequence numbers.
        self.publisher.send(stamp, || now_ns);
        self.publisher.prepare();
    }
}

/// An alarm for each task with more signals than telemetry has.
pub(crate) fn cuts(plan: &Plan) -> impl Iterator<Item = Alarm> {
    let counted = plan.tasks.iter().map(|task| (task, signals(task).count()));
    counted.filter(|(_, signals)| *signals > MAX_SIGNALS).map(|(task, signals)| {
        let (task, shown) = (task.name.clone(), MAX_SIGNALS);
        Alarm::TelemetryCut { task, signals, shown, service: telemetry_service_name(&plan.node) }
    })
}
