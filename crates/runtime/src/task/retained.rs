//! Copies of a task's state for the file that retains it: taken in the slack, and only where there is time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use isochrone_engine::{TaskEngine, TaskState};
use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

/// A copy takes at most this part of the slack.
const PART_OF_SLACK: u64 = 4;
/// The cycles whose slack is looked at.
const WINDOW: usize = 1000;
/// Of those, how many may have left less than the copy needs: 1 %.
const SHORT: usize = WINDOW / 100;

/// The end in the cycle.
pub(crate) struct Keeper {
    sender: Sender<TaskState>,
    period_ns: u64,
    /// A copy is taken every so many cycles.
    every: u64,
    cycles: u64,
    /// How much slack a cycle must leave.
    needed_ns: u64,
    slack: Window,
    /// Whether the last copy that was due had no time.
    is_short: Arc<AtomicBool>,
}

/// The end in an ordinary thread.
#[derive(Debug)]
pub(crate) struct Copies {
    receiver: Receiver<TaskState>,
    is_short: Arc<AtomicBool>,
    /// The shortest period in which a copy has time, in ns.
    needs_ns: u64,
}

impl Copies {
    /// The newest copy, if one came since the last time.
    pub(crate) fn newest(&mut self) -> Option<&TaskState> {
        self.receiver.updated().then(|| self.receiver.read())
    }

    /// The copy that came last.
    pub(crate) fn last(&mut self) -> &TaskState {
        self.receiver.read()
    }

    /// Whether the last copy that was due had no time.
    pub(crate) fn is_short(&self) -> &Arc<AtomicBool> {
        &self.is_short
    }

    /// The shortest period in which a copy has time, in ns.
    pub(crate) fn needs_ns(&self) -> u64 {
        self.needs_ns
    }
}

/// Both ends for a task with this period; a copy is taken every `interval_ns`, at the most in each cycle. Measures how
/// long a copy takes, into each of the buffers, whose memory is in place then.
pub(crate) fn ends(engine: &TaskEngine, period_ns: u64, interval_ns: u64) -> (Keeper, Copies) {
    let (mut sender, mut receiver) = TripleBuffer::new(&engine.state_now()).split();
    let mut shortest_ns = u64::MAX;
    for _ in 0..3 {
        let began = Instant::now();
        engine.copy_state(sender.input_buffer_mut());
        shortest_ns = shortest_ns.min(began.elapsed().as_nanos() as u64);
        sender.publish();
    }
    receiver.update();
    let needed_ns = shortest_ns.saturating_mul(PART_OF_SLACK);
    let is_short = Arc::new(AtomicBool::new(needed_ns > period_ns));
    let copies = Copies { receiver, is_short: Arc::clone(&is_short), needs_ns: needed_ns };
    let every = (interval_ns / period_ns.max(1)).max(1);
    let slack = Window::default();
    (Keeper { sender, period_ns, every, cycles: 0, needed_ns, slack, is_short }, copies)
}

impl Keeper {
    /// Takes a copy after a cycle of `response_ns` from release to end, if one is due and there is time. For the slack.
    pub(crate) fn take(&mut self, engine: &TaskEngine, response_ns: u64) {
        let slack_ns = self.period_ns.saturating_sub(response_ns);
        self.slack.note(slack_ns < self.needed_ns);
        self.cycles = self.cycles.wrapping_add(1);
        if !self.cycles.is_multiple_of(self.every) {
            return;
        }
        let has_time = slack_ns >= self.needed_ns && self.slack.short <= SHORT;
        self.is_short.store(!has_time, Ordering::Relaxed);
        if has_time {
            engine.copy_state(self.sender.input_buffer_mut());
            self.sender.publish();
        }
    }

    /// Goes on with the state of another configuration, and leaves its own end in its place. The next cycle takes a
    /// copy.
    pub(crate) fn change(&mut self, new: &mut Self) {
        std::mem::swap(self, new);
        self.cycles = self.every.wrapping_sub(1);
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
    fn note(&mut self, is_short: bool) {
        if let Some(oldest) = self.was_short.get_mut(self.next) {
            self.short = self.short + usize::from(is_short) - usize::from(*oldest);
            *oldest = is_short;
        }
        self.next = (self.next + 1) % WINDOW;
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Plan, Rules, Source};

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    fn both_ends(interval_ns: u64) -> (Keeper, Copies, TaskEngine) {
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
        let (mut keeper, copies) = ends(&engine, PERIOD_NS, interval_ns);
        keeper.needed_ns = PERIOD_NS / 2;
        (keeper, copies, engine)
    }

    #[test]
    fn a_copy_is_taken_as_often_as_the_interval_says_and_at_most_in_each_cycle() {
        for (interval_ns, expected) in [(5 * PERIOD_NS, 4), (PERIOD_NS, 20), (1, 20)] {
            let (mut keeper, mut copies, mut engine) = both_ends(interval_ns);
            let mut count = 0;
            for cycle in 0..20 {
                engine.step(cycle);
                keeper.take(&engine, 0);
                let newest = copies.newest();
                count += usize::from(newest.is_some());
                assert!(newest.is_none_or(|state| state.cycle == Some(cycle)));
            }
            assert_eq!(count, expected);
        }
    }

    #[test]
    fn no_copy_is_taken_where_more_than_one_in_a_hundred_cycles_leaves_too_little_time() {
        let (mut keeper, mut copies, engine) = both_ends(PERIOD_NS);
        let is_short = Arc::clone(copies.is_short());
        let mut take = |response_ns| {
            keeper.take(&engine, response_ns);
            let is_taken = copies.newest().is_some();
            assert_eq!(is_short.load(Ordering::Relaxed), !is_taken);
            is_taken
        };
        assert!(!(0..=SHORT).any(|_| take(PERIOD_NS)), "the cycle itself has no time");
        assert!(!(0..WINDOW - SHORT - 1).any(|_| take(0)), "others had none lately");
        assert!((0..WINDOW).all(|_| take(0)));
    }
}
