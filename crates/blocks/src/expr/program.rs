//! A program: what an expression becomes when its names have types.

use alloc::vec::Vec;

use super::evaluate::{Step, status};
use crate::PinType;

/// An expression whose names have types, ready to be evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub(super) steps: Vec<Step>,
    pub(super) result: PinType,
    /// The register of the result.
    pub(super) register: u16,
}

impl Program {
    /// The type of the result.
    pub fn result(&self) -> PinType {
        self.result
    }

    /// The number of steps, which its time is proportional to; at most [`MAX_STEPS`](super::MAX_STEPS).
    pub fn steps(&self) -> usize {
        self.steps.len()
    }

    /// The number of registers that [`evaluate`](Self::evaluate) takes.
    pub fn registers(&self) -> usize {
        self.steps.len()
    }

    /// Computes the result from the slots of the signals, in the order of the expression's names. What `registers` held
    /// does not matter.
    ///
    /// # Errors
    /// The status word of the first error that reached the result.
    #[inline]
    pub fn evaluate(&self, inputs: &[f64], registers: &mut [f64]) -> Result<f64, u16> {
        for (index, step) in self.steps.iter().enumerate() {
            let Some((before, rest)) = registers.split_at_mut_checked(index) else { break };
            if let Some(register) = rest.first_mut() {
                *register = step.result(inputs, before);
            }
        }
        let result = registers.get(usize::from(self.register)).copied().unwrap_or(f64::NAN);
        if result.is_nan() { Err(status(result)) } else { Ok(result) }
    }
}
