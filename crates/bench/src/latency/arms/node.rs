//! From a publisher through a control node to a subscriber, and how old the value is at every stage.

use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::{Clock, EPOCH_OFFSET_NS, Monotonic};
use isochrone_ipc::{Depth, ForRealTime, FramePublisher, FrameSubscriber, ipc};

use crate::latency::arm::Transport;
use crate::latency::bench_node::{BenchNode, NODE_HZ, NODE_VALUES, NodePlace, NodeSite, START_NS};
use crate::latency::end::{End, EndError, Opening, Rendezvous};
use crate::latency::frames::{layout, publish};
use crate::latency::measuring::{Measuring, MeasuringOpening, Passed, Samples, Turn};
use crate::latency::message::{END, Header, Message};
use crate::latency::pace::SendPace;

const PERIOD_NS: u64 = (1e9 / NODE_HZ) as u64;
const INPUT: &str = "node/in";
const OUTPUT: &str = "node/out";
/// Looks for a frame between two readings of the clock.
const LOOKS: u32 = 256;

pub(super) struct Node;

impl Transport for Node {
    fn name(&self) -> &'static str {
        "node"
    }

    fn help(&self) -> &'static str {
        "Publisher, control node at 1 kHz, subscriber; paced with one value only"
    }

    /// The peer publishes what the node reads.
    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let publisher = place.participant.publisher(INPUT, &layout(1))?;
        Ok(publisher.map(|publisher| {
            let input = NodeInput { publisher: publisher.plain() };
            Box::new(move || Ok(Box::new(input) as Box<dyn End>)) as Opening
        }))
    }

    /// What the node publishes is read here.
    fn open_measuring(
        &self,
        place: &Rendezvous<'_>,
    ) -> Result<ForRealTime<MeasuringOpening>, EndError> {
        let subscriber = place.participant.subscriber(OUTPUT, 2, Depth::All)?;
        Ok(subscriber.map(|subscriber| {
            let output = NodeOutput { subscriber };
            Box::new(move || Ok(Box::new(output) as Box<dyn Measuring>)) as MeasuringOpening
        }))
    }

    fn has(&self, values: usize, pace: SendPace) -> bool {
        values == NODE_VALUES && pace == SendPace::Hz(NODE_HZ)
    }

    fn node_places(&self, site: &NodeSite) -> Vec<NodePlace> {
        vec![NodePlace { cpu: site.node_cpu, priority: site.priority }]
    }

    fn nodes(&self, _: Option<u64>, places: &[NodePlace]) -> Vec<BenchNode> {
        let node = |place: &NodePlace| BenchNode {
            name: "latency",
            period_ns: PERIOD_NS,
            within_ns: None,
            input: INPUT,
            output: OUTPUT,
            place: *place,
        };
        places.iter().map(node).collect()
    }

    /// The age of the value when the node reads it depends on what part of a period lies between, so that part
    /// moves through the whole period from round to round.
    fn start_ns(&self, earliest_ns: u64, _: Option<u64>, round: usize, rounds: usize) -> u64 {
        let part = (round as f64 + 0.5) / rounds.max(1) as f64;
        let phase_ns = (part * PERIOD_NS as f64) as u64;
        earliest_ns.next_multiple_of(PERIOD_NS) + EPOCH_OFFSET_NS % PERIOD_NS + phase_ns
    }
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

/// The measuring side: it reads what the node publishes.
struct NodeOutput {
    subscriber: FrameSubscriber<ipc::Service>,
}

impl Measuring for NodeOutput {
    /// Waits until the node sends; what it sends is thrown away.
    fn await_nodes(&mut self, stop: &AtomicBool) -> Result<(), EndError> {
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
    fn turn(&mut self, turn: &Turn<'_>, samples: &mut Samples) -> Result<Passed, EndError> {
        let Turn { span, stop, .. } = *turn;
        let mut passed = Passed::default();
        let received = &mut passed.received;
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
            samples.times.record(received_ns.saturating_sub(header.publish_ns));
            if header.source_ns != 0 {
                let age = |at_ns: u64| at_ns.saturating_sub(header.source_ns);
                samples.stages.age_at_release.record(age(header.release_ns));
                samples.stages.age_at_publish.record(age(header.publish_ns));
                samples.stages.end_to_end.record(age(received_ns));
            }
        }
        Ok(passed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_publisher_moves_through_the_node_s_period_from_round_to_round() {
        let phases: Vec<u64> = (0..4)
            .map(|round| (Node.start_ns(5_300_000, None, round, 4) - EPOCH_OFFSET_NS) % PERIOD_NS)
            .collect();
        assert_eq!(phases, [125_000, 375_000, 625_000, 875_000]);
        assert!(Node.start_ns(5_300_000, None, 0, 4) > 5_300_000);
    }
}
