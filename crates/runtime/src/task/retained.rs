//! Copies of a task's state for the file that retains it: taken in the slack, and only where there is time.

use std::time::Instant;

use isochrone_engine::{TaskEngine, TaskState};
use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

/// The copy takes at most this part of the slack.
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
    /// How often a copy was due and had no time.
    skipped: u64,
}

/// The end in the ordinary thread.
pub(crate) struct Kept {
    receiver: Receiver<TaskState>,
}

impl Kept {
    /// The newest copy, if one came since the last time.
    pub(crate) fn newest(&mut self) -> Option<&TaskState> {
        self.receiver.updated().then(|| self.receiver.read())
    }
}

/// Both ends for a task with this period; a copy is taken every `interval_ns`, at the most in each cycle. Measures how
/// long a copy takes, which faults in the memory that it goes to.
pub(crate) fn ends(engine: &TaskEngine, period_ns: u64, interval_ns: u64) -> (Keeper, Kept) {
    let (mut sender, receiver) = TripleBuffer::new(&engine.state_now()).split();
    let mut longest_ns = 0;
    // Each of the three buffers once.
    for _ in 0..3 {
        let began = Instant::now();
        engine.copy_state(sender.input_buffer_mut());
        longest_ns = longest_ns.max(began.elapsed().as_nanos() as u64);
        sender.publish();
    }
    let every = (interval_ns / period_ns.max(1)).max(1);
    let needed_ns = longest_ns.saturating_mul(PART_OF_SLACK);
    let slack = Window::default();
    (Keeper { sender, period_ns, every, cycles: 0, needed_ns, slack, skipped: 0 }, Kept { receiver })
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
        if slack_ns < self.needed_ns || !self.has_time() {
            self.skipped += 1;
            return;
        }
        engine.copy_state(self.sender.input_buffer_mut());
        self.sender.publish();
    }

    /// Whether 99 % of the last cycles left the time that a copy needs.
    fn has_time(&self) -> bool {
        self.slack.short <= SHORT
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

    fn keeper(interval_ns: u64) -> (Keeper, Kept, TaskEngine) {
        let text = r#"
            [node]
            name = "n"
            [[task]]
            name = "t"
            period = "1ms"
            [[block]]
            name = "saw"
            type = "SawTooth"
        "#;
        let plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
        let engine = TaskEngine::build(&plan).unwrap().remove(0);
        let (mut keeper, mut kept) = ends(&engine, PERIOD_NS, interval_ns);
        keeper.needed_ns = PERIOD_NS / 2;
        kept.newest();
        (keeper, kept, engine)
    }

    #[test]
    fn a_copy_is_taken_as_often_as_the_interval_says_and_at_most_in_each_cycle() {
        for (interval_ns, expected) in [(5 * PERIOD_NS, 4), (PERIOD_NS, 20), (1, 20)] {
            let (mut keeper, mut kept, mut engine) = keeper(interval_ns);
            let mut copies = 0;
            for cycle in 0..20 {
                engine.step(cycle);
                keeper.take(&engine, 0);
                let newest = kept.newest();
                copies += usize::from(newest.is_some());
                assert!(newest.is_none_or(|state| state.cycle == Some(cycle)));
            }
            assert_eq!(copies, expected);
        }
    }

    #[test]
    fn no_copy_is_taken_where_more_than_one_in_a_hundred_cycles_leaves_too_little_time() {
        let (mut keeper, mut kept, engine) = keeper(PERIOD_NS);
        let mut take = |response_ns| {
            keeper.take(&engine, response_ns);
            kept.newest().is_some()
        };
        assert!(!(0..=SHORT).any(|_| take(PERIOD_NS)), "the cycle itself has no time");
        assert!(!(0..WINDOW - SHORT - 1).any(|_| take(0)), "others had none lately");
        assert!((0..WINDOW).all(|_| take(0)));
    }
}
