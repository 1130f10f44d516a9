//! The timing of cycles that begin with their data.

use crate::distribution::Distribution;
use crate::task::CycleRecord;

/// Fewest cycles with a frame by which it is judged when the frames come.
const FEWEST_FRAMES: u64 = 20;

/// What a cycle of a task that follows its data tells beside its [`CycleRecord`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FollowRecord {
    /// First clock reading at or after the release, in ns: from then on the cycle waited for data.
    pub ready_ns: u64,
    /// Cycles since the loop started whose data came while the task watched for it, including this one.
    pub followed: u64,
    /// Cycles whose data lay there at the release, including this one.
    pub found_ready: u64,
    /// Cycles that began without new data, because the time was up, including this one.
    pub timed_out: u64,
    /// Frames since the loop started that were received of what it follows, or lost, until this cycle.
    pub sent: u64,
    /// Publish time of the frame that the cycle began with, in ns; `None` if there is no such frame, or its
    /// stamp is of another clock.
    pub frame_ns: Option<u64>,
    /// Publish time of the cycle's last frame minus that of the frame that it began with, in ns; `None`
    /// if one of them is unknown.
    pub latency_ns: Option<u64>,
}

/// Frames that come after their cycles gave up, so that each waits for the next release.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LateFrames {
    /// How long after a release the task gave up that they come, in ns: the median ...
    pub median_ns: u64,
    /// ... and what 99 % of them do not exceed.
    pub p99_ns: u64,
    /// How old they are at the median when their cycle is released, in ns.
    pub age_ns: u64,
}

/// Tells of a stretch of cycles when the frames came that they were to begin with.
#[derive(Debug, Clone, Default)]
pub struct Arrivals {
    /// Cycles with a frame whose publish time is known.
    frames: u64,
    /// How long after the release before their own those frames came that lay there at a release.
    came: Distribution,
    first: Option<Passed>,
    last: Passed,
}

/// How far the cycles and their source were.
#[derive(Debug, Clone, Copy, Default)]
struct Passed {
    release: u64,
    sent: u64,
}

impl Arrivals {
    /// Adds the next cycle of a task with this period, in ns.
    pub fn record(&mut self, record: &CycleRecord, follow: &FollowRecord, period_ns: u64) {
        self.last = Passed { release: record.cycle, sent: follow.sent };
        self.first.get_or_insert(self.last);
        let Some(frame_ns) = follow.frame_ns else { return };
        self.frames += 1;
        if let Some(age_ns) = record.release_ns.checked_sub(frame_ns).filter(|age| *age > 0) {
            self.came.record(period_ns.saturating_sub(age_ns));
        }
    }

    /// Begins anew.
    pub fn clear(&mut self) {
        self.came.clear();
        (self.frames, self.first) = (0, None);
    }

    /// That nine of ten frames lay there at the release, and were then a quarter of the period, in ns, old or more
    /// at the median: without `follow` they would hardly wait longer. Of a faster source the newest frame lies
    /// there at any release, and is not late.
    pub fn late_frames(&self, period_ns: u64) -> Option<LateFrames> {
        let ready = self.came.count();
        let are_late = self.frames >= FEWEST_FRAMES && ready >= self.frames - self.frames / 10;
        if !are_late || self.is_faster() {
            return None;
        }
        let (median_ns, p99_ns) = (self.came.quantile(0.5), self.came.quantile(0.99));
        let age_ns = period_ns.saturating_sub(median_ns);
        (age_ns >= period_ns / 4).then_some(LateFrames { median_ns, p99_ns, age_ns })
    }

    /// Whether the source sends three frames or more in two periods.
    fn is_faster(&self) -> bool {
        let first = self.first.unwrap_or_default();
        let releases = self.last.release.saturating_sub(first.release);
        self.last.sent.saturating_sub(first.sent) > releases.saturating_add(releases / 2)
    }
}

/// Collects how long cycles waited for their data, and how soon they answered it.
#[derive(Debug, Clone, Default)]
pub(crate) struct FollowTiming {
    pub(crate) wait: Distribution,
    pub(crate) latency: Distribution,
    pub(crate) arrivals: Arrivals,
    pub(crate) followed: u64,
    pub(crate) found_ready: u64,
    pub(crate) timed_out: u64,
}

impl FollowTiming {
    /// The counts, which stand even where earlier records were lost.
    pub(crate) fn count(&mut self, follow: &FollowRecord) {
        self.followed = self.followed.max(follow.followed);
        self.found_ready = self.found_ready.max(follow.found_ready);
        self.timed_out = self.timed_out.max(follow.timed_out);
    }

    /// A cycle behind the warm-up.
    pub(crate) fn record(&mut self, record: &CycleRecord, follow: &FollowRecord, period_ns: u64) {
        self.wait.record(record.start_ns.saturating_sub(record.release_ns));
        self.arrivals.record(record, follow, period_ns);
        if let Some(latency_ns) = follow.latency_ns {
            self.latency.record(latency_ns);
        }
    }
}
