//! The publishers of recorded services.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Announcing, FramePublisher, Participant, Stamp, ipc};
use isochrone_processes::Stop;
use isochrone_timing::units::counted;

use super::frames::{Frame, Layouts};
use crate::base::failure::Failure;

/// After how many publishers others are let in, who wait for the lock of the domain.
const AT_ONCE: usize = 8;
/// For how long: they look every 20 ms.
const LET_IN: Duration = Duration::from_millis(30);

/// A publisher for each service; where a service changes its layout, one after the other.
pub(super) struct Ports<'a> {
    participant: &'a Arc<Participant<ipc::Service>>,
    layouts: &'a Layouts,
    by_service: HashMap<&'a str, Port>,
    /// How often a service changed its layout, and how long that took in all.
    pub(super) changes: (u64, Duration),
}

/// The publisher of a service.
struct Port {
    layout: usize,
    publisher: FramePublisher<ipc::Service>,
    _announcing: Announcing,
    /// What its publishers before have sent.
    before: (u64, u64),
}

/// The count of what was sent on a service.
#[derive(serde::Serialize)]
pub(super) struct Sum {
    pub(super) service: String,
    #[serde(rename = "frames")]
    pub(super) sent: u64,
    pub(super) unsent: u64,
    /// Frames in the recording.
    pub(super) recorded: u64,
}

impl Sum {
    fn frames(&self) -> String {
        let Self { sent, unsent, recorded, .. } = *self;
        let all = counted(recorded, "frame");
        if sent + unsent < recorded { format!("{sent} of {all}") } else { counted(sent, "frame") }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let (frames, service, unsent) = (self.frames(), &self.service, self.unsent);
        format!("published {frames} on \"{service}\", {unsent} could not be sent\n")
    }
}

impl<'a> Ports<'a> {
    /// Opens a publisher for each service, with its first layout, until it is to stop.
    pub(super) fn open(
        participant: &'a Arc<Participant<ipc::Service>>,
        layouts: &'a Layouts,
        stop: &Stop,
    ) -> Result<Self, Failure> {
        let (by_service, changes) = (HashMap::new(), Default::default());
        let mut ports = Self { participant, layouts, by_service, changes };
        for (place, (service, _)) in layouts.all.iter().enumerate() {
            if ports.by_service.contains_key(service.as_str()) {
                continue;
            }
            if stop.is_due() {
                break;
            }
            ports.change(place, (0, 0))?;
            if ports.by_service.len().is_multiple_of(AT_ONCE) {
                thread::sleep(LET_IN);
            }
        }
        Ok(ports)
    }

    fn change(&mut self, place: usize, before: (u64, u64)) -> Result<(), Failure> {
        let Some((service, layout)) = self.layouts.all.get(place) else { return Ok(()) };
        let publisher = FramePublisher::open(self.participant, service, layout);
        let publisher = publisher.map_err(Failure::found)?;
        let announcing = Announcing::start(self.participant, service, "publish", layout);
        let announcing = announcing.map_err(Failure::found)?;
        let port = Port { layout: place, publisher, _announcing: announcing, before };
        self.by_service.insert(service, port);
        Ok(())
    }

    /// Sees to it that frames of a layout can be sent.
    pub(super) fn enter(&mut self, layout: usize) -> Result<(), Failure> {
        let Some((service, _)) = self.layouts.all.get(layout) else { return Ok(()) };
        let is_other = |port: &Port| port.layout != layout;
        if !self.by_service.get(service.as_str()).is_some_and(is_other) {
            return Ok(());
        }
        let began = Instant::now();
        // A service has one publisher, so the one before goes first.
        let before = self.by_service.remove(service.as_str()).map(|port| port.sums());
        self.change(layout, before.unwrap_or_default())?;
        self.changes.0 += 1;
        self.changes.1 += began.elapsed();
        Ok(())
    }

    /// Sends a frame that is due at `release_ns`.
    pub(super) fn send(&mut self, frame: &Frame, release_ns: u64) {
        let Some((service, _)) = self.layouts.all.get(frame.layout) else { return };
        let Some(port) = self.by_service.get_mut(service.as_str()) else { return };
        port.publisher.prepare();
        if let Some(values) = port.publisher.values_mut() {
            values.iter_mut().zip(&frame.values).for_each(|(to, from)| *to = *from);
        }
        let Frame { cycle, missed, flags, source_age_ns, .. } = *frame;
        let source_ns = source_age_ns.map_or(0, |age_ns| release_ns.saturating_sub(age_ns));
        let stamp = Stamp { cycle, release_ns, source_ns, missed, flags };
        port.publisher.send(stamp, || Monotonic.now_ns());
        port.publisher.prepare();
    }

    /// The counts for each service, in the order of the recording.
    pub(super) fn sums(&self) -> Vec<Sum> {
        let services = self.layouts.services().into_iter();
        let sum = |service: String| {
            let (sent, unsent) = self.by_service.get(service.as_str())?.sums();
            let recorded = self.layouts.frames(&service);
            Some(Sum { service, sent, unsent, recorded })
        };
        services.filter_map(sum).collect()
    }
}

impl Port {
    /// Frames that were sent, and that were not.
    fn sums(&self) -> (u64, u64) {
        let counters = self.publisher.counters();
        let (sent, unsent) = self.before;
        (sent + counters.sent, unsent + counters.unsent + counters.send_errors)
    }
}
