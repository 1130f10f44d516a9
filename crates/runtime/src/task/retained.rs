//! Copies of a task's state for the file that retains it: taken in the slack, and only where there is time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{TaskEngine, TaskPlan, TaskState};
use isochrone_timing::CycleRecord;
use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

use crate::keeping::state::layout_of;

/// A copy takes at most this part of the slack.
const PART_OF_SLACK: u64 = 4;
/// The cycles whose slack is looked at.
const WINDOW: usize = 1000;
/// Of those, how many may have left less than the copy needs: 1 %.
const SHORT: usize = WINDOW / 100;
/// How often a copy is tried; the median counts.
const TRIALS: usize = 5;

/// The end in the cycle.
pub(crate) struct Copier {
    sender: Sender<TaskState>,
    period_ns: u64,
    /// How much slack a cycle must leave.
    needed_ns: u64,
    slack: Window,
    shared: Arc<Wanted>,
}

/// The end in an ordinary thread.
#[derive(Debug)]
pub(crate) struct Copies {
    receiver: Receiver<TaskState>,
    shared: Arc<Wanted>,
    /// How much slack a copy needs, in ns.
    pub(crate) needs_ns: u64,
    /// What the task's blocks look like to this program.
    pub(crate) layout: u32,
    /// When the last copy came, in ns since 1970.
    pub(crate) unix_ns: u64,
}

/// What both ends know.
#[derive(Debug)]
pub(crate) struct Wanted {
    /// A copy is to be taken.
    is_wanted: AtomicBool,
    /// Too few cycles leave the time for a copy.
    is_short: AtomicBool,
}

impl Wanted {
    /// Has the next cycle take a copy that has the time.
    pub(crate) fn ask(&self) {
        self.is_wanted.store(true, Ordering::Relaxed);
    }

    /// Whether a copy is still to come.
    pub(crate) fn is_awaited(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed) && !self.is_short()
    }

    /// Whether too few cycles leave the time for a copy.
    pub(crate) fn is_short(&self) -> bool {
        self.is_short.load(Ordering::Relaxed)
    }
}

impl Copies {
    /// Takes in the newest copy, at this time in ns since 1970; whether one came since the last time.
    pub(crate) fn update(&mut self, unix_ns: u64) -> bool {
        let has_come = self.receiver.update();
        if has_come {
            self.unix_ns = unix_ns;
        }
        has_come
    }

    /// The copy that came last; the state at the beginning, if none has come.
    pub(crate) fn last(&mut self) -> &TaskState {
        self.receiver.read()
    }

    /// What both ends know.
    pub(crate) fn shared(&self) -> &Arc<Wanted> {
        &self.shared
    }
}

/// Both ends for a task, whose state is of this time, in ns since 1970. Measures how long a copy takes, into each of the
/// buffers, whose memory is in place then.
pub(crate) fn ends(engine: &TaskEngine, task: &TaskPlan, unix_ns: u64) -> (Copier, Copies) {
    let period_ns = task.settings.period_ns;
    let (mut sender, mut receiver) = TripleBuffer::new(&engine.state_now()).split();
    let mut trials = [0; TRIALS];
    for trial_ns in &mut trials {
        let began = Instant::now();
        engine.copy_state(sender.input_buffer_mut());
        *trial_ns = began.elapsed().as_nanos() as u64;
        sender.publish();
    }
    receiver.update();
    trials.sort_unstable();
    let needs_ns = trials[TRIALS / 2].saturating_mul(PART_OF_SLACK);
    let (is_wanted, is_short) = (AtomicBool::new(false), AtomicBool::new(needs_ns > period_ns));
    let shared = Arc::new(Wanted { is_wanted, is_short });
    let layout = layout_of(task);
    let copies = Copies { receiver, shared: Arc::clone(&shared), needs_ns, layout, unix_ns };
    (Copier { sender, period_ns, needed_ns: needs_ns, slack: Window::default(), shared }, copies)
}

impl Copier {
    /// Takes a copy after a cycle, if one is wanted and there is time; otherwise the next cycle tries. For the end of the
    /// slack.
    pub(crate) fn take(&mut self, engine: &TaskEngine, record: &CycleRecord) {
        self.take_at(engine, record, || Monotonic.now_ns());
    }

    fn take_at(&mut self, engine: &TaskEngine, record: &CycleRecord, now_ns: impl FnOnce() -> u64) {
        let left_ns =
            |at_ns: u64| self.period_ns.saturating_sub(at_ns.saturating_sub(record.release_ns));
        let is_short = left_ns(record.end_ns) < self.needed_ns;
        if self.slack.note(is_short) {
            let is_short = self.slack.short > SHORT;
            self.shared.is_short.store(is_short, Ordering::Relaxed);
        }
        let is_wanted = self.shared.is_wanted.load(Ordering::Relaxed) && self.slack.short <= SHORT;
        // Other work in the slack came before.
        if is_wanted && left_ns(now_ns()) >= self.needed_ns {
            engine.copy_state(self.sender.input_buffer_mut());
            self.sender.publish();
            self.shared.is_wanted.store(false, Ordering::Relaxed);
        }
    }

    /// Goes on with the state of another configuration, and leaves its own end in its place. The next cycle takes a
    /// copy.
    pub(crate) fn change(&mut self, new: &mut Self) {
        std::mem::swap(self, new);
        self.shared.ask();
    }
}

/// Which of the last cycles were short of time.
struct Window {
    was_short: [bool; WINDOW],
    next: usize,
    short: usize,
}

impl Default for Window {
    fn default() -> Self {
        Self { was_short: [false; WINDOW], next: 0, short: 0 }
    }
}

impl Window {
    /// Takes in a cycle; whether the number of short ones has changed.
    fn note(&mut self, is_short: bool) -> bool {
        let before = self.short;
        if let Some(oldest) = self.was_short.get_mut(self.next) {
            self.short = self.short + usize::from(is_short) - usize::from(*oldest);
            *oldest = is_short;
        }
        self.next = (self.next + 1) % WINDOW;
        self.short != before
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Plan, Rules, Source};

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;
    const RELEASE_NS: u64 = 5_000_000_000;

    fn both_ends() -> (Copier, Copies, TaskEngine) {
        let text = r#"
            [node]
            name = "n"
            [[task]]
            name = "t"
            period = "1ms"
            [[block]]
            name = "ramp"
            type = "LimRateOfChangeCI"
            in = { value = 25.0, setChangeRate = 10.0 }
        "#;
        let plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
        let engine = TaskEngine::build(&plan).unwrap().remove(0);
        let (mut copier, copies) = ends(&engine, &plan.tasks[0], 0);
        copier.needed_ns = PERIOD_NS / 2;
        (copier, copies, engine)
    }

    /// Tries a copy at the end of the slack of a cycle that took `took_ns`, where `elapsed_ns` have passed since its release.
    fn take(copier: &mut Copier, engine: &TaskEngine, took_ns: u64, elapsed_ns: u64) {
        let end_ns = RELEASE_NS + took_ns;
        let record = CycleRecord { release_ns: RELEASE_NS, end_ns, ..CycleRecord::default() };
        copier.take_at(engine, &record, || RELEASE_NS + elapsed_ns);
    }

    #[test]
    fn a_copy_is_taken_once_for_each_time_that_one_is_wanted() {
        let (mut copier, mut copies, mut engine) = both_ends();
        for cycle in 0..6 {
            engine.step(cycle);
            take(&mut copier, &engine, 0, 0);
            assert!(!copies.update(1), "nobody wants it");
            copies.shared().ask();
            take(&mut copier, &engine, 0, 0);
            assert!(copies.update(1) && !copies.shared().is_awaited());
            assert_eq!(copies.last().cycle, Some(cycle));
        }
    }

    #[test]
    fn a_cycle_that_leaves_no_time_leaves_the_copy_to_the_next() {
        let (mut copier, mut copies, engine) = both_ends();
        copies.shared().ask();
        take(&mut copier, &engine, 0, PERIOD_NS);
        assert!(!copies.update(1) && copies.shared().is_awaited());
        take(&mut copier, &engine, 0, 0);
        assert!(copies.update(1));
    }

    #[test]
    fn no_copy_is_taken_where_more_than_one_in_a_hundred_cycles_leaves_too_little_time() {
        let (mut copier, mut copies, engine) = both_ends();
        let shared = Arc::clone(copies.shared());
        shared.ask();
        (0..=SHORT).for_each(|_| take(&mut copier, &engine, PERIOD_NS, PERIOD_NS));
        assert!(shared.is_short() && !shared.is_awaited());
        copies.update(1);
        shared.ask();
        (0..WINDOW - SHORT - 1).for_each(|_| take(&mut copier, &engine, 0, 0));
        assert!(shared.is_short() && !copies.update(1), "others left none lately");
        take(&mut copier, &engine, 0, 0);
        assert!(!shared.is_short() && copies.update(1));
    }
}
