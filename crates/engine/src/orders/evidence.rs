//! The quality of values, as far as a cycle knows it.

use isochrone_blocks::Indication;
use isochrone_model::Flags;

use crate::worth::Source;

/// What an ordinary thread needs from a cycle to work out the quality of values that were read after it: the flags of
/// the task's sources, and which blocks report an error. The cycle fills it in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Evidence {
    /// The sources of the task that matter, by their index (its inputs, then values of other tasks, both in the
    /// order of the plan), with their flags in the cycle.
    pub sources: Box<[(u32, Flags)]>,
    /// The blocks that matter, by the pins that show their errors.
    pub errors: Box<[ErrorPin]>,
    /// Whether the cycle has filled it in. It does not if the task's engine was replaced since the order was made.
    pub is_known: bool,
}

/// The pin by which a block reports an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorPin {
    /// Its slot.
    pub slot: usize,
    /// Which of its values are errors.
    pub indication: Indication,
    /// Whether it had one of them after the cycle.
    pub has_error: bool,
}

impl Evidence {
    /// Fills it in. For the real-time path.
    pub(crate) fn fill(&mut self, sources: &[Source], image: &[f64]) {
        for (index, flags) in &mut self.sources {
            *flags = sources.get(*index as usize).map_or(Flags::NONE, |source| source.flags);
        }
        for pin in &mut self.errors {
            pin.has_error =
                image.get(pin.slot).is_some_and(|value| pin.indication.is_error(*value));
        }
        self.is_known = true;
    }
}
