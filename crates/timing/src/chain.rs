//! The timing of a chain of services, each of which is computed from the one before.

use std::collections::VecDeque;

use crate::chain_report::{ChainReport, HopReport};
use crate::distribution::{Distribution, encoded};

/// How long frames are remembered that a later one may be computed from.
const MEMORY_NS: u64 = 10_000_000_000;
/// The most frames of a service that are remembered.
const MOST_REMEMBERED: usize = 65_536;

/// A frame of one service of a chain; all times in ns of one clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ChainFrame {
    /// When its cycle was due; 0: the sender does not say.
    pub release_ns: u64,
    /// Time just before it was sent.
    pub publish_ns: u64,
    /// Time of the oldest sample that it was computed from; 0: none.
    pub source_ns: u64,
}

/// Computes how long values take through a chain of services, from the frames of all of them.
///
/// A frame names the time of the oldest sample behind it, and nodes hand that on. So a frame belongs to the
/// newest frame of the service before that was sent earlier and has the same source. Where nodes read
/// several inputs, the oldest of them hides the others: such frames are counted as
/// [`unknown`](HopReport::unknown), not guessed at.
///
/// - The *latency of a hop* is the time from the sending of a frame to the sending of the first frame that
///   is computed from it; the *latency of the chain* the same from its first to its last service.
/// - A frame that nothing is computed from, while a later one is passed on, is
///   [`lost`](HopReport::lost): a slower node takes only the newest.
#[derive(Debug, Clone)]
pub struct ChainTiming {
    /// By service, without the last.
    hops: Vec<Hop>,
    whole: Distribution,
    whole_lost: Skips,
}

/// The data of a service and of the link to the next one.
#[derive(Debug, Clone)]
struct Hop {
    remembered: VecDeque<Remembered>,
    /// How many frames were seen in all.
    seen: u64,
    /// The source of the first one.
    first_source_ns: Option<u64>,
    latency: Distribution,
    wait: Distribution,
    skips: Skips,
    repeated: u64,
    unknown: u64,
}

#[derive(Debug, Clone, Copy)]
struct Remembered {
    /// Counts the frames of the service.
    number: u64,
    publish_ns: u64,
    /// As a reader hands it on.
    source_ns: u64,
    origin: Option<Origin>,
}

/// The frame of the first service that a frame goes back to.
#[derive(Debug, Clone, Copy)]
struct Origin {
    number: u64,
    publish_ns: u64,
}

/// Counts the frames that were left out between those that were passed on.
#[derive(Debug, Clone, Copy, Default)]
struct Skips {
    last: Option<u64>,
    skipped: u64,
}

impl Skips {
    /// Records a frame by its number; whether it is passed on for the first time.
    fn note(&mut self, number: u64) -> bool {
        match self.last {
            Some(last) if number <= last => return false,
            Some(last) => self.skipped += number - last - 1,
            None => {}
        }
        self.last = Some(number);
        true
    }
}

impl ChainTiming {
    /// A chain of this many services, at least two, without any frames yet.
    pub fn new(services: usize) -> Self {
        Self {
            hops: (1..services.max(2)).map(|_| Hop::new()).collect(),
            whole: Distribution::new(),
            whole_lost: Skips::default(),
        }
    }

    /// Adds the next frame of a service, counted from 0. What it was computed from must have been added
    /// before: read the services from the last to the first, and add what came from the first to the last.
    pub fn record(&mut self, service: usize, frame: &ChainFrame) {
        let origin = match service.checked_sub(1) {
            None => self
                .hops
                .first()
                .map(|hop| Origin { number: hop.seen, publish_ns: frame.publish_ns }),
            Some(before) => self.hops.get_mut(before).and_then(|hop| hop.pass_on(frame)),
        };
        if let Some(hop) = self.hops.get_mut(service) {
            hop.remember(frame, origin);
        } else if let Some(origin) = origin.filter(|origin| self.whole_lost.note(origin.number)) {
            self.whole.record(frame.publish_ns - origin.publish_ns);
        }
    }

    /// The report of the chain of these services.
    pub fn report(&self, services: &[String]) -> ChainReport {
        let pairs = services.iter().zip(services.iter().skip(1));
        let hops = self.hops.iter().zip(pairs).map(|(hop, (from, to))| HopReport {
            from: from.clone(),
            to: to.clone(),
            latency_ns: hop.latency.summary(),
            wait_ns: hop.wait.summary(),
            lost: hop.skips.skipped,
            repeated: hop.repeated,
            unknown: hop.unknown,
            histograms: encoded([("latency_ns", &hop.latency), ("wait_ns", &hop.wait)]),
        });
        ChainReport {
            latency_ns: self.whole.summary(),
            lost: self.whole_lost.skipped,
            hops: hops.collect(),
            histograms: encoded([("latency_ns", &self.whole)]),
        }
    }
}

impl Hop {
    fn new() -> Self {
        Self {
            remembered: VecDeque::new(),
            seen: 0,
            first_source_ns: None,
            latency: Distribution::new(),
            wait: Distribution::new(),
            skips: Skips::default(),
            repeated: 0,
            unknown: 0,
        }
    }

    fn remember(&mut self, frame: &ChainFrame, origin: Option<Origin>) {
        let is_too_old =
            |oldest: &Remembered| oldest.publish_ns.saturating_add(MEMORY_NS) < frame.publish_ns;
        while self.remembered.front().is_some_and(is_too_old)
            || self.remembered.len() >= MOST_REMEMBERED
        {
            self.remembered.pop_front();
        }
        // The source that a reader passes on: one that is younger than its frame is ignored.
        let is_source = (1..=frame.publish_ns).contains(&frame.source_ns);
        let source_ns = if is_source { frame.source_ns } else { frame.publish_ns };
        self.first_source_ns.get_or_insert(source_ns);
        let (number, publish_ns) = (self.seen, frame.publish_ns);
        self.remembered.push_back(Remembered { number, publish_ns, source_ns, origin });
        self.seen += 1;
    }

    /// Finds what a frame of the next service was computed from.
    fn pass_on(&mut self, frame: &ChainFrame) -> Option<Origin> {
        let first_source_ns = self.first_source_ns?;
        let came_from = |sent: &&Remembered| {
            sent.source_ns == frame.source_ns && sent.publish_ns <= frame.publish_ns
        };
        // No frame was sent before its source.
        let mut since = self.remembered.iter().rev();
        let mut since = since.by_ref().take_while(|sent| sent.publish_ns >= frame.source_ns);
        let Some(sent) = since.find(came_from) else {
            // Its source may have been sent before the measurement began.
            let is_early = (1..=first_source_ns).contains(&frame.source_ns);
            self.unknown += u64::from(!is_early);
            return None;
        };
        if self.skips.note(sent.number) {
            self.latency.record(frame.publish_ns - sent.publish_ns);
            if frame.release_ns > 0 {
                self.wait.record(frame.release_ns.saturating_sub(sent.publish_ns));
            }
        } else {
            self.repeated += 1;
        }
        sent.origin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: u64 = 1_000;
    const MS: u64 = 1_000 * US;

    fn services(count: usize) -> Vec<String> {
        (0..count).map(|service| format!("s{service}")).collect()
    }

    fn sent(publish_ns: u64, source_ns: u64) -> ChainFrame {
        ChainFrame { release_ns: 0, publish_ns, source_ns }
    }

    /// Frames in the order in which they were sent.
    fn chain(count: usize, frames: impl IntoIterator<Item = (usize, ChainFrame)>) -> ChainReport {
        let mut timing = ChainTiming::new(count);
        frames.into_iter().for_each(|(service, frame)| timing.record(service, &frame));
        timing.report(&services(count))
    }

    #[test]
    fn each_hop_and_the_whole_way_have_their_latency() {
        let frames = (1..=20).flat_map(|n| {
            let at = n * MS;
            let second = ChainFrame { release_ns: at + 250 * US, ..sent(at + 300 * US, at) };
            [(0, sent(at, 0)), (1, second), (2, sent(at + 450 * US, at))]
        });
        let report = chain(3, frames);
        let times =
            |hop: &HopReport| (hop.latency_ns.min, hop.latency_ns.max, hop.latency_ns.count);
        assert_eq!(times(&report.hops[0]), (Some(300 * US), Some(300 * US), 20));
        assert_eq!(times(&report.hops[1]), (Some(150 * US), Some(150 * US), 20));
        assert_eq!((report.latency_ns.min, report.latency_ns.count), (Some(450 * US), 20));
        assert_eq!(report.hops[0].wait_ns.max, Some(250 * US), "until the release");
        assert_eq!(report.hops[1].wait_ns.count, 0, "no release, no wait");
        assert!(report.hops.iter().all(|hop| hop.lost + hop.repeated + hop.unknown == 0));
    }

    #[test]
    fn a_slower_node_loses_frames_and_a_faster_one_repeats_them() {
        let frames = (1..=30).flat_map(|n| {
            let at = n * MS;
            let second = (n % 3 == 0).then_some((1, sent(at + US, at)));
            let newest = at - n % 3 * MS;
            let third = (n >= 3).then_some((2, sent(at + 2 * US, newest)));
            [Some((0, sent(at, 0))), second, third].into_iter().flatten()
        });
        let report = chain(3, frames);
        let [first, second] = &report.hops[..] else { panic!("{report:?}") };
        assert_eq!((first.latency_ns.count, first.lost, first.repeated), (10, 18, 0));
        assert_eq!((second.latency_ns.count, second.lost, second.repeated), (10, 0, 18));
        assert_eq!((report.latency_ns.count, report.lost), (10, 18));
    }

    #[test]
    fn a_chain_may_begin_behind_another_source() {
        let frames = (1..=10).flat_map(|n| {
            // The source of all is held for five frames: each frame goes back to the newest one.
            let (at, source_ns) = (10 * MS + n * MS, 2 * MS + n / 5);
            [(0, sent(at, source_ns)), (1, sent(at + 40 * US, source_ns))]
        });
        let report = chain(2, frames);
        assert_eq!((report.latency_ns.max, report.latency_ns.count), (Some(40 * US), 10));
        assert_eq!((report.lost, report.hops[0].unknown), (0, 0));
    }

    #[test]
    fn what_another_input_hides_is_unknown() {
        let frames = (1..=10).flat_map(|n| {
            let at = n * MS;
            [(0, sent(at, 0)), (1, sent(at + 40 * US, at - 300 * US)), (1, sent(at + 50 * US, 0))]
        });
        let report = chain(2, frames);
        // The first of them may go back to a frame that was sent before the measurement.
        assert_eq!((report.latency_ns.count, report.hops[0].unknown), (0, 19));
    }

    #[test]
    fn what_was_computed_before_the_first_frame_is_left_out() {
        let frames =
            [(1, sent(900, 300)), (0, sent(MS, 0)), (1, sent(MS + 5, 400)), (1, sent(MS + 9, MS))];
        let report = chain(2, frames);
        assert_eq!((report.latency_ns.max, report.hops[0].unknown), (Some(9), 0));
        // The first frame may repeat a source that was passed on before.
        let frames = [(0, sent(MS, 700)), (1, sent(900, 700)), (1, sent(MS + 9, 700))];
        let report = chain(2, frames);
        assert_eq!((report.latency_ns.max, report.hops[0].unknown), (Some(9), 0));
    }

    #[test]
    fn a_frame_is_not_computed_from_a_later_one() {
        let frames = [(0, sent(MS, 0)), (0, sent(3 * MS, MS)), (1, sent(2 * MS, MS))];
        assert_eq!(chain(2, frames).latency_ns.max, Some(MS));
    }

    #[test]
    fn the_memory_of_a_long_measurement_is_bounded() {
        let mut timing = ChainTiming::new(2);
        for n in 1..=100_000 {
            timing.record(0, &sent(n * MS, 0));
        }
        let remembered = timing.hops[0].remembered.len();
        assert!(remembered <= 10_001, "{remembered}");
    }
}
