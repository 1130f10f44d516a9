//! Alarm: whether a comparison has held for some time. What `[[alarm]]` in a configuration is made of.

use core::cmp::Ordering;

use crate::{Block, Cycle, Declaration, PinValue, Slots, Words};

crate::block! {
    /// Whether a comparison of two signals has held for some time. A configuration has it as `[[alarm]]`.
    pub Alarm {
        inputs {
            /// Left operand.
            "a" => a: f64,
            /// Right operand.
            "b" => b: f64 = 0.0,
            /// The left operand can be believed.
            "aOk" => a_ok: bool = true,
            /// The right operand can be believed.
            "bOk" => b_ok: bool = true,
            /// The comparison holds while `a` is greater than `b`.
            "above" => above: bool = false,
            /// The comparison holds while `a` equals `b`.
            "equal" => equal: bool = false,
            /// The comparison holds while `a` is less than `b`.
            "below" => below: bool = false,
            /// Added to `b` while the alarm is active; finite.
            "hysteresis" => hysteresis: f64 = 0.0,
            /// For how many cycles the comparison must have held.
            "delay" => delay: f64 ["cycles"] = 0.0,
        }
        outputs {
            /// The condition has held for as long as it must.
            "active" => active: bool,
            /// The condition can be evaluated: its signals are numbers and can be believed.
            "ok" => ok: bool,
        }
        state {
            /// 1 while the alarm is active, else 0.
            active: f64,
            /// Nothing changes while `a` stays below (1) or above (-1) the limit, or equals it (NaN); 0: there is no such
            /// place, for example as the delay runs.
            side: f64,
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
    fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        let believed = inputs.a_ok && inputs.b_ok;
        let holds = inputs.compare(state.is_active()).filter(|_| believed).map(|(_, holds)| holds);
        let next = state.after(holds, inputs.delay, cycle.index());
        let active = next.is_active();
        let stays = inputs.compare(active).filter(|(_, holds)| next.due == 0 && *holds == active);
        let side = match stays {
            None => 0.0,
            Some((Ordering::Less, _)) => 1.0,
            Some((Ordering::Greater, _)) => -1.0,
            Some((Ordering::Equal, _)) => f64::NAN,
        };
        *state = State { side, ..next };
        Outputs { active, ok: holds.is_some() }
    }

    /// A delay that runs still has as long to run.
    fn change_period(state: &mut State, cycle: u64, [old_ns, new_ns]: [u64; 2]) {
        if state.due > 0 {
            let left_ns = state.due.saturating_sub(cycle).saturating_mul(old_ns);
            state.due = cycle.saturating_add(left_ns.div_ceil(new_ns.max(1)));
        }
    }

    /// A level below its limit.
    fn typical() -> Inputs {
        Inputs { a: 1.2, b: 1.6, a_ok: true, b_ok: true, above: true, ..Inputs::default() }
    }
}

impl Inputs {
    /// Where `a` stands, and whether the comparison holds there; `None`: it cannot be made.
    fn compare(&self, active: bool) -> Option<(Ordering, bool)> {
        let limit = self.b + self.hysteresis * active.into_slot();
        let side = self.a.partial_cmp(&limit)?;
        let holds = match side {
            Ordering::Greater => self.above,
            Ordering::Equal => self.equal,
            Ordering::Less => self.below,
        };
        Some((side, holds))
    }
}

impl State {
    pub(crate) fn is_active(&self) -> bool {
        self.active != 0.0
    }

    /// The state after a cycle. `holds` is `None` where the condition cannot be evaluated.
    pub(crate) fn after(&self, holds: Option<bool>, delay: f64, cycle: u64) -> Self {
        let (active, is_waiting) = (self.is_active(), self.due > 0);
        let due = if is_waiting { self.due } else { cycle.saturating_add(delay as u64) };
        let (active, due) = match holds {
            None if is_waiting => (active, due.saturating_add(cycle.saturating_sub(self.seen))),
            None => (active, 0),
            Some(true) if !active && cycle < due => (active, due),
            Some(holds) => (holds, 0),
        };
        Self { active: active.into_slot(), side: 0.0, due, seen: cycle }
    }
}

/// The pins of an alarm that are read where their wires come from: each wire that is not copied spares every cycle
/// several instructions.
#[derive(Clone, Copy, Debug)]
pub struct AlarmReads {
    a: u32,
    /// Whether the operands can be believed, of those of which something says so.
    ok: u32,
    other_ok: u32,
}

/// No slot, as images are smaller.
const NOWHERE: u32 = u32::MAX;
const SLOTS: usize = <Inputs as Slots>::LEN + <Outputs as Slots>::LEN;
const WORDS: usize = <State as Words>::LEN;

impl Default for AlarmReads {
    fn default() -> Self {
        Self { a: NOWHERE, ok: NOWHERE, other_ok: NOWHERE }
    }
}

impl AlarmReads {
    /// Takes a wire from a slot to a pin, which is given by its place among the inputs. `false`: that pin is not read in
    /// place, so the wire must be copied.
    pub fn take(&mut self, pin: usize, from: u32) -> bool {
        let place = match Alarm::INPUTS.get(pin).map(|pin| pin.name) {
            Some("a") => &mut self.a,
            Some("aOk" | "bOk") if self.ok == NOWHERE => &mut self.ok,
            Some("aOk" | "bOk") => &mut self.other_ok,
            _ => return false,
        };
        *place = from;
        true
    }

    /// Whether the signals can be believed. Most alarms have none that says so.
    #[inline]
    fn are_ok(&self, before: &[f64]) -> bool {
        let Some(ok) = before.get(self.ok as usize) else { return true };
        *ok != 0.0 && before.get(self.other_ok as usize).is_none_or(|ok| *ok != 0.0)
    }
}

/// Steps a bank of alarms, which read from the image before it, as [`Alarm`] says. An alarm at which nothing changes,
/// as most of the time, is only read and compared.
pub fn step_alarms(
    before: &[f64],
    reads: &[AlarmReads],
    slots: &mut [f64],
    words: &mut [u64],
    cycle: &Cycle<'_>,
) {
    let (alarms, _) = slots.as_chunks_mut::<SLOTS>();
    let (states, _) = words.as_chunks_mut::<WORDS>();
    for ((reads, slots), words) in reads.iter().zip(alarms).zip(states) {
        let [_, b, _, _, _, _, _, hysteresis, _, active_slot, ok_slot] = slots;
        let [active, side, ..] = words.map(f64::from_bits);
        let stays = |a: &f64| {
            let room = *b + *hysteresis * active - *a;
            room * side > 0.0 || side.is_nan() && room == 0.0
        };
        if before.get(reads.a as usize).is_some_and(stays) && reads.are_ok(before) {
            (*active_slot, *ok_slot) = (active, 1.0);
        } else {
            step_one(before, reads, slots, words, cycle);
        }
    }
}

/// Steps an alarm.
#[cold]
#[inline(never)]
fn step_one(
    before: &[f64],
    reads: &AlarmReads,
    slots: &mut [f64; SLOTS],
    words: &mut [u64; WORDS],
    cycle: &Cycle<'_>,
) {
    let (inputs, outputs) = slots.split_at_mut(<Inputs as Slots>::LEN);
    let inputs = Inputs::read(inputs);
    // A value of the cycle before is copied.
    let a = before.get(reads.a as usize).copied().unwrap_or(inputs.a);
    let inputs = Inputs { a, a_ok: reads.are_ok(before), b_ok: true, ..inputs };
    let mut state = State::read(words);
    Alarm::step(&mut state, &inputs, cycle).write(outputs);
    state.write(words);
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

    /// The same of an alarm in a bank, whose signal stands before it in the image.
    fn run_in_place(inputs: &[(u64, Inputs)]) -> Vec<(bool, bool)> {
        let (mut slots, mut words) = ([0.0; SLOTS], [0; WORDS]);
        let mut reads = AlarmReads::default();
        assert!(reads.take(0, 0) && !reads.take(1, 1) && reads.take(3, 1) && reads.take(2, 2));
        let step = |(cycle, inputs): &(u64, Inputs)| {
            let ok = [inputs.b_ok, inputs.a_ok].map(bool::into_slot);
            let wired = Inputs { a: 0.0, a_ok: false, b_ok: false, ..*inputs };
            wired.write(&mut slots[..Inputs::LEN]);
            let cycle = Cycle::new(*cycle, PERIOD_NS, &[]);
            let before = [&[inputs.a][..], &ok].concat();
            step_alarms(&before, &[reads], &mut slots, &mut words, &cycle);
            let Outputs { active, ok } = Outputs::read(&slots[Inputs::LEN..]);
            (active, ok)
        };
        inputs.iter().map(step).collect()
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

    /// What an alarm is after each cycle, by its definition: the comparison held in each of the last cycles that were
    /// evaluated, from `delay` cycles before on.
    fn model(inputs: &[(u64, Inputs)]) -> Vec<(bool, bool)> {
        let (mut active, mut held) = (false, None);
        let mut before = 0;
        let step = |&(cycle, of): &(u64, Inputs)| {
            let ok = of.a_ok && of.b_ok && !of.a.is_nan() && !of.b.is_nan();
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
                    a_ok: *ok,
                    hysteresis: -f64::from(hysteresis),
                    delay: delay as f64,
                    ..HIGH
                };
                (at, inputs)
            }).collect();
            let expected = model(&inputs);
            proptest::prop_assert_eq!(run(inputs), expected);
        }

        #[test]
        fn an_alarm_in_a_bank_does_what_the_block_does(
            [above, equal, below]: [bool; 3],
            delay in 0_u8..3,
            hysteresis in -1_i8..2,
            cycles in proptest::collection::vec((1_u64..3, 0_usize..6, 0_usize..6, 0_u8..12), 1..60),
        ) {
            let levels = [1.0, 2.0, 3.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
            let mut at = 0;
            let inputs: Vec<_> = cycles.iter().map(|(skip, a, b, ok)| {
                at += skip;
                let (a, b, a_ok, b_ok) = (levels[*a], levels[*b], *ok != 0, *ok != 1);
                let (hysteresis, delay) = (f64::from(hysteresis), f64::from(delay));
                (at, Inputs { a, b, a_ok, b_ok, above, equal, below, hysteresis, delay })
            }).collect();
            proptest::prop_assert_eq!(run_in_place(&inputs), run(inputs));
        }
    }
}
