//! What a task's blocks and inputs run into.

use crate::freshness::InputState;

/// What is to be said of a block or an input.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Event {
    /// From here on, blocks are those of another configuration.
    Changed,
    /// An instance, in the order of the image, has this error since a cycle; `OK` for none.
    Block { instance: usize, status: u16, cycle: u64 },
    /// An input came into this state in a cycle.
    Input { input: usize, state: InputState, cycle: u64 },
}
