//! Alarm: whether a comparison has held for some time. What `[[alarm]]` in a configuration is made of.

use crate::{Block, Cycle, PinType, PinValue};

/// A BOOL as its slot holds it. An alarm is evaluated in every cycle, and most of the time nothing changes: it then
/// only copies and compares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth(pub f64);

impl PinValue for Truth {
    const TYPE: PinType = PinType::Bool;
    #[inline]
    fn from_slot(slot: f64) -> Self {
        Self(slot)
    }
    #[inline]
    fn into_slot(self) -> f64 {
        self.0
    }
}

crate::block! {
    /// Whether a comparison of two signals has held for some time. A configuration has it as `[[alarm]]`.
    pub Alarm {
        inputs {
            /// Left operand.
            "a" => a: f64,
            /// Right operand.
            "b" => b: f64 = 0.0,
            /// 1 if the left operand can be believed, else 0.
            "aOk" => a_ok: f64 = 1.0,
            /// 1 if the right operand can be believed, else 0.
            "bOk" => b_ok: f64 = 1.0,
            /// 1 if the comparison holds while `a` is greater than `b`, else 0.
            "above" => above: f64 = 0.0,
            /// 1 if the comparison holds while `a` equals `b`, else 0.
            "equal" => equal: f64 = 0.0,
            /// 1 if the comparison holds while `a` is less than `b`, else 0.
            "below" => below: f64 = 0.0,
            /// Added to `b` while the alarm is active; finite.
            "hysteresis" => hysteresis: f64 = 0.0,
            /// For how many cycles the comparison must have held.
            "delay" => delay: f64 ["cycles"] = 0.0,
        }
        outputs {
            /// The condition has held for as long as it must.
            "active" => active: Truth,
            /// The condition can be evaluated: its signals are numbers and can be believed.
            "ok" => ok: Truth,
        }
        state {
            /// 1 while the alarm is active, else 0.
            active: f64,
            /// While the delay runs: the cycle from which the alarm is active; else 0.
            due: u64,
            /// While the delay runs: the last cycle in which the comparison was made.
            seen: u64,
        }
        computes {
            "`active` becomes TRUE when the comparison has held for `delay` cycles of the grid, and FALSE when it does not hold.",
            "While it cannot be made, `active` stays as it is, and no time counts.",
        }
    }
}

impl Block for Alarm {
    #[inline]
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let &Inputs { a, b, hysteresis, delay, .. } = inputs;
        let limit = b + hysteresis * state.active;
        let holds = if a > limit {
            inputs.above
        } else if a < limit {
            inputs.below
        } else if a == limit {
            inputs.equal
        } else {
            f64::NAN
        };
        let believed = inputs.a_ok * inputs.b_ok;
        // NaN is equal to nothing.
        if holds == state.active && believed != 0.0 && state.due == 0 {
            return Outputs { active: Truth(state.active), ok: Truth(1.0) };
        }
        let holds = if believed != 0.0 { holds } else { f64::NAN };
        *state = change(state.active, state.due, state.seen, holds, delay, cycle.index());
        Outputs { active: Truth(state.active), ok: Truth(f64::from(u8::from(!holds.is_nan()))) }
    }

    /// A level below its limit.
    fn typical() -> Inputs {
        Inputs { a: 1.2, b: 1.6, a_ok: 1.0, b_ok: 1.0, above: 1.0, ..Inputs::default() }
    }
}

/// The state after a cycle that may change it. `holds` is NaN where the comparison cannot be made.
#[cold]
#[inline(never)]
fn change(active: f64, due: u64, seen: u64, holds: f64, delay: f64, cycle: u64) -> State {
    let is_waiting = due > 0;
    if holds.is_nan() {
        let held = if is_waiting { cycle.saturating_sub(seen) } else { 0 };
        return State { active, due: due.saturating_add(held), seen: cycle };
    }
    let due = if is_waiting { due } else { cycle.saturating_add(delay as u64) };
    if holds == 0.0 {
        State { active: 0.0, due: 0, seen: cycle }
    } else if active != 0.0 || cycle >= due {
        State { active: 1.0, due: 0, seen: cycle }
    } else {
        State { active, due, seen: cycle }
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
        a_ok: 1.0,
        b_ok: 1.0,
        above: 1.0,
        equal: 0.0,
        below: 0.0,
        hysteresis: -0.1,
        delay: 3.0,
    };

    /// `active` and `ok` after each of these cycles.
    fn run(inputs: impl IntoIterator<Item = (u64, Inputs)>) -> Vec<(bool, bool)> {
        let mut state = State::default();
        let step = |(cycle, inputs): (u64, Inputs)| {
            let outputs = Alarm::step(&mut state, &inputs, &Cycle::new(cycle, PERIOD_NS, &[]));
            (outputs.active.0 == 1.0, outputs.ok.0 == 1.0)
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
        let not_ok = Inputs { a: 0.0, a_ok: 0.0, ..HIGH };
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

    /// What an alarm is after each cycle, by its definition: the comparison held in each of the last cycles that were
    /// evaluated, from `delay` cycles before on.
    fn model(inputs: &[(u64, Inputs)]) -> Vec<(bool, bool)> {
        let (mut active, mut held) = (false, None);
        let mut before = 0;
        let step = |&(cycle, of): &(u64, Inputs)| {
            let ok = of.a_ok == 1.0 && of.b_ok == 1.0 && !of.a.is_nan() && !of.b.is_nan();
            let since = cycle - before;
            before = cycle;
            if !ok {
                return (active, ok);
            }
            let limit = if active { of.b + of.hysteresis } else { of.b };
            if of.a <= limit {
                (active, held) = (false, None);
            } else if !active {
                let time = held.map_or(0, |time| time + since);
                held = Some(time);
                active = time >= of.delay as u64;
            }
            (active, ok)
        };
        inputs.iter().map(step).collect()
    }

    proptest::proptest! {
        #[test]
        fn it_does_what_its_definition_says(
            delay in 0_u64..5,
            hysteresis in 0_u8..3,
            cycles in proptest::collection::vec((1_u64..3, 0_usize..6, proptest::bool::weighted(0.9)), 1..60),
        ) {
            let levels = [0.0, 1.0, 2.0, 3.0, f64::NAN, f64::INFINITY];
            let mut at = 0;
            let inputs: Vec<_> = cycles.iter().map(|(skip, level, ok)| {
                at += skip;
                let inputs = Inputs {
                    a: levels[*level],
                    b: 2.0,
                    a_ok: f64::from(u8::from(*ok)),
                    hysteresis: -f64::from(hysteresis),
                    delay: delay as f64,
                    ..HIGH
                };
                (at, inputs)
            }).collect();
            let found = run(inputs.clone());
            proptest::prop_assert_eq!(found, model(&inputs));
        }
    }
}
