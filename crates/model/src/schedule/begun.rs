//! Causes that began cycles of a task that follows its data.

/// The cause that began a cycle of a task that follows its data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CycleStart {
    /// New data came while the task watched for it.
    Followed,
    /// New data lay there when the cycle stood ready at its release.
    FoundReady,
    /// The time for the wait was up, and nothing had come.
    TimedOut,
}

/// How many cycles of a task that follows its data began for which reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CycleStartCounts {
    /// Those whose data came while the task watched for it.
    pub followed: u64,
    /// Those whose data lay there at the release.
    pub found_ready: u64,
    /// Those that began without, because the time was up.
    pub timed_out: u64,
}

impl CycleStartCounts {
    /// Counts one more.
    pub fn add(&mut self, begun: CycleStart) {
        let count = match begun {
            CycleStart::Followed => &mut self.followed,
            CycleStart::FoundReady => &mut self.found_ready,
            CycleStart::TimedOut => &mut self.timed_out,
        };
        *count = count.saturating_add(1);
    }

    /// The counts since an earlier reading.
    #[must_use]
    pub const fn since(self, before: Self) -> Self {
        Self {
            followed: self.followed.saturating_sub(before.followed),
            found_ready: self.found_ready.saturating_sub(before.found_ready),
            timed_out: self.timed_out.saturating_sub(before.timed_out),
        }
    }
}
