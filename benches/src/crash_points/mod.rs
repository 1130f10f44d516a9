//! Processes that are killed or stopped at a given system call, and whether the others get on.
//!
//! One [`Point`] is one instruction of one process. [`Stage::strike`] has a process of the real
//! program reach it in a domain of its own, deals the blow, and sees whether fresh processes work,
//! whether those that ran went on running, and what is left when all have ended.
//! [`Stage::points`] finds all points there are, by running each process once unharmed.

mod call;
mod kill;
mod litter;
mod output;
mod peer;
mod pile;
mod point;
mod roles;
mod scan;
mod scene;
mod stage;
mod stop;
mod strike;
mod tracer;
mod victim;
mod watch;

pub use call::Call;
pub use output::{Feed, Output};
pub use pile::Pile;
pub use point::{Blow, Circumstance, Phase, Point, Role, name};
pub use scan::{Selection, spread};
pub use stage::{Outcome, Stage, Verdict};
pub use victim::can_trace;
