//! The state to report to a service manager: that the node is ready, that its tasks cycle, and how often.

use std::fmt::Write;

use isochrone_timing::CycleRecord;
use isochrone_timing::units::counted;

/// How often the status line is sent. Each wakes the manager and its listeners.
const STATUS_INTERVAL_NS: u64 = 5_000_000_000;
/// A start that waits for a task's phase, which may be an hour, asks for more time this often.
const EXTENSION_INTERVAL_NS: u64 = 5_000_000_000;
/// Twice the interval, so that one may be late.
const START_EXTENSION_US: u64 = 2 * EXTENSION_INTERVAL_NS / 1000;

/// The state of the tasks, and what of it was sent.
pub(super) struct Progress {
    tasks: Vec<Task>,
    /// Half of the watchdog's time, as sd_watchdog_enabled(3) wants it.
    feed_interval_ns: Option<u64>,
    is_ready: bool,
    /// Whether another process runs the cycles, and this one can take over.
    stands_by: bool,
    fed_ns: u64,
    status_ns: u64,
    extended_ns: u64,
}

pub(super) struct Task {
    period_ns: u64,
    /// The next cycle is due at this time at the latest.
    due_ns: u64,
    newest: Option<CycleRecord>,
    /// Cycles of earlier runs of the node.
    earlier: u64,
    /// Whether a cycle was completed since the watchdog was fed.
    has_cycled: bool,
}

impl Task {
    /// A task whose first cycle has this number and is due at this time.
    pub(super) fn new(period_ns: u64, due_ns: u64, first_cycle: u64) -> Self {
        Self { period_ns, due_ns, newest: None, earlier: first_cycle, has_cycled: false }
    }

    /// How many cycles it ran.
    fn ran(&self) -> u64 {
        // Every release up to the newest either ran or was missed.
        let of = |record: CycleRecord| record.cycle + 1 - self.earlier.min(record.cycle);
        self.newest.map_or(0, |newest| of(newest).saturating_sub(newest.missed))
    }

    fn note(&mut self, newest: &CycleRecord) {
        // Late cycles that are caught up lie in the past with their release.
        let from_ns = newest.release_ns.max(newest.end_ns);
        self.due_ns = from_ns.saturating_add(self.period_ns);
        self.newest = Some(*newest);
        self.has_cycled = true;
    }

    /// A task that has not cycled hangs, unless its next cycle is only to come: its period may be
    /// longer than the watchdog's.
    fn is_alive(&self, now_ns: u64) -> bool {
        self.has_cycled || now_ns < self.due_ns
    }
}

/// What is to be sent now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct News {
    ready: bool,
    feed: bool,
    /// The start takes longer, and is well.
    extend: bool,
    status: bool,
}

impl News {
    pub(super) fn is_any(self) -> bool {
        self != Self::default()
    }
}

impl Progress {
    pub(super) fn new(tasks: Vec<Task>, watchdog_us: Option<u64>) -> Self {
        let feed_interval_ns = watchdog_us.map(|us| us.saturating_mul(1000) / 2);
        Self {
            tasks,
            feed_interval_ns,
            is_ready: false,
            stands_by: false,
            fed_ns: 0,
            status_ns: 0,
            extended_ns: 0,
        }
    }

    /// Notes the newest cycle of a task.
    pub(super) fn note(&mut self, task: usize, newest: &CycleRecord) {
        if let Some(task) = self.tasks.get_mut(task) {
            task.note(newest);
        }
    }

    /// Another process runs the cycles at this time, and this one can take over or cannot yet.
    pub(super) fn stand_by(&mut self, is_ready: bool, now_ns: u64) {
        self.stands_by = is_ready;
        for task in &mut self.tasks {
            task.due_ns = task.due_ns.max(now_ns.saturating_add(task.period_ns));
        }
    }

    pub(super) fn news(&self, now_ns: u64) -> News {
        let has_passed = |interval_ns, since_ns| now_ns.saturating_sub(since_ns) >= interval_ns;
        let is_alive = self.tasks.iter().all(|task| task.is_alive(now_ns));
        let have_cycled = self.tasks.iter().all(|task| task.newest.is_some());
        let ready = !self.is_ready && (have_cycled || self.stands_by);
        let starts = !ready && !self.is_ready;
        let status = ready || has_passed(STATUS_INTERVAL_NS, self.status_ns);
        News {
            ready,
            // While a task hangs this stays false, and comes true as soon as it has cycled.
            feed: is_alive && self.feed_interval_ns.is_some_and(|ns| has_passed(ns, self.fed_ns)),
            extend: starts && is_alive && has_passed(EXTENSION_INTERVAL_NS, self.extended_ns),
            status,
        }
    }

    pub(super) fn note_sent(&mut self, news: News, now_ns: u64) {
        self.is_ready |= news.ready;
        if news.status {
            self.status_ns = now_ns;
        }
        if news.extend {
            self.extended_ns = now_ns;
        }
        if news.feed {
            self.fed_ns = now_ns;
            self.tasks.iter_mut().for_each(|task| task.has_cycled = false);
        }
    }

    pub(super) fn message(&self, news: News) -> String {
        let mut message = String::new();
        for (line, is_news) in [("READY=1\n", news.ready), ("WATCHDOG=1\n", news.feed)] {
            message += if is_news { line } else { "" };
        }
        // Writing to a string does not fail.
        if news.extend {
            let _ = writeln!(message, "EXTEND_TIMEOUT_USEC={START_EXTENSION_US}");
        }
        if news.status {
            let _ = writeln!(message, "STATUS={}", self.status());
        }
        message
    }

    /// One line, whatever the number of tasks: the manager ignores messages of more than 4 KiB.
    pub(super) fn status(&self) -> String {
        let newest = || self.tasks.iter().filter_map(|task| task.newest);
        let waiting = self.tasks.len() - newest().count();
        let missed: u64 = newest().map(|record| record.missed).sum();
        let cycles = counted(self.tasks.iter().map(Task::ran).sum::<u64>(), "cycle");
        match waiting {
            0 => format!("{cycles}, {missed} missed"),
            _ => format!("{cycles}, {missed} missed; first cycles to come: {waiting}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    const WATCHDOG_US: u64 = 200_000;

    /// Tasks of these periods whose first cycles are due at 1 s; the watchdog is fed every 100 ms.
    fn progress(periods_ms: &[u64]) -> Progress {
        let task = |period_ms: &u64| Task::new(period_ms * MS, 1000 * MS, 0);
        Progress::new(periods_ms.iter().map(task).collect(), Some(WATCHDOG_US))
    }

    /// A task completes a cycle `at_ms`.
    fn cycle(progress: &mut Progress, task: usize, cycle: u64, at_ms: u64) {
        let at_ns = at_ms * MS;
        let record = CycleRecord {
            cycle,
            release_ns: at_ns,
            end_ns: at_ns,
            missed: 1,
            ..Default::default()
        };
        progress.note(task, &record);
    }

    fn tell(progress: &mut Progress, at_ms: u64) -> News {
        let news = progress.news(at_ms * MS);
        progress.note_sent(news, at_ms * MS);
        news
    }

    #[test]
    fn the_node_is_ready_once_when_the_last_task_has_completed_its_first_cycle() {
        let mut progress = progress(&[10, 10]);
        assert!(!tell(&mut progress, 1000).ready);
        cycle(&mut progress, 0, 0, 1001);
        assert!(!tell(&mut progress, 1001).ready);
        cycle(&mut progress, 1, 0, 1002);
        assert!(tell(&mut progress, 1002).ready);
        assert!(!tell(&mut progress, 1003).ready);
    }

    #[test]
    fn what_could_not_be_told_is_told_at_the_next_look() {
        let mut progress = progress(&[10]);
        cycle(&mut progress, 0, 0, 1001);
        let news = progress.news(1002 * MS);
        assert!(news.ready && news.feed && news.status);
        assert_eq!(progress.news(1003 * MS), news);
    }

    #[test]
    fn the_watchdog_is_fed_at_half_its_time_while_all_tasks_cycle() {
        let mut progress = progress(&[10, 20]);
        let mut fed = Vec::new();
        for at_ms in (1000..1500).step_by(10) {
            cycle(&mut progress, 0, at_ms / 10, at_ms);
            cycle(&mut progress, 1, at_ms / 20, at_ms);
            if tell(&mut progress, at_ms).feed {
                fed.push(at_ms);
            }
        }
        assert_eq!(fed, [1000, 1100, 1200, 1300, 1400]);
    }

    #[test]
    fn one_task_that_hangs_starves_the_watchdog_and_one_that_comes_back_feeds_it_at_once() {
        let mut progress = progress(&[10, 10]);
        cycle(&mut progress, 1, 0, 1000);
        for at_ms in (1000..3000).step_by(10) {
            cycle(&mut progress, 0, at_ms / 10, at_ms);
            let fed = tell(&mut progress, at_ms).feed;
            assert_eq!(fed, at_ms == 1000, "{at_ms}");
        }
        cycle(&mut progress, 1, 1, 3000);
        assert!(tell(&mut progress, 3000).feed);
    }

    #[test]
    fn a_task_starves_the_watchdog_from_the_time_its_cycle_is_due_and_not_before() {
        let mut progress = progress(&[1000]);
        for at_ms in (500..5000).step_by(100) {
            if at_ms == 1000 {
                cycle(&mut progress, 0, 0, at_ms);
            }
            // At 2000 the cycle is due that does not come.
            assert_eq!(tell(&mut progress, at_ms).feed, at_ms < 2000, "{at_ms}");
        }
    }

    #[test]
    fn a_task_that_never_begins_starves_the_watchdog() {
        let mut progress = progress(&[10]);
        assert!(tell(&mut progress, 900).feed);
        assert!(!tell(&mut progress, 1000).feed);
    }

    #[test]
    fn without_a_watchdog_nothing_is_fed() {
        let mut progress = Progress { feed_interval_ns: None, ..progress(&[10]) };
        cycle(&mut progress, 0, 0, 1000);
        assert!(!tell(&mut progress, 1000).feed);
    }

    #[test]
    fn a_start_that_waits_for_a_phase_asks_for_more_time_and_one_that_hangs_does_not() {
        let mut progress = progress(&[10]);
        progress.tasks[0].due_ns = 60_000 * MS;
        let extended: Vec<u64> =
            (20..100).map(|s| s * 1000).filter(|ms| tell(&mut progress, *ms).extend).collect();
        assert_eq!(extended, [20, 25, 30, 35, 40, 45, 50, 55].map(|s| s * 1000));
        cycle(&mut progress, 0, 0, 100_000);
        assert!(!tell(&mut progress, 100_000).extend);
    }

    #[test]
    fn a_start_that_stood_for_a_moment_asks_for_more_time_once_all_tasks_cycle() {
        let mut progress = progress(&[10, 10]);
        progress.tasks[1].due_ns = 60_000 * MS;
        assert!(!tell(&mut progress, 20_000).extend);
        cycle(&mut progress, 0, 0, 20_100);
        assert!(tell(&mut progress, 20_101).extend);
        assert!(!tell(&mut progress, 20_102).extend);
    }

    #[test]
    fn the_status_is_told_with_readiness_and_every_five_seconds() {
        let mut progress = progress(&[10]);
        progress.status_ns = 1000 * MS;
        cycle(&mut progress, 0, 0, 1000);
        let sent: Vec<u64> =
            (1100..20_000).step_by(100).filter(|ms| tell(&mut progress, *ms).status).collect();
        assert_eq!(sent, [1100, 6100, 11_100, 16_100]);
    }

    #[test]
    fn the_status_counts_cycles_and_missed_releases_of_all_tasks() {
        let mut progress = progress(&[10, 20]);
        cycle(&mut progress, 0, 99, 1000);
        assert_eq!(progress.status(), "99 cycles, 1 missed; first cycles to come: 1");
        cycle(&mut progress, 1, 50, 1000);
        assert_eq!(progress.status(), "149 cycles, 2 missed");
        let news = News { ready: true, feed: true, extend: false, status: true };
        let message = "READY=1\nWATCHDOG=1\nSTATUS=149 cycles, 2 missed\n";
        assert_eq!(progress.message(news), message);
    }
}
