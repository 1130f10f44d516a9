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
    /// Whether the cycles between them time out, though a frame is sent for nearly each: the source sends late
    /// because the task waits.
    pub alternate: bool,
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
    /// Nine of ten lay there at the release, and were then a quarter of the period old or more at the median:
    /// without `follow` they would hardly wait longer.
    Late(LateFrames),
}

/// Tells of a stretch of cycles when the frames came that they were to begin with.
#[derive(Debug, Clone, Default)]
pub struct Arrivals {
    /// Cycles with a frame whose publish time is known.
    frames: u64,
    /// How long after the release before their own those frames came that lay there at a release.
    came: Distribution,
    first: Option<Progress>,
    last: Progress,
}

/// How far the cycles and their source were.
#[derive(Debug, Clone, Copy, Default)]
struct Progress {
    releases: u64,
    sent: u64,
}

impl Arrivals {
    /// Adds the next cycle of a task with this period, in ns.
    pub fn record(&mut self, record: &CycleRecord, follow: &FollowRecord, period_ns: u64) {
        self.last = Progress { releases: record.cycle, sent: follow.sent };
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

    /// What they amount to for a task with this period, in ns.
    pub fn punctuality(&self, period_ns: u64) -> Punctuality {
        let Progress { releases, sent } = self.passed();
        let ready = self.came.count();
        let of_frames = |tenths: u64| self.frames.saturating_mul(tenths) / 10;
        let is_faster = sent > releases.saturating_add(releases / 50).saturating_add(1);
        if self.frames == 0 || is_faster || ready < of_frames(8) {
            return Punctuality::InTime;
        }
        if self.frames < FEWEST_FRAMES {
            return Punctuality::TooFew;
        }
        let came = |quantile| self.came.quantile(quantile);
        let (median_ns, p99_ns) = (came(0.5), came(0.99));
        let age_ns = period_ns.saturating_sub(median_ns);
        let due = sent.min(releases);
        // A source that the task holds up comes at no certain time.
        let alternate = self.frames < due - due / 4;
        let is_scattered = came(0.9).saturating_sub(came(0.1)) > period_ns / 4;
        if age_ns < period_ns / 5 || is_scattered && !alternate {
            return Punctuality::InTime;
        }
        if age_ns < period_ns / 4 || ready < of_frames(9) {
            return Punctuality::Between;
        }
        Punctuality::Late(LateFrames { median_ns, p99_ns, age_ns, alternate })
    }

    /// Between its first cycle and its last.
    fn passed(&self) -> Progress {
        let Progress { releases, sent } = self.first.unwrap_or_default();
        Progress {
            releases: self.last.releases.saturating_sub(releases),
            sent: self.last.sent.saturating_sub(sent),
        }
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
