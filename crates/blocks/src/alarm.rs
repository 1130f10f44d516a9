//! Alarm: whether a comparison has held for some time. What `[[alarm]]` in a configuration is made of.

use crate::{Block, Cycle};

crate::block! {
    /// Whether a comparison of two signals has held for some time. A configuration has it as `[[alarm]]`.
    pub Alarm {
        inputs {
            /// Left operand.
            "a" => a: f64,
            /// Right operand.
            "b" => b: f64 = 0.0,
            /// Whether the left operand can be believed.
            "aOk" => a_ok: bool = true,
            /// Whether the right operand can be believed.
            "bOk" => b_ok: bool = true,
            /// The comparison holds while `a` is greater than `b`.
            "above" => above: bool = false,
            /// The comparison holds while `a` equals `b`.
            "equal" => equal: bool = false,
            /// The comparison holds while `a` is less than `b`.
            "below" => below: bool = false,
            /// Added to `b` while the alarm is active.
            "hysteresis" => hysteresis: f64 = 0.0,
            /// For how many cycles the comparison must have held.
            "delay" => delay: f64 ["cycles"] = 0.0,
        }
        outputs {
            /// The comparison has held for as long as it must.
            "active" => active: bool,
            /// The comparison can be made: both operands are numbers and can be believed.
            "ok" => ok: bool,
        }
        state {
            /// Cycle from which the alarm is active if the comparison still holds.
            due: u64,
            /// While that is to come: the last cycle in which the comparison was made.
            seen: u64,
        }
        computes {
            "`active` becomes TRUE when the comparison has held for `delay` cycles of the grid, and FALSE when it does not hold.",
            "While it cannot be made, `active` stays as it is, and no time counts.",
        }
    }
}

/// `due` while the comparison does not hold.
const NORMAL: u64 = 0;
/// `due` while the alarm is active.
const ACTIVE: u64 = u64::MAX;

impl Block for Alarm {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let &Inputs { a, b, hysteresis, .. } = inputs;
        let was_active = state.due == ACTIVE;
        let limit = if was_active { b + hysteresis } else { b };
        // Only NaN is in no order.
        let ok = inputs.a_ok && inputs.b_ok && a.partial_cmp(&b).is_some();
        if !ok {
            if state.is_waiting() {
                state.hold(cycle.index());
            }
            return Outputs { active: was_active, ok };
        }
        let holds = if a > limit {
            inputs.above
        } else if a < limit {
            inputs.below
        } else {
            inputs.equal
        };
        // A state that lasts costs no more than that.
        if holds != was_active || state.is_waiting() {
            state.go_on(holds, inputs.delay, cycle.index());
        }
        Outputs { active: state.due == ACTIVE, ok }
    }

    /// A level below its limit.
    fn typical() -> Inputs {
        Inputs { a: 1.2, b: 1.6, a_ok: true, b_ok: true, above: true, ..Inputs::default() }
    }
}

impl State {
    #[inline]
    const fn is_waiting(&self) -> bool {
        self.due.wrapping_sub(1) < ACTIVE - 1
    }

    /// Lets no time count since the comparison was last made.
    #[cold]
    fn hold(&mut self, cycle: u64) {
        let held = cycle.saturating_sub(self.seen);
        // Never `ACTIVE`.
        self.due = self.due.saturating_add(held).min(ACTIVE - 1);
        self.seen = cycle;
    }

    #[cold]
    fn go_on(&mut self, holds: bool, delay: f64, cycle: u64) {
        if !holds {
            self.due = NORMAL;
            return;
        }
        if self.due == NORMAL {
            // Cycle 0 is no `NORMAL`: without a delay the alarm is active at once.
            self.due = cycle.saturating_add(delay as u64).clamp(1, ACTIVE - 1);
            if delay < 1.0 {
                self.due = ACTIVE;
            }
        }
        self.seen = cycle;
        if cycle >= self.due {
            self.due = ACTIVE;
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    const PERIOD_NS: u64 = 1_000_000;

    /// Level above 1.6 with a hysteresis of 0.1, after three cycles.
    const HIGH: Inputs = Inputs {
        a: 0.0,
        b: 1.6,
        a_ok: true,
        b_ok: true,
        above: true,
        equal: false,
        below: false,
        hysteresis: -0.1,
        delay: 3.0,
    };

    /// `active` and `ok` after each of these cycles.
    fn run(inputs: impl IntoIterator<Item = (u64, Inputs)>) -> Vec<(bool, bool)> {
        let mut state = State::default();
        let step = |(cycle, inputs): (u64, Inputs)| {
            let outputs = Alarm::step(&mut state, &inputs, &Cycle::new(cycle, PERIOD_NS, &[]));
            (outputs.active, outputs.ok)
        };
        inputs.into_iter().map(step).collect()
    }

    fn active(inputs: impl IntoIterator<Item = (u64, Inputs)>) -> Vec<bool> {
        run(inputs).into_iter().map(|(active, _)| active).collect()
    }

    #[test]
    fn it_is_what_a_block_must_be() {
        crate::testing::check::<Alarm>();
    }

    #[test]
    fn it_comes_after_its_delay_and_goes_at_the_limit_less_the_hysteresis() {
        let levels = [1.7, 1.7, 1.7, 1.7, 1.55, 1.5, 1.49, 1.6, 1.7];
        let cycles = (0..).zip(levels).map(|(cycle, a)| (cycle, Inputs { a, ..HIGH }));
        assert_eq!(active(cycles), [false, false, false, true, true, false, false, false, false]);
    }

    #[test]
    fn a_comparison_that_does_not_hold_for_a_cycle_begins_its_delay_anew() {
        let levels = [1.7, 1.7, 1.7, 1.6, 1.7, 1.7, 1.7, 1.7];
        let cycles = (0..).zip(levels).map(|(cycle, a)| (cycle, Inputs { a, ..HIGH }));
        assert_eq!(active(cycles).iter().position(|active| *active), Some(7));
    }

    #[test]
    fn cycles_that_an_overrun_skipped_count_as_time() {
        let high = Inputs { a: 2.0, ..HIGH };
        assert_eq!(active([(5, high), (9, high)]), [false, true]);
    }

    #[test]
    fn while_it_cannot_be_evaluated_it_stays_as_it_is_and_no_time_counts() {
        let high = Inputs { a: 2.0, ..HIGH };
        let nan = Inputs { a: f64::NAN, ..HIGH };
        let not_ok = Inputs { a: 0.0, a_ok: false, ..HIGH };
        let waiting = run([(0, high), (1, high), (2, nan), (7, not_ok), (8, high), (9, high)]);
        let expected = [(false, true), (false, true), (false, false), (false, false)];
        assert_eq!(waiting, [&expected[..], &[(false, true), (true, true)]].concat());
        let at_once = Inputs { delay: 0.0, ..high };
        let standing = run([(0, at_once), (1, nan), (2, not_ok), (3, Inputs { a: 0.0, ..HIGH })]);
        assert_eq!(standing, [(true, true), (true, false), (true, false), (false, true)]);
    }

    #[test]
    fn infinities_are_numbers() {
        let infinite = Inputs { a: f64::INFINITY, delay: 0.0, ..HIGH };
        let equal = Inputs { a: f64::NEG_INFINITY, b: f64::NEG_INFINITY, ..infinite };
        assert_eq!(run([(0, infinite), (1, equal)]), [(true, true), (false, true)]);
    }
}
