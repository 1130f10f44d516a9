//! Command-line arguments of publishing a recording.

use std::path::PathBuf;

use crate::base::numbers;

/// A recording that is published.
#[derive(clap::Args)]
pub(in crate::publish) struct FromArgs {
    /// Recording (MCAP) whose services are published again, from `record`, `run --record` or `ros2 bag record`: all of
    /// them, or those that are named. Each frame has its values, cycle and flags, and follows the one before at the
    /// distance of their releases, also across services
    #[arg(long, value_name = "FILE.mcap")]
    pub(in crate::publish) from: Option<PathBuf>,
    /// How fast a recording is published: 1 as it was recorded, 0.5 half as fast, max without waiting between
    /// frames, also not for readers: what does not fit into a reader's buffer is lost to it
    #[arg(
        long,
        value_name = "FACTOR|max",
        default_value = "1",
        conflicts_with_all = ["value", "wave", "csv"],
        value_parser = Speed::parse,
        allow_negative_numbers = true
    )]
    pub(in crate::publish) speed: Speed,
}

/// How fast a recording is published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::publish) enum Speed {
    /// This many times as fast as it was recorded.
    Times(f64),
    /// Without waiting.
    Max,
}

impl Speed {
    const RANGE: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

    fn parse(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Max),
            Ok(times) if Self::RANGE.contains(&times) => Ok(Self::Times(times)),
            _ => Err("give a factor from 0.001 to 1000, such as 0.5, or max".into()),
        }
    }

    /// When a frame is sent that stood so far behind the first one, if it is to wait.
    pub(super) fn after_ns(self, recorded_ns: u64) -> Option<u64> {
        match self {
            Self::Times(1.0) => Some(recorded_ns),
            Self::Times(times) => Some((recorded_ns as f64 / times).round() as u64),
            Self::Max => None,
        }
    }

    /// How many times as fast as recorded; `None`: nobody knows.
    pub(super) fn times(self) -> Option<f64> {
        match self {
            Self::Times(times) => Some(times),
            Self::Max => None,
        }
    }

    pub(super) fn words(self) -> String {
        match self {
            Self::Times(1.0) => "as it was recorded".into(),
            Self::Times(times) => format!("{} times as fast", numbers::six_digits(times)),
            Self::Max => "as fast as it goes".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_stand_as_far_from_each_other_as_the_speed_says() {
        let after = |text: &str| Speed::parse(text).map(|speed| speed.after_ns(1_000_000_007));
        assert_eq!(after("1"), Ok(Some(1_000_000_007)));
        assert_eq!(after("0.5"), Ok(Some(2_000_000_014)));
        assert_eq!(after("max"), Ok(None));
        for bad in ["0", "-1", "NaN", "fast", "1001", ""] {
            assert!(after(bad).is_err(), "{bad}");
        }
    }
}
