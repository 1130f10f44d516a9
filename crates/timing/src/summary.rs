//! A distribution in the few numbers that a report shows.

use std::fmt::{Display, Formatter, Result};

use serde::{Deserialize, Serialize};

use crate::units::{counted, duration};

/// Minimum, mean, percentiles and maximum of a distribution, in the unit of its values.
///
/// A percentile `p` is given only if at least one sample is expected beyond it, that is, from `1 /
/// (1 - p)` samples: p50 from 2, p90 from 10, p99 from 100, p99.9 from 1000 and p99.99 from 10 000.
/// With fewer samples it would only repeat the maximum, so it is `None` and its key is absent from
/// the JSON. An empty distribution is `{"count": 0}`. At the threshold a percentile still rests on
/// one sample: compare runs only with ten times as many samples or more.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Summary {
    /// Number of samples.
    pub count: u64,
    /// Smallest sample, exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<u64>,
    /// Mean, rounded to a tenth of the unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Median. A percentile is at most 0.1 % above the sample it stands for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p50: Option<u64>,
    /// 90th percentile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p90: Option<u64>,
    /// 99th percentile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p99: Option<u64>,
    /// 99.9th percentile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p99_9: Option<u64>,
    /// 99.99th percentile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub p99_99: Option<u64>,
    /// Largest sample, exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<u64>,
}

/// One line with times in ns: the available percentiles and the number of samples.
impl Display for Summary {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let percentiles =
            [("p50", self.p50), ("p99", self.p99), ("p99.9", self.p99_9), ("max", self.max)];
        for (name, ns) in percentiles {
            if let Some(ns) = ns {
                write!(f, "{name} {}  ", duration(ns as f64))?;
            }
        }
        write!(f, "({})", counted(self.count, "sample"))
    }
}
