//! Nodes with a fast and a slow task, put together from entries.

use isochrone_engine::{Plan, Rules, Source, TaskEngine};
pub(crate) use isochrone_testing::two_tasks::{TASKS, input, output, ramp};

/// A plan of [`TASKS`] and what is given.
pub(crate) fn plan(rest: &str) -> Plan {
    plan_of(TASKS, rest)
}

/// A plan of other tasks and what is given.
pub(crate) fn plan_of(tasks: &str, rest: &str) -> Plan {
    let source = Source::new("n.toml", format!("{tasks}{rest}"));
    Plan::new(source, &Rules::default()).unwrap()
}

/// The engines of `fast` and `slow`.
pub(crate) fn engines(plan: &Plan) -> (TaskEngine, TaskEngine) {
    let mut engines = TaskEngine::build(plan).unwrap().into_iter();
    (engines.next().unwrap(), engines.next().unwrap())
}

/// The engines of [`TASKS`] with what is given.
pub(crate) fn engines_with(rest: &str) -> (TaskEngine, TaskEngine) {
    engines(&plan(rest))
}
