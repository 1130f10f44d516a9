//! What an instance takes over from one of the same name under another plan.

use isochrone_blocks::{BlockType, Pin};

use super::CopySpan;

/// The slots and words of an instance that go on in another one. Only a configuration can make its block another type:
/// an `Expr` has its outputs from there, and an alarm the types of what it reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CarriedInstance {
    /// Slots of the outputs, counted from the instance's first slot.
    pub outputs: Vec<CopySpan>,
    /// Words of the private state, counted from the instance's first word.
    pub words: Vec<CopySpan>,
    /// Whether both have the same slots and words, so that all of them are carried.
    pub is_whole: bool,
}

impl CarriedInstance {
    /// What an instance of `to` takes over from one of `from`; `None`: nothing, as their types have nothing in common.
    ///
    /// An `Expr` takes over the outputs of the same name and type, whatever their expressions are, with their last good
    /// values.
    pub fn of(from: &BlockType, to: &BlockType) -> Option<Self> {
        let (inputs, new_inputs) = (from.inputs.len(), to.inputs.len());
        if from.is_alarm() && to.is_alarm() {
            // A condition has the same state whatever the types of its signals are.
            return Some(Self {
                outputs: vec![CopySpan { from: inputs, to: new_inputs, len: to.outputs.len() }],
                words: vec![CopySpan { from: 0, to: 0, len: to.state_words }],
                is_whole: from.has_layout_of(to),
            });
        }
        if from.formulas().is_none() || to.formulas().is_none() {
            let outputs = CopySpan { from: inputs, to: inputs, len: to.outputs.len() };
            let words = CopySpan { from: 0, to: 0, len: to.state_words };
            return from.has_layout_of(to).then(|| Self {
                outputs: vec![outputs],
                words: vec![words],
                is_whole: true,
            });
        }
        let is_like = |a: &Pin, b: &Pin| (a.name, a.pin_type) == (b.name, b.pin_type);
        let pair = |(place, output): (usize, &Pin)| {
            Some((from.outputs.iter().position(|old| is_like(old, output))?, place))
        };
        let pairs: Vec<_> = to.outputs.iter().enumerate().filter_map(pair).collect();
        let span = |before: usize, after: usize| {
            move |&(from, to): &(usize, usize)| CopySpan {
                from: before + from,
                to: after + to,
                len: 1,
            }
        };
        Some(Self {
            outputs: pairs.iter().map(span(inputs, new_inputs)).collect(),
            words: pairs.iter().map(span(0, 0)).collect(),
            is_whole: from.id() == to.id(),
        })
    }
}
