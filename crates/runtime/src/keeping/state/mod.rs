//! The state of a node that is retained over a restart: its file, and the thread that writes it.

mod error;
mod file;
mod node_state;

pub use error::{DamagedState, StateError};
pub use file::{StateFile, StoredState};
pub use node_state::{NodeState, STATE_VERSION};
