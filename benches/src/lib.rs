//! Shared parts of the benches: the engine of a workload, the real program, its crash points, and what is done to it
//! for as long as one likes.
//!
//! The benches are in `benches/`: `cargo bench -p isochrone-benches --bench NAME`.

pub mod crash_points;
mod program;
pub mod torture;

use isochrone_engine::{Plan, Rules, TaskEngine, Workload};

pub use program::{Profile, build, find};

/// A failure that ends a bench, as a sentence.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The engine of a task with so many instances.
///
/// # Errors
/// There cannot be so many.
pub fn engine(workload: &Workload, instances: usize) -> Result<TaskEngine, Failure> {
    let plan = Plan::new(workload.source(instances), &Rules::default())?;
    TaskEngine::build(&plan)?.pop().ok_or_else(|| "the workload has no task".into())
}
