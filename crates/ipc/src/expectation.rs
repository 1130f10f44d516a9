//! When the next frame of a service is due, and when to look for it. No ports, no clock.
//!
//! A reader cannot be woken: the thread that sends makes no call for it. But most writers are periodic, so
//! a reader that sleeps until the next frame is due finds it in one look.

use crate::FrameHeader;
use crate::lateness::Lateness;

/// Arrivals that the rhythm is learned from.
const REMEMBERED: usize = 8;
/// With so many, intervals tell more than what was announced.
const ENOUGH: usize = 4;
/// Between two looks for a frame that is late. Frames that follow each other faster are one arrival.
const SHORTEST_NAP_NS: u64 = 20_000;
/// Between two looks for a frame that nobody can predict.
const BLIND_NAP_NS: u64 = 100_000;
/// Between any two looks: no program ends later than this, and no writer that comes back is seen later.
const LONGEST_NAP_NS: u64 = 5_000_000;
/// A nap lasts at most this part of the time by which a frame is late …
const LATE_PART: u64 = 4;
/// … or of the time since the last frame, where there is no rhythm.
const BLIND_PART: u64 = 8;
/// A writer that is silent for so many periods has stopped, and may come back at any time.
const SILENT_PERIODS: u64 = 16;
/// How much the next interval counts in a period that is known roughly: one part in so many.
const SMOOTHING: u64 = 8;
/// How long a writer may be held up between its stamp and its sending, before the stamp is taken for one of
/// another clock.
const HELD_UP_NS: u64 = 1_000_000;
/// How old the first frame may be that a reader finds.
const BEFORE_ANY_LOOK_NS: u64 = 1_000_000_000;
/// The shortest period of a task.
const SHORTEST_PERIOD_NS: u64 = 10_000;
/// A reader whose buffer holds less than it takes to sleep sensibly sleeps for so long regardless.
const LEAST_LONGEST_NAP_NS: u64 = 500_000;

/// Learns a writer's rhythm and says when to look for its next frame. Never allocates.
#[derive(Debug)]
pub(crate) struct Expectation {
    /// The newest stands last.
    arrivals: [Arrived; REMEMBERED],
    count: usize,
    /// Of those, how many the rhythm was not yet learned from.
    fresh: usize,
    /// Whether frames came since the last look.
    has_news: bool,
    announced_ns: Option<u64>,
    rhythm: Option<Rhythm>,
    /// When the reader first looked.
    began_ns: Option<u64>,
    /// When it last looked and nothing waited.
    empty_ns: Option<u64>,
    lateness: Lateness,
    /// Frames that may wait for the reader.
    buffer: u64,
}

/// Frames that came together.
#[derive(Debug, Clone, Copy, Default)]
struct Arrived {
    /// When their cycle was due; 0 where the writer does not say.
    release_ns: u64,
    /// When the first of them was sent.
    sent_ns: u64,
    /// Whether its stamp is of another clock, and the reader's look stands in its place.
    is_foreign: bool,
    /// Whether others came with the first.
    has_company: bool,
}

/// Frames come every `period_ns`, the next one at `next_ns`.
#[derive(Debug, Clone, Copy)]
struct Rhythm {
    period_ns: u64,
    next_ns: u64,
    /// How far the arrivals lie from the grid, in all.
    deviation_ns: u64,
}

impl Expectation {
    /// For a reader for which so many frames may wait before one is lost to it.
    pub(crate) fn new(buffer: u64) -> Self {
        Self {
            arrivals: [Arrived::default(); REMEMBERED],
            count: 0,
            fresh: 0,
            has_news: false,
            announced_ns: None,
            rhythm: None,
            began_ns: None,
            empty_ns: None,
            lateness: Lateness::default(),
            buffer,
        }
    }

    /// Sets the period that the writer announced, in ns; 0: none.
    pub(crate) fn set_period(&mut self, period_ns: u64) {
        self.announced_ns = (period_ns > 0).then_some(period_ns);
    }

    /// What the writer takes to fill half of the buffer, as far as its period is known.
    pub(crate) fn longest_nap_ns(&self) -> u64 {
        let learned_ns = self.rhythm.map(|rhythm| rhythm.period_ns);
        let known_ns = learned_ns.into_iter().chain(self.announced_ns).min();
        let half_full_ns = (self.buffer / 2).saturating_mul(known_ns.unwrap_or(SHORTEST_PERIOD_NS));
        half_full_ns.clamp(LEAST_LONGEST_NAP_NS, LONGEST_NAP_NS)
    }

    /// Takes note of a frame. Real-time threads call this too: it only stores.
    pub(crate) fn note(&mut self, header: &FrameHeader) {
        let &FrameHeader { release_ns, publish_ns, .. } = header;
        if let Some(newest) = self.arrivals[..self.count].last_mut() {
            let end_ns = newest.sent_ns.saturating_add(SHORTEST_NAP_NS);
            if (newest.sent_ns.max(1)..end_ns).contains(&publish_ns) {
                newest.has_company = true;
                self.has_news = true;
                return;
            }
        }
        if self.count == REMEMBERED {
            self.arrivals.copy_within(1.., 0);
            self.count -= 1;
        }
        self.arrivals[self.count] =
            Arrived { release_ns, sent_ns: publish_ns, ..Arrived::default() };
        self.count += 1;
        self.fresh = (self.fresh + 1).min(self.count);
        self.has_news = true;
    }

    /// Takes note that the reader looks, at the first call after it slept.
    pub(crate) fn woke(&mut self, now_ns: u64) {
        self.lateness.woke(now_ns);
    }

    /// When to look again, given that nothing waits at `now_ns`; always later than that.
    pub(crate) fn next_look_ns(&mut self, now_ns: u64) -> u64 {
        self.learn(now_ns);
        self.empty_ns = Some(now_ns);
        let has_news = std::mem::take(&mut self.has_news);
        let nap_ns = match self.rhythm {
            // The rest of a burst.
            _ if has_news
                && self.arrivals[..self.count].iter().any(|arrived| arrived.has_company) =>
            {
                SHORTEST_NAP_NS
            }
            Some(rhythm) => rhythm.nap_ns(now_ns, self.lateness.margin_ns()),
            None => {
                let began_ns = *self.began_ns.get_or_insert(now_ns);
                let since_ns =
                    self.arrivals[..self.count].last().map_or(began_ns, |newest| newest.sent_ns);
                (now_ns.saturating_sub(since_ns) / BLIND_PART).max(BLIND_NAP_NS)
            }
        };
        let look_ns = now_ns.saturating_add(nap_ns.clamp(1, self.longest_nap_ns()));
        self.lateness.asked(now_ns, look_ns);
        look_ns
    }

    fn learn(&mut self, now_ns: u64) {
        if self.fresh == 0 {
            return;
        }
        // They were sent after the last look that found nothing and before this one.
        let empty_ns =
            self.empty_ns.unwrap_or(now_ns.saturating_sub(BEFORE_ANY_LOOK_NS)).min(now_ns);
        let plausible_ns = empty_ns.saturating_sub(HELD_UP_NS)..=now_ns;
        for arrived in &mut self.arrivals[self.count - self.fresh..self.count] {
            arrived.is_foreign = !plausible_ns.contains(&arrived.sent_ns);
            if arrived.is_foreign {
                arrived.sent_ns = now_ns;
            }
            arrived.sent_ns = arrived.sent_ns.max(empty_ns);
        }
        self.fresh = 0;
        self.forget_before_a_pause();
        self.rhythm = self.rhythm(self.rhythm.map(|rhythm| rhythm.period_ns));
    }

    fn rhythm(&self, known_ns: Option<u64>) -> Option<Rhythm> {
        let arrivals = &self.arrivals[..self.count];
        if arrivals.iter().any(|arrived| arrived.is_foreign) {
            return None;
        }
        if arrivals.len() < ENOUGH {
            return Rhythm::of(arrivals, self.announced_ns.or(known_ns)?);
        }
        let learned_ns = period_ns(arrivals)?;
        let is_near = |known_ns: &u64| known_ns.abs_diff(learned_ns) <= learned_ns / 4;
        let learned_ns = match known_ns.filter(is_near) {
            Some(known_ns) => known_ns - known_ns / SMOOTHING + learned_ns / SMOOTHING,
            None => learned_ns,
        };
        let periods_ns = [self.announced_ns.filter(is_near), Some(learned_ns)];
        let rhythms = periods_ns.into_iter().flatten().filter_map(|ns| Rhythm::of(arrivals, ns));
        rhythms.min_by_key(|rhythm| rhythm.deviation_ns)
    }

    /// What lies before a pause says nothing of what follows it.
    fn forget_before_a_pause(&mut self) {
        let arrivals = &mut self.arrivals[..self.count];
        if arrivals.len() < ENOUGH {
            return;
        }
        let pause_ns = Intervals::of(arrivals, |arrived| arrived.sent_ns)
            .median_ns()
            .saturating_mul(SILENT_PERIODS);
        let is_pause = |pair: &[Arrived]| {
            let interval_ns = pair[1].sent_ns.checked_sub(pair[0].sent_ns);
            interval_ns.is_none_or(|interval_ns| interval_ns > pause_ns)
        };
        if let Some(last) = arrivals.windows(2).rposition(is_pause) {
            arrivals.copy_within(last + 1.., 0);
            self.count -= last + 1;
        }
    }
}

impl Rhythm {
    /// `None` where the arrivals do not lie on a grid of this period.
    fn of(arrivals: &[Arrived], period_ns: u64) -> Option<Self> {
        let period = i64::try_from(period_ns).ok().filter(|period| *period > 0)?;
        let last_ns = arrivals.last()?.sent_ns;
        let mut phases = [0; REMEMBERED];
        let phases = &mut phases[..arrivals.len()];
        for (phase, arrived) in phases.iter_mut().zip(arrivals) {
            let before_ns = i64::try_from(last_ns.saturating_sub(arrived.sent_ns)).ok()?;
            let periods = (before_ns.checked_add(period / 2)?) / period;
            *phase = periods * period - before_ns;
        }
        phases.sort_unstable();
        let median = phases[phases.len() / 2];
        let deviations = phases.iter().map(|phase| phase.abs_diff(median));
        let near = deviations.clone().filter(|deviation| *deviation <= period_ns / 4).count();
        if near * 4 < phases.len() * 3 {
            return None;
        }
        Some(Self {
            period_ns,
            next_ns: last_ns.saturating_add_signed(median).saturating_add(period_ns),
            deviation_ns: deviations.fold(0, u64::saturating_add),
        })
    }

    /// The reader asks for `margin_ns` less than it is to sleep, and for the rest when it is woken too early.
    fn nap_ns(&self, now_ns: u64, margin_ns: u64) -> u64 {
        let Some(late_ns) = now_ns.checked_sub(self.next_ns) else {
            let early_ns = self.next_ns - now_ns;
            let margin_ns = margin_ns.min(self.period_ns / 4);
            return if early_ns > margin_ns { early_ns - margin_ns } else { early_ns };
        };
        let nap_ns = (late_ns / LATE_PART).max(SHORTEST_NAP_NS);
        if late_ns / self.period_ns >= SILENT_PERIODS {
            return nap_ns;
        }
        // That frame may have been left out; the one after it is due on the grid all the same.
        let to_next_ns = self.period_ns - late_ns % self.period_ns;
        nap_ns.min(to_next_ns.max(SHORTEST_NAP_NS))
    }
}

/// The times between arrivals.
struct Intervals {
    sorted_ns: [u64; REMEMBERED],
    count: usize,
}

impl Intervals {
    fn of(arrivals: &[Arrived], at_ns: impl Fn(&Arrived) -> u64) -> Self {
        let mut sorted_ns = [0; REMEMBERED];
        let count = arrivals.len().saturating_sub(1);
        for (interval_ns, pair) in sorted_ns.iter_mut().zip(arrivals.windows(2)) {
            *interval_ns = at_ns(&pair[1]).saturating_sub(at_ns(&pair[0]));
        }
        sorted_ns[..count].sort_unstable();
        Self { sorted_ns, count }
    }

    fn median_ns(&self) -> u64 {
        self.sorted_ns[self.count / 2].max(1)
    }

    /// The period that most of them are, or are a multiple of.
    fn period_ns(&self) -> Option<u64> {
        let median_ns = self.median_ns();
        let (mut whole_ns, mut periods) = (0_u64, 0_u64);
        for interval_ns in &self.sorted_ns[..self.count] {
            let multiple = interval_ns.saturating_add(median_ns / 2) / median_ns;
            if interval_ns.abs_diff(multiple.saturating_mul(median_ns)) <= median_ns / 4 {
                whole_ns = whole_ns.saturating_add(*interval_ns);
                periods = periods.saturating_add(multiple);
            }
        }
        whole_ns.checked_div(periods)
    }
}

/// Releases tell the period exactly, where the writer gives them.
fn period_ns(arrivals: &[Arrived]) -> Option<u64> {
    let has_releases = arrivals.iter().all(|arrived| arrived.release_ns > 0);
    let at_ns = |arrived: &Arrived| {
        if has_releases { arrived.release_ns } else { arrived.sent_ns }
    };
    Intervals::of(arrivals, at_ns).period_ns()
}

#[cfg(test)]
#[path = "expectation_tests.rs"]
mod tests;
