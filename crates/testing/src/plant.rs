//! Configurations that a test writes itself, a line for each table.

use std::fmt::{Debug, Display, Formatter, Result};
use std::ops::Deref;

/// A configuration: its tables in the order in which they are named. It reads as its TOML text.
///
/// ```
/// # use isochrone_testing::Plant;
/// let tank = Plant::new("tank").task("fast", "5ms").ramp("ramp", "value = 25.0, setChangeRate = 10.0");
/// assert!(tank.contains("[[block]]\nname = \"ramp\"\ntype = \"LimRateOfChangeCI\"\n"));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Plant {
    text: String,
    /// The task that tables belong to, as a key.
    task: String,
}

impl Plant {
    /// A node of this name, and nothing in it.
    pub fn new(node: &str) -> Self {
        Self { text: format!("[node]\nname = {node:?}\n"), task: String::new() }
    }

    /// Further lines: first keys of the table that was named last, then tables of any kind.
    pub fn with(mut self, lines: &str) -> Self {
        self.text += lines;
        self.text += "\n";
        self
    }

    /// A task.
    pub fn task(self, name: &str, period: &str) -> Self {
        self.with(&format!("[[task]]\nname = {name:?}\nperiod = {period:?}"))
    }

    /// What comes now is of this task. There is no need to say so where there is one.
    pub fn on(mut self, task: &str) -> Self {
        self.task = format!("task = {task:?}\n");
        self
    }

    fn table(self, kind: &str, lines: &str) -> Self {
        let lines = format!("[[{kind}]]\n{}\n{}", lines.trim_end(), self.task);
        self.with(&lines)
    }

    /// An input from the first channel of a service, unless further keys name another one.
    pub fn input(self, name: &str, service: &str, keys: &str) -> Self {
        self.table("input", &format!("name = {name:?}\nservice = {service:?}\n{keys}"))
    }

    /// An input that nothing but `simulate` gives a value.
    pub fn column(self, name: &str, value_type: &str) -> Self {
        self.table("input", &format!("name = {name:?}\ntype = {value_type:?}"))
    }

    /// A block, with what stands between the braces of its inputs.
    pub fn block(self, name: &str, block_type: &str, inputs: &str) -> Self {
        let lines = format!("name = {name:?}\ntype = {block_type:?}\nin = {{ {inputs} }}");
        self.table("block", &lines)
    }

    /// A block that limits how fast its `value` changes.
    pub fn ramp(self, name: &str, inputs: &str) -> Self {
        self.block(name, "LimRateOfChangeCI", inputs)
    }

    /// A block that steps up and begins again.
    pub fn saw(self, name: &str, inputs: &str) -> Self {
        self.block(name, "SawTooth", inputs)
    }

    /// A block that multiplies `x`, a source or a number, and has no limits.
    pub fn times(self, factor: f64, name: &str, x: &str) -> Self {
        let inputs =
            format!("x = {x}, x1 = 0, y1 = 0, x2 = 1, y2 = {factor:?}, yMin = -inf, yMax = inf");
        self.block(name, "ScaleLinear", &inputs)
    }

    /// Frames with these signals.
    pub fn output(self, service: &str, signals: &[impl Debug]) -> Self {
        self.table("output", &format!("service = {service:?}\nsignals = {signals:?}"))
    }
}

impl Deref for Plant {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl AsRef<[u8]> for Plant {
    fn as_ref(&self) -> &[u8] {
        self.as_bytes()
    }
}

impl Display for Plant {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(self)
    }
}
