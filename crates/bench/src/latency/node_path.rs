//! From a publisher through a control node to a subscriber, and how old the value is at every stage.

use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::EPOCH_OFFSET_NS;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, ForRealTime, FramePublisher, FrameSubscriber, ipc};
use isochrone_timing::Distribution;

use super::bench_node::{BenchNode, NodePlace};
use super::end::{End, EndError, Opening, Place};
use super::message::{END, Header, Message};
use super::ports::{layout, publish};
use super::turn::{Received, Span};

const PERIOD_NS: u64 = 1_000_000;
/// What the node's frames are paced at.
pub(super) const RATE_HZ: f64 = 1e9 / PERIOD_NS as f64;
const INPUT: &str = "node/in";
const OUTPUT: &str = "node/out";
/// How long a node may take to start.
pub(super) const START_NS: u64 = 30_000_000_000;
/// Looks for a frame between two readings of the clock.
const LOOKS: u32 = 256;

/// The node, which runs in this place.
pub(super) fn node(place: NodePlace) -> BenchNode {
    BenchNode {
        name: "latency",
        period_ns: PERIOD_NS,
        within_ns: None,
        input: INPUT,
        output: OUTPUT,
        place,
    }
}

/// When to begin to publish in a round: the age of the value when the node reads it depends on what
/// part of a period lies between, so that part moves through the whole period from round to round.
pub(super) fn start_ns(earliest_ns: u64, round: usize, rounds: usize) -> u64 {
    let part = (round as f64 + 0.5) / rounds.max(1) as f64;
    let phase_ns = (part * PERIOD_NS as f64) as u64;
    earliest_ns.next_multiple_of(PERIOD_NS) + EPOCH_OFFSET_NS % PERIOD_NS + phase_ns
}

/// The peer's end: it publishes what the node reads.
pub(super) fn open_publisher(place: &Place<'_>) -> Result<ForRealTime<Opening>, EndError> {
    let publisher = place.participant.publisher(INPUT, &layout(1))?;
    Ok(publisher.map(|publisher| {
        let input = NodeInput { publisher: publisher.plain() };
        Box::new(move || Ok(Box::new(input) as Box<dyn End>)) as Opening
    }))
}

struct NodeInput {
    publisher: FramePublisher<ipc::Service>,
}

impl End for NodeInput {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        match header.sequence {
            // To the node it would be a value like any other.
            END => Ok(()),
            _ => publish(&mut self.publisher, header, header.value()),
        }
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(None)
    }

    fn prepare(&mut self) {
        self.publisher.prepare();
    }
}

/// The age of the value at every stage.
#[derive(Debug, Clone, Default)]
pub(super) struct Stages {
    /// When the cycle was due that read it.
    pub(super) age_at_release: Distribution,
    /// When the node sent it on.
    pub(super) age_at_publish: Distribution,
    /// When it had arrived here.
    pub(super) end_to_end: Distribution,
}

impl Stages {
    pub(super) fn merge(&mut self, other: &Self) {
        self.age_at_release.merge(&other.age_at_release);
        self.age_at_publish.merge(&other.age_at_publish);
        self.end_to_end.merge(&other.end_to_end);
    }

    pub(super) fn clear(&mut self) {
        self.age_at_release.clear();
        self.age_at_publish.clear();
        self.end_to_end.clear();
    }
}

/// The measuring end: it reads what the node publishes.
pub(super) struct NodeOutput {
    subscriber: FrameSubscriber<ipc::Service>,
}

impl NodeOutput {
    pub(super) fn open(place: &Place<'_>) -> Result<ForRealTime<Self>, EndError> {
        let subscriber = place.participant.subscriber(OUTPUT, 2, Depth::All)?;
        Ok(subscriber.map(|subscriber| Self { subscriber }))
    }

    /// Waits until the node sends; what it sends is thrown away.
    pub(super) fn await_node(&mut self, stop: &AtomicBool) -> Result<(), EndError> {
        let give_up_ns = Monotonic.now_ns() + START_NS;
        // What the node of the turn before has left.
        while self.subscriber.next(Monotonic.now_ns()).is_some() {}
        while self.subscriber.next(Monotonic.now_ns()).is_none() && !stop.load(Ordering::Relaxed) {
            if Monotonic.now_ns() > give_up_ns {
                return Err(EndError::NoNode);
            }
            self.subscriber.maintain();
            Monotonic.sleep_until_ns(Monotonic.now_ns() + PERIOD_NS);
        }
        Ok(())
    }

    /// Receives the node's frames. A sample is the last hop: from the node's `publish_ns` until the
    /// values were read.
    pub(super) fn receive(
        &mut self,
        span: &Span,
        stop: &AtomicBool,
        samples: &mut Distribution,
        stages: &mut Stages,
    ) -> Result<Received, EndError> {
        let mut received = Received::default();
        let mut last: Option<(u64, f64)> = None;
        let mut looks: u32 = 0;
        let mut now_ns = span.from_ns;
        while !stop.load(Ordering::Relaxed) {
            let Some(frame) = self.subscriber.next(now_ns) else {
                looks = looks.wrapping_add(1);
                if looks.is_multiple_of(LOOKS) {
                    now_ns = Monotonic.now_ns();
                }
                if now_ns > span.end_ns {
                    break;
                }
                continue;
            };
            let header = *frame.header();
            let Some(&value) = frame.values().first() else {
                return Err(EndError::Empty { sequence: header.sequence });
            };
            let received_ns = Monotonic.now_ns();
            let (before, value_before) = last.unwrap_or((header.sequence.wrapping_sub(1), 0.0));
            last = Some((header.sequence, value));
            // The publisher counts: what comes out of the node may stand still, but not fall.
            if value.is_nan() || value < value_before || value.fract() != 0.0 {
                let sequence = header.sequence;
                return Err(EndError::Damaged { sequence, sum: value, expected: value_before });
            }
            if header.publish_ns < span.from_ns {
                continue;
            }
            received.lost += header.sequence.wrapping_sub(before.wrapping_add(1));
            if header.publish_ns >= span.end_ns {
                break;
            }
            received.messages += 1;
            samples.record(received_ns.saturating_sub(header.publish_ns));
            if header.source_ns != 0 {
                let age = |at_ns: u64| at_ns.saturating_sub(header.source_ns);
                stages.age_at_release.record(age(header.release_ns));
                stages.age_at_publish.record(age(header.publish_ns));
                stages.end_to_end.record(age(received_ns));
            }
        }
        Ok(received)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_publisher_moves_through_the_node_s_period_from_round_to_round() {
        let phases: Vec<u64> = (0..4)
            .map(|round| (start_ns(5_300_000, round, 4) - EPOCH_OFFSET_NS) % PERIOD_NS)
            .collect();
        assert_eq!(phases, [125_000, 375_000, 625_000, 875_000]);
        assert!(start_ns(5_300_000, 0, 4) > 5_300_000);
    }
}
