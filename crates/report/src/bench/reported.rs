//! The parts of a report that measured something: what is alike in them.

use std::collections::BTreeMap;

use isochrone_timing::Distribution;
use isochrone_timing::units::period;

use super::turns::TurnReport;
use crate::report::{CostReport, LinkArm, TaskArm};

/// A part of a report that measured something.
pub(crate) trait Reported {
    /// What it measured above all, as the report's key.
    const METRIC: &'static str;
    /// What comparisons are of, and the turns hold.
    const COMPARED: &'static str = Self::METRIC;

    /// Its arm: `hybrid`, `iceoryx2`, `mixed`.
    fn arm(&self) -> &str;

    /// Under which circumstances: `1 ms, idle`.
    fn circumstances(&self) -> String;

    /// Its turns; none in the report of a run.
    fn turns(&self) -> &[TurnReport];

    /// Its distributions, by name.
    fn histograms(&self) -> &BTreeMap<String, String>;

    /// Arm and circumstances.
    fn label(&self) -> String {
        label(self.arm(), &self.circumstances())
    }

    /// The distribution of this name, if the report holds it.
    fn distribution(&self, name: &str) -> Option<Distribution> {
        Distribution::decode(self.histograms().get(name)?).ok()
    }
}

impl Reported for TaskArm {
    const METRIC: &'static str = "release_jitter_ns";
    // A stall would not show in the cycles that ran.
    const COMPARED: &'static str = "release_jitter_corrected_ns";

    fn arm(&self) -> &str {
        &self.task.name
    }

    fn circumstances(&self) -> String {
        listed([period(self.task.period_ns), self.load.clone()])
    }

    fn turns(&self) -> &[TurnReport] {
        &self.turns
    }

    fn histograms(&self) -> &BTreeMap<String, String> {
        &self.task.histograms
    }
}

impl Reported for LinkArm {
    const METRIC: &'static str = "one_way_ns";

    fn arm(&self) -> &str {
        &self.link.service
    }

    fn circumstances(&self) -> String {
        let pace = match (self.values, self.paced_hz) {
            (0, _) => String::new(),
            (_, Some(hz)) => format!("{hz} Hz"),
            (_, None) => "back to back".to_owned(),
        };
        let values = match self.values {
            0 => String::new(),
            1 => "1 value".to_owned(),
            values => format!("{values} values"),
        };
        listed([pace, values])
    }

    fn turns(&self) -> &[TurnReport] {
        &self.turns
    }

    fn histograms(&self) -> &BTreeMap<String, String> {
        &self.link.histograms
    }
}

impl Reported for CostReport {
    const METRIC: &'static str = "step_ps";

    fn arm(&self) -> &str {
        &self.name
    }

    fn circumstances(&self) -> String {
        format!("{} instances", self.instances)
    }

    fn turns(&self) -> &[TurnReport] {
        &self.turns
    }

    fn histograms(&self) -> &BTreeMap<String, String> {
        &self.histograms
    }
}

/// An arm and its circumstances, as comparisons call it.
pub(super) fn label(arm: &str, circumstances: &str) -> String {
    match circumstances.is_empty() {
        true => arm.to_owned(),
        false => format!("{arm} ({circumstances})"),
    }
}

fn listed<const N: usize>(parts: [String; N]) -> String {
    let filled: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    filled.join(", ")
}
