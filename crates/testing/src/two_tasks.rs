//! A node with a fast and a slow task, put together from entries of a configuration.

use toml::Value;

/// The node and its tasks `fast` (1 ms, OB 30) and `slow` (10 ms, OB 31).
pub const TASKS: &str = "[node]\nname = \"n\"\ncontrol = \"force\"\n\
    [[task]]\nname = \"fast\"\nperiod = \"1ms\"\nob = 30\n\
    [[task]]\nname = \"slow\"\nperiod = \"10ms\"\nob = 31\n";

/// An input that is read from no service.
pub fn input(name: &str, task: &str) -> String {
    format!("[[input]]\nname = \"{name}\"\ntask = \"{task}\"\n")
}

/// A ramp to a value at a rate; a text is a wire, a negative rate is an error.
pub fn ramp(name: &str, task: &str, value: impl Into<Value>, rate: impl Into<Value>) -> String {
    let (value, rate) = (value.into(), rate.into());
    format!(
        "[[block]]\nname = \"{name}\"\ntype = \"LimRateOfChangeCI\"\ntask = \"{task}\"\n\
         in = {{ value = {value}, setChangeRate = {rate} }}\n"
    )
}

/// A frame of signals, whose service is named after them.
pub fn output(task: &str, signals: &[&str]) -> String {
    let service = signals.join("+");
    format!("[[output]]\nservice = \"{service}\"\ntask = \"{task}\"\nsignals = {signals:?}\n")
}
