//! What the ports of this crate are compared with. For benches: nothing here checks who else is on
//! a service, counts what went wrong, or makes good a failed connection.

mod raw;
mod shared_words;

pub use raw::{RawPublisher, RawSubscriber};
pub use shared_words::SharedWords;
