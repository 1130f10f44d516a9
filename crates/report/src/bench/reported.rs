//! The parts of a report that measured something: what is alike in them.

use std::collections::BTreeMap;

use isochrone_timing::units::{counted, period};
use isochrone_timing::{Distribution, Metric};

use crate::report::{CostReport, LinkArm, TaskArm, TurnReport};

/// A part of a report that measured something.
pub(crate) trait Reported {
    /// What it measured above all.
    const METRIC: Metric;
    /// What comparisons are of, and the turns hold.
    const COMPARED: Metric = Self::METRIC;

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

    /// The distribution of a metric, if the report holds it.
    fn distribution(&self, metric: Metric) -> Option<Distribution> {
        Distribution::decode(self.histograms().get(metric.key)?).ok()
    }
}

impl Reported for TaskArm {
    const METRIC: Metric = Metric::RELEASE_JITTER;
    // A stall would not show in the cycles that ran.
    const COMPARED: Metric = Metric::RELEASE_JITTER_CORRECTED;

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
    const METRIC: Metric = Metric::ONE_WAY;

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
            values => counted(values, "value"),
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
    const METRIC: Metric = Metric::STEP;

    fn arm(&self) -> &str {
        &self.name
    }

    fn circumstances(&self) -> String {
        counted(self.instances, "instance")
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
    if circumstances.is_empty() { arm.to_owned() } else { format!("{arm} ({circumstances})") }
}

fn listed<const N: usize>(parts: [String; N]) -> String {
    let filled: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    filled.join(", ")
}
