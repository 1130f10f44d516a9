//! Nodes with one task, put together from entries.

use isochrone_engine::TaskEngine;

use crate::findings::plan;

/// The node and its task `t` of 100 ms.
pub(crate) const TASK: &str = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"100ms\"\n";

/// So many blocks of a type with these pins, without the braces around them.
pub(crate) fn blocks(name: &str, count: usize, block_type: &str, pins: &str) -> String {
    format!(
        "[[block]]\nname = \"{name}\"\ncount = {count}\ntype = \"{block_type}\"\nin = {{ {pins} }}\n"
    )
}

/// A ramp to a value, as the file writes it, that is there at once.
pub(crate) fn ramp(name: &str, value: &str) -> String {
    blocks(name, 1, "LimRateOfChangeCI", &format!("value = {value}, setChangeRate = inf"))
}

/// A ScaleLinear without limits that puts out `factor` times what it reads, plus 1.
pub(crate) fn line(name: &str, x: &str, factor: u8) -> String {
    let pins = format!("x = {x}, x1 = 0.0, y1 = 1.0, x2 = 1.0, y2 = {}.0", factor + 1);
    blocks(name, 1, "ScaleLinear", &format!("{pins}, yMin = -inf, yMax = inf"))
}

/// A frame of these signals, the node's first.
pub(crate) fn output(signals: &[&str]) -> String {
    format!("[[output]]\nservice = \"s\"\nsignals = {signals:?}\n")
}

/// The engine of [`TASK`] with these entries.
pub(crate) fn engine(entries: &str) -> TaskEngine {
    TaskEngine::build(&plan(&format!("{TASK}{entries}")).unwrap()).unwrap().remove(0)
}

/// What the engine sends in the first of its outputs.
pub(crate) fn frame<const SIGNALS: usize>(engine: &TaskEngine) -> [f64; SIGNALS] {
    let mut frame = [f64::NAN; SIGNALS];
    engine.read_output(0, &mut frame);
    frame
}
