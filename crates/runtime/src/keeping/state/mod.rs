//! The state of a node that is retained over a restart: its file, what a start takes from it, and the thread that
//! writes it.

mod error;
mod file;
mod node_state;
mod restored;
mod retention;
mod writing;

pub use error::{DamagedState, StateError};
pub use file::{StateFile, StoredState};
pub(crate) use node_state::layout_of;
pub use node_state::{NodeState, RetainedTask, STATE_VERSION, StateValue};
pub(crate) use restored::{Restoration, restore};
pub use restored::{Restored, WarmTask, WarmTasks};
pub use retention::Retention;
pub(crate) use writing::{DeskState, FinalState, StateWriting};
