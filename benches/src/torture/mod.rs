//! Faults in turns, for as long as one likes: processes that are killed and stopped, state files that are damaged, and
//! machines that have too little of something.
//!
//! A [`Row`] is one kind of fault. One turn of it begins in a domain of its own, does its faults to real processes at
//! moments that its seed chooses, and compares what readers saw with what must hold. The program is `torture`.

mod exhausted;
mod exhaustion;
mod frames;
mod kills;
mod moments;
mod pair;
mod reader;
mod row;
mod scene;
mod setter;
mod state;
mod stop;
mod summary;
mod takeover;
mod turn;

pub use exhausted::Scarcity;
pub use exhaustion::starve;
pub use row::Row;
pub use summary::Summary;
pub use turn::{Stage, Turn};
