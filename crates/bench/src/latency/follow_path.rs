//! Through nodes that follow: one thread sends at the grid and watches for what comes back.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::{Clock, Cyclic, EPOCH_OFFSET_NS, Margin, Monotonic, Schedule, Wake};
use isochrone_ipc::{Depth, ForRealTime, FramePublisher, FrameSubscriber, ipc};
use isochrone_timing::Distribution;

use super::arms::{Arm, Pace};
use super::bench_node::{BenchNode, NodePlace};
use super::end::{End, EndError, Opening, PATIENCE, Place};
use super::in_flight::{InFlight, Returned};
use super::message::{Header, Message};
use super::node_path::{START_NS, Stages};
use super::ports::{layout, publish};
use super::turn::{self, Account, Received, Sent, Span};

/// Nodes begin their grids on multiples of this: with periods that divide it, it is known beforehand how
/// the grid of the sender lies to theirs.
const GRID_NS: u64 = 20_000_000;
const SHORTEST_NS: u64 = 100_000;
/// How long after the releases of the nodes the sender sends: until then they are sure to watch.
const LONGEST_LEAD_NS: u64 = 20_000;
const LONGEST_WITHIN_NS: u64 = 200_000;
/// How long is waited for the last messages of a turn.
const LAST_NS: u64 = 20_000_000;
/// Between two attempts to find the way through the nodes.
const ATTEMPT_NS: u64 = 5_000_000;
/// Values of attempts begin here, beyond those of messages.
const ATTEMPTS: u64 = 1 << 20;
/// Looks for a frame between two readings of the clock.
const LOOKS: u32 = 8;

/// The names of the nodes, first to last, ...
const NODES: [&str; 2] = ["first", "second"];
/// ... and the services that a value passes.
const FOLLOW: [&str; 2] = ["follow/in", "follow/out"];
const CHAIN: [&str; 3] = ["chain/in", "chain/between", "chain/out"];

/// The services that a value passes; none if the arm is another one.
const fn services(arm: Arm) -> &'static [&'static str] {
    match arm {
        Arm::Follow => &FOLLOW,
        Arm::Chain => &CHAIN,
        _ => &[],
    }
}

/// How many nodes follow each other in an arm; 0 if it is another one.
pub(super) const fn length(arm: Arm) -> usize {
    services(arm).len().saturating_sub(1)
}

/// The period of nodes at this pace; `None` if they cannot have it.
pub(super) fn period_ns(pace: Pace) -> Option<u64> {
    let period_ns = (1e9 / pace.hz()?).round() as u64;
    let is_possible = period_ns >= SHORTEST_NS && GRID_NS.is_multiple_of(period_ns);
    is_possible.then_some(period_ns)
}

/// The nodes of an arm, which run in these places.
pub(super) fn nodes(arm: Arm, period_ns: u64, places: &[NodePlace]) -> Vec<BenchNode> {
    let hops = services(arm).windows(2).zip(NODES).zip(places);
    let node = |((hop, name), place): ((&[&'static str], _), &NodePlace)| {
        let [input, output] = hop else { return None };
        let within_ns = Some((period_ns / 4).min(LONGEST_WITHIN_NS));
        Some(BenchNode { name, period_ns, within_ns, input, output, place: *place })
    };
    hops.filter_map(node).collect()
}

/// When to begin to send: a little after a release of the nodes.
pub(super) fn start_ns(earliest_ns: u64, period_ns: u64) -> u64 {
    let release_ns = earliest_ns.next_multiple_of(period_ns) + EPOCH_OFFSET_NS % period_ns;
    release_ns + (period_ns / 10).min(LONGEST_LEAD_NS)
}

/// The peer's end, which has nothing to do.
pub(super) fn open_peer() -> ForRealTime<Opening> {
    ForRealTime::nothing().map(|()| Box::new(|| Ok(Box::new(Bystander) as Box<dyn End>)) as Opening)
}

struct Bystander;

impl End for Bystander {
    fn send(&mut self, _: Header) -> Result<(), EndError> {
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(None)
    }
}

/// Both ends of the way.
pub(super) struct FollowPath {
    publisher: FramePublisher<ipc::Service>,
    subscriber: FrameSubscriber<ipc::Service>,
    in_flight: InFlight,
    attempts: u64,
}

/// What came of a turn.
pub(super) struct Passed {
    pub(super) sent: Sent,
    pub(super) received: Received,
    /// Cycles of the last node that had no new value to send.
    pub(super) timed_out: u64,
}

impl FollowPath {
    pub(super) fn open(arm: Arm, place: &Place<'_>) -> Result<ForRealTime<Self>, EndError> {
        let [first, .., last] = services(arm) else { return Err(EndError::Gone) };
        let publisher = place.participant.publisher(first, &layout(1))?;
        let subscriber = place.participant.subscriber(last, 2, Depth::All)?;
        let most = PATIENCE.as_nanos() as u64 / SHORTEST_NS;
        Ok(publisher.and(subscriber).map(|(publisher, subscriber)| Self {
            publisher: publisher.plain(),
            subscriber,
            in_flight: InFlight::with_room(most as usize),
            attempts: 0,
        }))
    }

    /// Waits until a value comes through the nodes.
    pub(super) fn await_nodes(&mut self, stop: &AtomicBool) -> Result<(), EndError> {
        let give_up_ns = Monotonic.now_ns() + START_NS;
        let first = ATTEMPTS + self.attempts;
        while !stop.load(Ordering::Relaxed) {
            let value = (ATTEMPTS + self.attempts) as f64;
            self.attempts += 1;
            let header = Header { sequence: 0, sent_ns: Monotonic.now_ns() };
            publish(&mut self.publisher, header, value)?;
            self.publisher.prepare();
            Monotonic.sleep_until_ns(Monotonic.now_ns() + ATTEMPT_NS);
            self.subscriber.maintain();
            while let Some(frame) = self.subscriber.next(Monotonic.now_ns()) {
                if frame.values().first().is_some_and(|value| *value >= first as f64) {
                    return Ok(());
                }
            }
            if Monotonic.now_ns() > give_up_ns {
                return Err(EndError::NoNode);
            }
        }
        Ok(())
    }

    /// Sends at absolute instants until the turn is over, and watches after each message until it has
    /// come back, or the next is due. A sample is the time from just before the values were written until
    /// those of the last node's frame were read.
    pub(super) fn measure(
        &mut self,
        span: &Span,
        period_ns: u64,
        stop: &Arc<AtomicBool>,
        samples: &mut Distribution,
        stages: &mut Stages,
    ) -> Result<Passed, EndError> {
        let schedule = Schedule::every(period_ns, Wake::Hybrid(Margin::default()));
        let mut cyclic = Cyclic::new(Monotonic, schedule, span.start_ns, stop.clone());
        let mut account = Account::default();
        let mut passed =
            Passed { sent: Sent::default(), received: Received::default(), timed_out: 0 };
        self.in_flight.begin(span.from_ns);
        while let Some(release) = cyclic.wait() {
            if release.release_ns >= span.end_ns {
                break;
            }
            let sequence = span.first + passed.sent.messages;
            let header = Header { sequence, sent_ns: Monotonic.now_ns() };
            publish(&mut self.publisher, header, header.value())?;
            passed.sent.messages += 1;
            self.in_flight.push(header);
            self.watch_until(cyclic.next_release_ns(), span, &mut passed, samples, stages)?;
            self.publisher.prepare();
            account.note(header, span);
            let silent_ns =
                self.in_flight.oldest_ns().map_or(0, |oldest_ns| header.sent_ns - oldest_ns);
            if u128::from(silent_ns) > PATIENCE.as_nanos() {
                return Err(EndError::Silent);
            }
        }
        let missed = turn::missed(&cyclic, span, period_ns, passed.sent.messages);
        passed.sent = account.close(Sent { missed, ..passed.sent });
        let last_ns = Monotonic.now_ns().saturating_add(LAST_NS);
        self.watch_until(last_ns, span, &mut passed, samples, stages)?;
        passed.received.lost += self.in_flight.counted();
        Ok(passed)
    }

    /// Watches until nothing is on its way, or until an instant.
    fn watch_until(
        &mut self,
        until_ns: u64,
        span: &Span,
        passed: &mut Passed,
        samples: &mut Distribution,
        stages: &mut Stages,
    ) -> Result<(), EndError> {
        let mut looks: u32 = 0;
        let mut now_ns = Monotonic.now_ns();
        while !self.in_flight.is_empty() && now_ns < until_ns {
            let Some(frame) = self.subscriber.next(now_ns) else {
                looks = looks.wrapping_add(1);
                if looks.is_multiple_of(LOOKS) {
                    now_ns = Monotonic.now_ns();
                }
                continue;
            };
            let header = *frame.header();
            let Some(&value) = frame.values().first() else {
                return Err(EndError::Empty { sequence: header.sequence });
            };
            now_ns = Monotonic.now_ns();
            match self.in_flight.take(value) {
                Returned::Message { sent, overtaken } => {
                    passed.received.lost += overtaken;
                    if sent.sent_ns < span.from_ns {
                        continue;
                    }
                    passed.received.messages += 1;
                    samples.record(now_ns.saturating_sub(sent.sent_ns));
                    if header.source_ns != 0 {
                        let age = |at_ns: u64| at_ns.saturating_sub(header.source_ns);
                        stages.age_at_publish.record(age(header.publish_ns));
                        stages.end_to_end.record(age(now_ns));
                    }
                }
                Returned::Again => {
                    let counts = (span.from_ns..span.end_ns).contains(&header.publish_ns);
                    passed.timed_out += u64::from(counts);
                }
                Returned::Stranger => {
                    let expected = self.in_flight.expected();
                    let sequence = header.sequence;
                    return Err(EndError::Damaged { sequence, sum: value, expected });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_have_the_paces_whose_periods_share_a_grid() {
        for (hz, period) in [(1_000.0, 1_000_000), (4_000.0, 250_000), (10_000.0, 100_000)] {
            assert_eq!(period_ns(Pace::Hz(hz)), Some(period));
        }
        assert_eq!(period_ns(Pace::Hz(50.0)), Some(20_000_000));
        for pace in [Pace::Hz(3_000.0), Pace::Hz(20_000.0), Pace::Hz(49.0), Pace::BackToBack] {
            assert_eq!(period_ns(pace), None, "{pace}");
        }
    }

    #[test]
    fn messages_are_sent_a_little_after_the_nodes_releases() {
        for (period_ns, after_ns) in [(1_000_000, 20_000), (250_000, 20_000), (100_000, 10_000)] {
            let start_ns = start_ns(5_300_001, period_ns);
            assert!((5_300_001..5_300_001 + 3 * period_ns).contains(&start_ns));
            assert_eq!((start_ns - EPOCH_OFFSET_NS) % period_ns, after_ns);
        }
    }

    #[test]
    fn each_node_of_a_chain_follows_the_one_before() {
        let places = [NodePlace { cpu: 0, priority: None }, NodePlace { cpu: 2, priority: None }];
        let chain = nodes(Arm::Chain, 250_000, &places);
        let hops: Vec<_> = chain.iter().map(|node| (node.input, node.output)).collect();
        assert_eq!(hops, [("chain/in", "chain/between"), ("chain/between", "chain/out")]);
        assert!(chain.iter().all(|node| node.within_ns == Some(62_500)));
        assert_eq!(chain[1].place, places[1]);
        assert_eq!(nodes(Arm::Follow, 1_000_000, &places[..1]).len(), length(Arm::Follow));
        assert_eq!(length(Arm::Ports), 0);
    }
}
