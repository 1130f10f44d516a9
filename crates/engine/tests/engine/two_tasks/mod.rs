//! Nodes with a fast and a slow task, put together from entries.

use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use toml::Value;

/// The node and its tasks `fast` (1 ms, OB 30) and `slow` (10 ms, OB 31).
pub(crate) const TASKS: &str = "[node]\nname = \"n\"\ncontrol = \"force\"\n\
    [[task]]\nname = \"fast\"\nperiod = \"1ms\"\nob = 30\n\
    [[task]]\nname = \"slow\"\nperiod = \"10ms\"\nob = 31\n";

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

pub(crate) fn input(name: &str, task: &str) -> String {
    format!("[[input]]\nname = \"{name}\"\ntask = \"{task}\"\n")
}

/// A ramp to a value at a rate; a text is a wire, a negative rate is an error.
pub(crate) fn ramp(
    name: &str,
    task: &str,
    value: impl Into<Value>,
    rate: impl Into<Value>,
) -> String {
    let (value, rate) = (value.into(), rate.into());
    format!(
        "[[block]]\nname = \"{name}\"\ntype = \"LimRateOfChangeCI\"\ntask = \"{task}\"\n\
         in = {{ value = {value}, setChangeRate = {rate} }}\n"
    )
}

/// A frame of signals, whose service is named after them.
pub(crate) fn output(task: &str, signals: &[&str]) -> String {
    let service = signals.join("+");
    format!("[[output]]\nservice = \"{service}\"\ntask = \"{task}\"\nsignals = {signals:?}\n")
}
