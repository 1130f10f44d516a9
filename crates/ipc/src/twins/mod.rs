//! Two processes of one node on one machine: which of them writes, and what each knows of the other.

mod page;
mod seat;

pub use page::{MAX_TWIN_TASKS, Takeover, TwinPage};
pub use seat::{Seat, SeatError};

pub(crate) use page::remove_all;
