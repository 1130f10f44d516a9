//! Shared parts of the tests of all crates.
//!
//! - [`Domain`]: an iceoryx2 domain and a folder for each test, so that tests run in parallel and leave nothing.
//! - [`Process`]: a program that a test starts and waits for, [`Ended`] how it ended; [`afresh`] for those that tests start themselves.
//! - [`plants`]: configurations that more than one test runs; [`Plant`]: one that a test writes itself.
//! - [`graphs`]: random nodes; [`two_tasks`]: nodes that a test puts together from entries.
//! - [`wait_until`] and [`PATIENCE`]: waiting without asserting a time.
//! - [`volume`]: how often a test repeats what a single run may not show.
//! - [`in_own_process`] and [`role`]: tests that change their process, or need a second one of their own make.

mod afresh;
mod domain;
pub mod graphs;
mod own_process;
mod patience;
mod plant;
pub mod plants;
mod process;
mod text;
pub mod two_tasks;
mod volume;

pub use afresh::afresh;
pub use domain::{Domain, PlainLink, shared_memory};
pub use own_process::{in_own_process, role, role_domain};
pub use patience::{PATIENCE, not_tested, wait_for_ok, wait_for_some, wait_until};
pub use plant::Plant;
pub use process::{Ended, Process, mount_refusal, program};
pub use text::{assert_says, cells};
pub use volume::{is_full_volume, volume};
