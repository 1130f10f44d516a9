//! Processes that belong together: how they are started, asked to end, and ended.
//!
//! A program looks at a [`Stop`] in its loops, and ends in order when it is due. Programs that it
//! starts are each a [`Child`]: they end when it is dropped, when another signal ends the program at
//! once, and, where they are programs of isochrone, when the program is killed. A [`Company`] is
//! several processes of one program in an iceoryx2 domain of their own.
//!
//! Nothing here talks to the terminal. What there is to say is in the errors.
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
mod document;
mod orphan;
mod running;
mod stop;

pub use child::{Child, ChildError};
pub use company::{Company, CompanyError};
pub use orphan::end_with_parent;
pub use stop::{Stop, StopError};
