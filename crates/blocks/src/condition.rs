//! The alarm of an expression: whether it has been TRUE for some time. An `[[alarm]]` of one comparison is an [`Alarm`],
//! which takes a fraction of the time.

use alloc::vec::Vec;

use crate::alarm::{Alarm, State};
use crate::expr::{self, Program};
use crate::formulas::STATUS;
use crate::{ALARM, BlockType, Cycle, Declaration, Pin, PinDefault, PinType, PinValue, Words};

const WORDS: usize = <State as Words>::LEN;

/// The input pins of the alarm of a condition that reads signals of these types: the signals; whether each can be
/// believed; and for how many cycles the condition must have held.
pub fn inputs(signals: &[PinType]) -> Vec<Pin> {
    let pin = |name, pin_type| Pin { name, pin_type, raw_doc: "", ..STATUS };
    let values = signals.iter().map(|of| pin("signal", *of));
    let is_ok = Pin { default: PinDefault::Value(1.0), ..pin("ok", PinType::Bool) };
    let beliefs = signals.iter().map(|_| is_ok);
    values.chain(beliefs).chain([pin("delay", PinType::Lreal)]).collect()
}

/// The alarm of a condition, with these [`inputs`].
pub fn alarm_of(inputs: &'static [Pin], condition: &'static Program) -> BlockType {
    ALARM.with_condition(inputs, condition, step_bank)
}

/// One step of all alarms of a bank, each with the outputs of [`Alarm`] behind so many inputs.
fn step_bank(
    inputs: usize,
    program: &Program,
    image: &mut [f64],
    state: &mut [u64],
    cycle: &Cycle<'_>,
) {
    let mut registers = [0.0; expr::MAX_STEPS];
    let (states, _) = state.as_chunks_mut::<WORDS>();
    for (slots, words) in image.chunks_exact_mut(inputs + Alarm::OUTPUTS.len()).zip(states) {
        let [signals @ .., delay, active, ok] = slots else { continue };
        let (signals, beliefs) = signals.split_at(signals.len() / 2);
        let is_believed = beliefs.iter().all(|ok| *ok != 0.0);
        let holds = program.evaluate(signals, &mut registers).ok().filter(|_| is_believed);
        let holds = holds.map(|value| value != 0.0);
        let state = State::read(words).after(holds, *delay, cycle.index());
        (*active, *ok) = (state.is_active().into_slot(), holds.is_some().into_slot());
        state.write(words);
    }
}
