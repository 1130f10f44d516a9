//! Through nodes that follow: one thread sends at the grid and watches for what comes back.

use std::sync::atomic::{AtomicBool, Ordering};

use isochrone_cyclic::{Clock, Cyclic, EPOCH_OFFSET_NS, Margin, Monotonic, Schedule, Wake};
use isochrone_ipc::{Depth, ForRealTime, FramePublisher, FrameSubscriber, ipc};

use super::bench_node::{BenchNode, NodePlace, NodeSite, START_NS};
use super::end::{End, EndError, Opening, PATIENCE, Rendezvous, without_ports};
use super::frames::{layout, publish};
use super::in_flight::{InFlight, Returned};
use super::measuring::{Measuring, MeasuringOpening, Passed, Samples, Turn};
use super::message::{Header, Message};
use super::pace::SendPace;
use super::turn::{self, Account, SenderCounts, Span};

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

/// The names of the nodes, first to last.
const NODES: [&str; 2] = ["first", "second"];

/// The period of nodes at this pace; `None` if they cannot have it.
pub(super) fn period_ns(pace: SendPace) -> Option<u64> {
    let period_ns = (1e9 / pace.hz()?).round() as u64;
    let is_possible = period_ns >= SHORTEST_NS && GRID_NS.is_multiple_of(period_ns);
    is_possible.then_some(period_ns)
}

/// The nodes between services, which run in these places.
pub(super) fn nodes(
    services: &[&'static str],
    period_ns: u64,
    places: &[NodePlace],
) -> Vec<BenchNode> {
    let hops = services.windows(2).zip(NODES).zip(places);
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

/// Where two nodes run of which the second follows the first. They have the sender's CPU where there are only
/// two, as the thread that measures is the one that sends; the first one has it anyway.
pub(super) fn places(site: &NodeSite) -> [NodePlace; 2] {
    let at = |cpu| NodePlace { cpu, priority: site.priority };
    if !share_cpu(site) {
        return [at(site.sender_cpu), at(site.node_cpu)];
    }
    // On one CPU, one that watches must leave it to its source.
    let second = site.priority.unwrap_or_default().saturating_sub(1).max(1);
    [second + 1, second]
        .map(|priority| NodePlace { cpu: site.sender_cpu, priority: Some(priority) })
}

/// Whether both nodes run on one CPU.
pub(super) fn share_cpu(site: &NodeSite) -> bool {
    site.node_cpu == site.sender_cpu
}

/// The peer's end, which has nothing to do.
pub(super) fn open_peer() -> ForRealTime<Opening> {
    without_ports(Box::new(|| Ok(Box::new(Bystander) as Box<dyn End>)))
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

impl FollowPath {
    /// Opens both ends of the way through `services`.
    pub(super) fn open(
        services: &[&'static str],
        place: &Rendezvous<'_>,
    ) -> Result<ForRealTime<MeasuringOpening>, EndError> {
        let [first, .., last] = services else { return Err(EndError::Gone) };
        let publisher = place.participant.publisher(first, &layout(1))?;
        let subscriber = place.participant.subscriber(last, 2, Depth::All)?;
        let most = PATIENCE.as_nanos() as u64 / SHORTEST_NS;
        Ok(publisher.and(subscriber).map(|(publisher, subscriber)| {
            let path = Self {
                publisher: publisher.plain(),
                subscriber,
                in_flight: InFlight::with_room(most as usize),
                attempts: 0,
            };
            Box::new(move || Ok(Box::new(path) as Box<dyn Measuring>)) as MeasuringOpening
        }))
    }

    /// Watches until nothing is on its way, or until an instant.
    fn watch_until(
        &mut self,
        until_ns: u64,
        span: &Span,
        passed: &mut Passed,
        samples: &mut Samples,
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
                    samples.times.record(now_ns.saturating_sub(sent.sent_ns));
                    if header.source_ns != 0 {
                        let age = |at_ns: u64| at_ns.saturating_sub(header.source_ns);
                        samples.stages.age_at_publish.record(age(header.publish_ns));
                        samples.stages.end_to_end.record(age(now_ns));
                    }
                }
                Returned::Again => {
                    let counts = (span.from_ns..span.end_ns).contains(&header.publish_ns);
                    *passed.timed_out.get_or_insert_default() += u64::from(counts);
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

impl Measuring for FollowPath {
    /// Waits until a value comes through the nodes.
    fn await_nodes(&mut self, stop: &AtomicBool) -> Result<(), EndError> {
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
    fn turn(&mut self, turn: &Turn<'_>, samples: &mut Samples) -> Result<Passed, EndError> {
        let Turn { span, stop, period_ns: Some(period_ns), .. } = *turn else {
            return Err(EndError::Gone);
        };
        let schedule = Schedule::every(period_ns, Wake::Hybrid(Margin::default()));
        let mut cyclic = Cyclic::new(Monotonic, schedule, span.start_ns, stop.clone());
        let mut account = Account::default();
        let mut sent = SenderCounts::default();
        let mut passed = Passed { timed_out: Some(0), ..Passed::default() };
        self.in_flight.begin(span.from_ns);
        while let Some(release) = cyclic.wait() {
            if release.release_ns >= span.end_ns {
                break;
            }
            let sequence = span.first + sent.messages;
            let header = Header { sequence, sent_ns: Monotonic.now_ns() };
            publish(&mut self.publisher, header, header.value())?;
            sent.messages += 1;
            self.in_flight.push(header);
            self.watch_until(cyclic.next_release_ns(), span, &mut passed, samples)?;
            self.publisher.prepare();
            account.note(header, span);
            let silent_ns =
                self.in_flight.oldest_ns().map_or(0, |oldest_ns| header.sent_ns - oldest_ns);
            if u128::from(silent_ns) > PATIENCE.as_nanos() {
                return Err(EndError::Silent);
            }
        }
        let missed = turn::missed(&cyclic, span, period_ns, sent.messages);
        passed.sent = Some(account.close(SenderCounts { missed, ..sent }));
        let last_ns = Monotonic.now_ns().saturating_add(LAST_NS);
        self.watch_until(last_ns, span, &mut passed, samples)?;
        passed.received.lost += self.in_flight.counted();
        Ok(passed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_have_the_paces_whose_periods_share_a_grid() {
        for (hz, period) in [(1_000.0, 1_000_000), (4_000.0, 250_000), (10_000.0, 100_000)] {
            assert_eq!(period_ns(SendPace::Hz(hz)), Some(period));
        }
        assert_eq!(period_ns(SendPace::Hz(50.0)), Some(20_000_000));
        for pace in [
            SendPace::Hz(3_000.0),
            SendPace::Hz(20_000.0),
            SendPace::Hz(49.0),
            SendPace::BackToBack,
        ] {
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
}
