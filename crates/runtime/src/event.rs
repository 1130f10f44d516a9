//! Events of a task's blocks and inputs.

use crate::freshness::InputState;

/// An event of a block or an input.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Event {
    /// Events after this one are about the blocks of another configuration.
    Changed,
    /// A block instance, by its index in the image, has this error since a cycle; `OK`: it has none.
    Block { instance: usize, status: u16, cycle: u64 },
    /// An input came into this state in a cycle.
    Input { input: usize, state: InputState, cycle: u64 },
}
