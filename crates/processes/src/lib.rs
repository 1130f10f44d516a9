//! Groups of processes: how they are started, asked to end, and ended.
//!
//! A program checks a [`Stop`] in its loops and ends cleanly when it is due. Each program that it
//! starts is a [`Child`], which ends when it is dropped, when a second signal ends the program at
//! once, and, if it is an isochrone program, when its parent is killed. A [`Company`] is a group of
//! processes of one program in their own iceoryx2 domain.
//!
//! Nothing here accesses the terminal; errors carry all messages.
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod child;
mod company;
mod dispositions;
mod document;
mod ending;
mod orphan;
mod running;
mod stack;
mod stop;

pub use child::{Child, ChildError};
pub use company::{Company, CompanyError};
pub use ending::Ending;
pub use orphan::end_with_parent;
pub use stack::with_usual_stack;
pub use stop::{Stop, StopError, is_asked_to_end, outlive_file_limit};
