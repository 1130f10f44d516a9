//! One service that a task reads.

use std::sync::atomic::Ordering;

use isochrone_cyclic::{Clock, Monotonic, thread_allocations};
use isochrone_ipc::{Flags, FrameHeader, FrameSubscriber, Service, Stamps};

use super::channel::Channel;
use crate::task::bindings::{Resolved, ServiceObservations};
use crate::task::freshness::{Missing, Sample};

/// A frame whose stamp is older than this was stamped by another clock: no wait in this process is so long.
pub(super) const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;
/// How old the oldest sample behind a fresh frame may be before that is an alarm.
const OLD_SOURCE_NS: u64 = 10_000_000_000;

/// One service, and the inputs that are channels of its frame.
pub(crate) struct InputPort<S: Service> {
    pub(super) service: String,
    pub(super) subscriber: FrameSubscriber<S>,
    pub(super) resolved: Resolved,
    pub(super) channels: Vec<Channel>,
    /// When frames were last looked for.
    pub(super) looked_ns: u64,
    pub(super) future_stamps: u64,
    pub(super) past_stamps: u64,
    pub(super) unknown_layouts: u64,
    /// Allocations by iceoryx2 in the cycle, where it connects a publisher that has just joined.
    pub(super) allocations: u64,
    /// When the newest frame was published, in ns, if its stamp can be believed.
    pub(crate) published_ns: Option<u64>,
}

impl<S: Service> InputPort<S> {
    /// Frames that were received, or lost.
    pub(crate) fn sent(&self) -> u64 {
        let counters = self.subscriber.counters();
        counters.received.saturating_add(counters.lost)
    }

    /// Reads the newest frame, if there is one; returns how many samples were rejected.
    pub(super) fn read(&mut self, now_ns: u64) -> u64 {
        if let Some(period_ns) = self.resolved.update() {
            self.subscriber.set_period(period_ns);
        }
        let waited_ns = now_ns.saturating_sub(std::mem::replace(&mut self.looked_ns, now_ns));
        let before = thread_allocations();
        let frame = self.subscriber.newest(now_ns);
        self.allocations += thread_allocations() - before;
        let Some(frame) = frame else { return 0 };
        self.published_ns = None;
        let header = frame.header();
        let observed = &self.resolved.observed;
        observed.is_plain.store(header.layout == 0, Ordering::Relaxed);
        let Some(bindings) = self.resolved.of(header.layout) else {
            self.unknown_layouts += 1;
            ServiceObservations::store(&observed.unknown_layout, header.layout);
            let miss = |channel: &mut Channel| {
                channel.freshness.miss(header.flags(), Missing::Layout);
            };
            self.channels.iter_mut().for_each(miss);
            return self.channels.len() as u64;
        };
        ServiceObservations::store(&observed.unknown_layout, 0);
        // A frame that arrived after the cycle began is not from the future.
        let arrival_ns = if header.publish_ns > now_ns { Monotonic.now_ns() } else { now_ns };
        let credible = header.credible(bindings.clock, arrival_ns);
        let age_ns = arrival_ns.saturating_sub(header.publish_ns);
        let is_believed = matches!(credible.stamps, Stamps::Believed);
        self.published_ns = is_believed.then_some(header.publish_ns);
        match credible.stamps {
            Stamps::Future => {
                self.future_stamps += 1;
                ServiceObservations::store(
                    &observed.ahead_ns,
                    header.publish_ns.saturating_sub(arrival_ns),
                );
            }
            Stamps::Believed if age_ns > waited_ns.saturating_add(CREDIBLE_DELAY_NS) => {
                self.past_stamps += 1;
                ServiceObservations::store(&observed.behind_ns, age_ns);
            }
            Stamps::Believed => note_old_source(observed, header),
            Stamps::Foreign => {}
        }
        let mut rejects = 0;
        for (channel, place) in self.channels.iter_mut().zip(&bindings.places) {
            let values = frame.values();
            let short = |channel| Missing::Channel { channel, values: values.len() };
            let value = place.and_then(|place| values.get(place).ok_or_else(|| short(place)));
            let is_taken = match value {
                Ok(value) => channel.freshness.offer(Sample {
                    value: *value,
                    sampled_ns: credible.sampled_ns,
                    source_ns: credible.source_ns,
                    flags: header.flags(),
                }),
                Err(why) => {
                    channel.freshness.miss(header.flags(), why);
                    false
                }
            };
            rejects += u64::from(!is_taken);
        }
        rejects
    }
}

/// Samples circulate in a loop of nodes, or come from a publisher whose death was not noticed.
fn note_old_source(observed: &ServiceObservations, header: &FrameHeader) {
    let behind_ns = header.publish_ns.saturating_sub(header.source_ns);
    // A frame whose flags describe its own sources comes from a node that has noticed. Flags that it received in turn
    // would circulate for ever where nodes read each other. The last frame of a writer may repeat an old sample.
    let flags = header.flags().without(Flags::FORCED | Flags::UPSTREAM);
    if header.source_ns > 0 && behind_ns > OLD_SOURCE_NS && flags.is_empty() {
        ServiceObservations::store(&observed.old_source_flags, header.flags().bits());
        ServiceObservations::store(&observed.old_source_ns, behind_ns);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    #[test]
    fn an_old_source_is_noted_unless_a_frame_says_why_or_is_the_last_of_its_writer() {
        let is_noted = |flags: Flags| {
            let observed = ServiceObservations::default();
            let (source_ns, publish_ns) = (1, 2 + OLD_SOURCE_NS);
            let flags = flags.bits();
            let header = FrameHeader { source_ns, publish_ns, flags, ..FrameHeader::default() };
            note_old_source(&observed, &header);
            observed.old_source_ns.load(Ordering::Relaxed) > 0
        };
        let flags = [Flags::NONE, Flags::UPSTREAM, Flags::STALE, Flags::STOPPED];
        assert_eq!(flags.map(is_noted), [true, true, false, false]);
    }
}
