//! A block as its author writes it.

use crate::{Caution, Cycle, Declaration};

/// A function block: a pure Mealy machine.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no function block yet",
    note = "declare it with `isochrone_blocks::block!` and write `impl Block for {Self}` with its `step`"
)]
pub trait Block: Declaration {
    /// One cycle. Depends on nothing but its arguments.
    ///
    /// It is inlined into two loops: one for instances with inputs of their own, one for instances that share all inputs
    /// but the first. The compiler does this for a step of more than a hundred instructions or so only if it is
    /// `#[inline(always)]`.
    fn step(state: &mut Self::State, inputs: &Self::Inputs, cycle: &Cycle<'_>) -> Self::Outputs;

    /// One cycle of a block with a `buffer`: its words, which are zero before the first call, are changed in place.
    /// Such a block's [`step`](Self::step) does what can be done without room, by passing `&mut []`.
    #[inline(always)]
    fn step_buffered(
        state: &mut Self::State,
        _buffer: &mut [u64],
        inputs: &Self::Inputs,
        cycle: &Cycle<'_>,
    ) -> Self::Outputs {
        Self::step(state, inputs, cycle)
    }

    /// Tells an instance that goes on in a task with another period, both in ns, after which cycle it does. What it counts
    /// in cycles may mean another time then.
    fn change_period(_state: &mut Self::State, _cycle: u64, _old_and_new_ns: [u64; 2]) {}

    /// What people should know while [`needs_caution`](Block::needs_caution) says so.
    const CAUTION: Option<&'static Caution> = None;

    /// Whether an instance that reports no error is, after a step, in the state that [`Block::CAUTION`]
    /// tells of.
    fn needs_caution(_inputs: &Self::Inputs, _outputs: &Self::Outputs) -> bool {
        false
    }

    /// Inputs that keep an instance at its usual work for as long as it is stepped: not in error,
    /// not at a limit, not arrived. What it costs is measured with these.
    fn typical() -> Self::Inputs {
        Self::Inputs::default()
    }
}
