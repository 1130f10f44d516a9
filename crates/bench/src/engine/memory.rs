//! The memory that the tasks need, checked before they are built.

use isochrone_engine::Workload;

use super::settings::TaskSize;
use crate::BenchError;

/// Bytes of an instance while its plan is made, beside image and wires: its name, its depth. A million
/// of each type took 70 at most.
const PLAN_BYTES: u64 = 128;

/// Refuses sizes that do not fit into `available` bytes, before the kernel ends the program.
///
/// # Errors
/// They do not fit.
pub fn check(sizes: &[TaskSize], available: Option<u64>) -> Result<(), BenchError> {
    let Some(available) = available else { return Ok(()) };
    let too_large = sizes.iter().map(|size| (size, needed(size))).find(|(_, n)| *n > available);
    too_large.map_or(Ok(()), |(size, needed)| {
        let arms: Vec<&str> = size.workloads.iter().map(Workload::name).collect();
        let [needed_mb, available_mb] = [needed, available].map(|bytes| bytes.div_ceil(1_000_000));
        Err(BenchError::Usage(format!(
            "{} instances of {} need {needed_mb} MB, and {available_mb} MB are available\n\
             remedy: give fewer with --instances, or name fewer with --arms",
            size.instances,
            arms.join(", ")
        )))
    })
}

/// Bytes of all tasks that take turns, and of the plan of one: they are planned one by one.
fn needed(size: &TaskSize) -> u64 {
    let task = |workload: &Workload| workload.size(size.instances).bytes();
    let tasks: Vec<u64> = size.workloads.iter().map(task).collect();
    // A plan has an image and wires too.
    let largest = tasks.iter().max().copied().unwrap_or(0);
    tasks.iter().sum::<u64>() + largest + PLAN_BYTES * size.instances as u64
}

#[cfg(test)]
mod tests {
    use isochrone_blocks::CATALOGUE;

    use super::*;

    fn largest() -> TaskSize {
        TaskSize { instances: 1_000_000, workloads: Workload::all(CATALOGUE) }
    }

    #[test]
    fn instances_that_do_not_fit_are_refused_with_what_they_need_and_what_there_is() {
        let sizes = [TaskSize { instances: 10, ..largest() }, largest()];
        let error = check(&sizes, Some(100_000_000)).unwrap_err().to_string();
        for part in ["1000000 instances of mixed, LimRateOfChangeCI", "100 MB", "--instances"] {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn what_fits_is_not_refused() {
        let needed = needed(&largest());
        assert!(check(&[largest()], Some(needed)).is_ok());
        assert!(check(&[largest()], Some(needed - 1)).is_err());
        assert!(check(&[largest()], None).is_ok(), "nobody knows");
        let one = TaskSize { instances: 1, workloads: vec![Workload::Mixed] };
        assert!(check(&[one], Some(1_000_000)).is_ok());
    }

    #[test]
    fn all_tasks_that_take_turns_are_there_at_once() {
        let workloads = Workload::all(CATALOGUE).into_iter();
        let each = workloads.map(|workload| workload.size(1_000_000).bytes());
        assert!(needed(&largest()) > each.sum());
    }
}
