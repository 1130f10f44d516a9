//! The timing of cycles that begin with their data.

use isochrone_model::CycleStartCounts;

use crate::distribution::Distribution;
use crate::record::{CycleRecord, FollowRecord};

/// Fewest cycles with a frame by which it is judged when the frames come.
const FEWEST_FRAMES: u64 = 20;

/// Frames that come after their cycles gave up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LateFrames {
    /// How long after a release the task gave up that they come, in ns: the median ...
    pub median_ns: u64,
    /// ... and what 99 % of them do not exceed.
    pub p99_ns: u64,
    /// How old they are at the median when their cycle is released, in ns.
    pub age_ns: u64,
    /// Where they come now in time and now too late; `None`: nearly all are late, and each waits for the next
    /// release.
    pub in_vain: Option<InVain>,
}

impl LateFrames {
    /// Whether they are as late as others were, to a tolerance in ns. Those that come now in time and now too late
    /// have no certain time.
    pub fn are_like(&self, others: &Self, tolerance_ns: u64) -> bool {
        match (self.in_vain, others.in_vain) {
            (Some(_), Some(_)) => true,
            (None, None) => self.median_ns.abs_diff(others.median_ns) <= tolerance_ns,
            _ => false,
        }
    }
}

/// Cycles that timed out although a frame was sent for them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InVain {
    /// How many there were ...
    pub timed_out: u64,
    /// ... of so many.
    pub cycles: u64,
    /// Whether the frames come at any time of the period, and not always at about the same.
    pub scattered: bool,
}

/// When the frames of a stretch of cycles came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Punctuality {
    /// There were too few to tell.
    TooFew,
    /// None is late, or none came. Of a faster source the newest frame lies ready at any release; one of another
    /// period drifts through the grid.
    InTime,
    /// Neither that, nor late beyond doubt.
    Between,
    /// More than one cycle in ten timed out although a frame was sent for it. Or nine frames of ten lay there at
    /// the release, and were then a quarter of the period old or more at the median: without `follow` they would
    /// hardly wait longer.
    Late(LateFrames),
}

/// Tells of a stretch of cycles when the frames came that they were to begin with.
#[derive(Debug, Clone, Default)]
pub struct Arrivals {
    cycles: u64,
    /// How long after the release before their own those frames came that lay there at a release.
    ready: Distribution,
    /// How long after the release those came that were waited for.
    followed: Distribution,
    timed_out: u64,
    /// Cycles for which there was a frame.
    due: u64,
    /// Frames that were sent and are due to a cycle yet.
    credit: u64,
    sent: u64,
    releases: u64,
    last: Option<Progress>,
}

/// How far the cycles and their source were.
#[derive(Debug, Clone, Copy)]
struct Progress {
    release: u64,
    sent: u64,
    timed_out: u64,
}

/// As many frames are due to the cycles to come at most: one that came after its cycle had given up, and the next
/// one. So nothing that a faster source sent is due to cycles after its end.
const MOST_CREDIT: u64 = 2;

impl Arrivals {
    /// Adds the next cycle of a task with this period, in ns.
    pub fn record(&mut self, record: &CycleRecord, follow: &FollowRecord, period_ns: u64) {
        let FollowRecord { sent, begun: CycleStartCounts { timed_out, .. }, .. } = *follow;
        let progress = Progress { release: record.cycle, sent, timed_out };
        if let Some(last) = self.last.replace(progress) {
            let sent = sent.saturating_sub(last.sent);
            self.cycles += 1;
            self.sent = self.sent.saturating_add(sent);
            self.releases += record.cycle.saturating_sub(last.release);
            // When the frames of cycles with lost records arrived is unknown.
            self.timed_out += u64::from(timed_out > last.timed_out);
            self.credit = self.credit.saturating_add(sent).min(MOST_CREDIT);
            self.due += u64::from(self.credit > 0);
            self.credit = self.credit.saturating_sub(1);
        }
        let Some(frame_ns) = follow.frame_ns else { return };
        match record.release_ns.checked_sub(frame_ns).filter(|age_ns| *age_ns > 0) {
            Some(age_ns) => self.ready.record(period_ns.saturating_sub(age_ns)),
            None => self.followed.record(frame_ns.saturating_sub(record.release_ns)),
        }
    }

    /// Adds the stretch that came before these cycles or behind them.
    pub fn add(&mut self, stretch: &Self) {
        self.ready.merge(&stretch.ready);
        self.followed.merge(&stretch.followed);
        self.cycles += stretch.cycles;
        self.timed_out += stretch.timed_out;
        self.due += stretch.due;
        self.sent = self.sent.saturating_add(stretch.sent);
        self.releases += stretch.releases;
    }

    /// Begins another stretch with the next cycle.
    pub fn clear(&mut self) {
        self.ready.clear();
        self.followed.clear();
        (self.cycles, self.timed_out, self.due) = (0, 0, 0);
        (self.sent, self.releases) = (0, 0);
    }

    /// Their punctuality for a task with this period, in ns.
    pub fn punctuality(&self, period_ns: u64) -> Punctuality {
        let ready = self.ready.count();
        let frames = ready + self.followed.count();
        if frames == 0 {
            return Punctuality::InTime;
        }
        let without_frame = self.cycles.saturating_sub(self.due);
        let in_vain = self.timed_out.saturating_sub(without_frame);
        if in_vain > self.cycles / 10 {
            return match self.cycles {
                ..FEWEST_FRAMES => Punctuality::TooFew,
                _ => Punctuality::Late(self.in_vain(in_vain, period_ns)),
            };
        }
        let otherwise =
            if in_vain > self.cycles / 20 { Punctuality::Between } else { Punctuality::InTime };
        let of_frames = |tenths: u64| frames.saturating_mul(tenths) / 10;
        let is_faster = self.sent > self.releases.saturating_add(self.releases / 50) + 1;
        if is_faster || ready < of_frames(8) {
            return otherwise;
        }
        if frames < FEWEST_FRAMES {
            return Punctuality::TooFew;
        }
        let came = |quantile| self.ready.quantile(quantile);
        let (median_ns, p99_ns) = (came(0.5), came(0.99));
        let age_ns = period_ns.saturating_sub(median_ns);
        let is_scattered = came(0.9).saturating_sub(came(0.1)) > period_ns / 4;
        if age_ns < period_ns / 5 || is_scattered {
            return otherwise;
        }
        if age_ns < period_ns / 4 || ready < of_frames(9) {
            return Punctuality::Between;
        }
        Punctuality::Late(LateFrames { median_ns, p99_ns, age_ns, in_vain: None })
    }

    /// Of a stretch in which so many cycles timed out in vain.
    fn in_vain(&self, timed_out: u64, period_ns: u64) -> LateFrames {
        // Those that came too late, if there are any, are what is to be caught.
        let late = if self.ready.count() > 0 { &self.ready } else { &self.followed };
        let early = if self.followed.count() > 0 { &self.followed } else { &self.ready };
        let (median_ns, p99_ns) = (late.quantile(0.5), late.quantile(0.99));
        let span_ns = late.quantile(0.95).saturating_sub(early.quantile(0.05));
        let scattered = span_ns > period_ns / 4;
        let in_vain = Some(InVain { timed_out, cycles: self.cycles, scattered });
        LateFrames { median_ns, p99_ns, age_ns: period_ns.saturating_sub(median_ns), in_vain }
    }
}

/// Collects how long cycles waited for their data, and how soon they answered it.
#[derive(Debug, Clone, Default)]
pub(crate) struct FollowTiming {
    pub(crate) wait: Distribution,
    pub(crate) latency: Distribution,
    /// Of all cycles, also where earlier records were lost.
    pub(crate) begun: CycleStartCounts,
}

impl FollowTiming {
    /// A cycle behind the warm-up.
    pub(crate) fn record(&mut self, record: &CycleRecord, follow: &FollowRecord) {
        self.wait.record(record.start_ns.saturating_sub(record.release_ns));
        if let Some(latency_ns) = follow.latency_ns {
            self.latency.record(latency_ns);
        }
    }
}

#[cfg(test)]
#[path = "follow_tests.rs"]
mod tests;
