//! The kernel's throttling of real-time threads.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::machine::Machine;

const RUNTIME: &str = "/proc/sys/kernel/sched_rt_runtime_us";
const PERIOD: &str = "/proc/sys/kernel/sched_rt_period_us";

/// How much of a CPU the kernel grants real-time threads; it stops them for the rest of each
/// period. Written as `runtime/period` in us: `950000/1000000`. A runtime of -1 turns throttling
/// off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Throttling {
    runtime_us: i64,
    period_us: u64,
}

impl Throttling {
    /// Where the kernel has the two numbers.
    pub(crate) const SOURCE: &'static str =
        "/proc/sys/kernel/sched_rt_runtime_us, /proc/sys/kernel/sched_rt_period_us";

    /// Whether it is switched off altogether, for control groups as well.
    pub(crate) fn is_off(self) -> bool {
        self.runtime_us < 0
    }

    /// Runtime granted in each period; `None` if the whole period is granted.
    pub fn granted(self) -> Option<Duration> {
        let runtime_us = u64::try_from(self.runtime_us).ok()?;
        // A budget of the whole period is no limit to the kernel either.
        (runtime_us < self.period_us).then(|| Duration::from_micros(runtime_us))
    }

    /// The period over which the kernel counts the use.
    pub fn period(self) -> Duration {
        Duration::from_micros(self.period_us)
    }

    /// Fraction of a CPU that real-time threads may use, 0 to 1; `None` if it is not limited.
    pub fn share(self) -> Option<f64> {
        Some(self.granted()?.as_secs_f64() / self.period().as_secs_f64())
    }
}

impl fmt::Display for Throttling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.runtime_us, self.period_us)
    }
}

/// The text does not describe throttling as `runtime/period`.
#[derive(Clone, PartialEq, Eq)]
pub struct NoThrottling(String);

impl fmt::Display for NoThrottling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "\"{}\" does not describe throttling; write runtime/period in us, such as 950000/1000000",
            self.0
        )
    }
}

/// The sentence, for a `main` that returns it.
impl fmt::Debug for NoThrottling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for NoThrottling {}

impl FromStr for Throttling {
    type Err = NoThrottling;

    fn from_str(text: &str) -> Result<Self, NoThrottling> {
        let numbers = || {
            let (runtime_us, period_us) = text.split_once('/')?;
            Some(Self { runtime_us: runtime_us.parse().ok()?, period_us: period_us.parse().ok()? })
        };
        numbers().ok_or_else(|| NoThrottling(text.to_owned()))
    }
}

impl TryFrom<String> for Throttling {
    type Error = NoThrottling;

    fn try_from(text: String) -> Result<Self, NoThrottling> {
        text.parse()
    }
}

impl From<Throttling> for String {
    fn from(throttling: Throttling) -> Self {
        throttling.to_string()
    }
}

impl Machine {
    /// How the kernel throttles real-time threads; `None` if it does not say.
    pub fn throttling(&self) -> Option<Throttling> {
        let period_us = u64::try_from(self.number(PERIOD)?).ok()?;
        Some(Throttling { runtime_us: self.number(RUNTIME)?, period_us })
    }

    /// Whether the throttling applies to `SCHED_FIFO`. Since 6.12, a kernel without
    /// `RT_GROUP_SCHED` throttles only `SCHED_DEADLINE`. `None` if the kernel's configuration
    /// cannot be read.
    pub fn throttles_fifo(&self) -> Option<bool> {
        if self.is_at_least(6, 12)? {
            self.config().map(|config| config.is_set("RT_GROUP_SCHED"))
        } else {
            Some(true)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn throttling(text: &str) -> Throttling {
        text.parse().unwrap()
    }

    #[test]
    fn throttling_leaves_its_runtime_of_each_period() {
        let usual = throttling("950000/1000000");
        assert_eq!(usual.granted(), Some(Duration::from_millis(950)));
        assert_eq!(usual.share(), Some(0.95));
        assert_eq!(usual.to_string(), "950000/1000000");
    }

    #[test]
    fn a_runtime_of_minus_one_or_of_the_whole_period_is_no_limit() {
        for text in ["-1/1000000", "1000000/1000000", "0/0"] {
            assert_eq!((throttling(text).granted(), throttling(text).share()), (None, None));
        }
    }

    #[test]
    fn what_is_not_two_numbers_is_not_taken_for_throttling() {
        for text in ["", "950000", "a/b", "1/-1"] {
            let error = text.parse::<Throttling>().unwrap_err();
            assert!(error.to_string().contains("950000/1000000"), "{error}");
        }
    }
}
