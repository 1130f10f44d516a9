//! How often messages are sent, and how receivers wait for them.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// How a receiver waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wait {
    /// Poll continuously: compares transports, not wake-ups
    Poll,
    /// Sleep in the kernel where the transport can: unix, pipe and tcp
    Block,
}

/// How often a message is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SendPace {
    /// So many times a second.
    Hz(f64),
    /// As soon as the one before was answered.
    BackToBack,
}

const PACES_HZ: std::ops::RangeInclusive<f64> = 0.1..=100_000.0;

impl SendPace {
    /// Reads `1000` or `back-to-back`.
    ///
    /// # Errors
    /// It is neither, or too fast or slow.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.parse::<f64>() {
            Ok(hz) if PACES_HZ.contains(&hz) => Ok(Self::Hz(hz)),
            _ if text == "back-to-back" => Ok(Self::BackToBack),
            _ => Err(format!(
                "give messages per second, from {} to {}, or back-to-back",
                PACES_HZ.start(),
                PACES_HZ.end()
            )),
        }
    }

    /// Messages per second, if that is given.
    pub const fn hz(self) -> Option<f64> {
        match self {
            Self::Hz(hz) => Some(hz),
            Self::BackToBack => None,
        }
    }
}

impl fmt::Display for SendPace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hz(hz) => write!(f, "{hz} Hz"),
            Self::BackToBack => f.write_str("back to back"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_is_a_rate_or_back_to_back() {
        assert_eq!(SendPace::parse("1000"), Ok(SendPace::Hz(1_000.0)));
        assert_eq!(SendPace::parse("back-to-back"), Ok(SendPace::BackToBack));
        for wrong in ["0", "-1", "NaN", "inf", "200000", "", "fast"] {
            let error = SendPace::parse(wrong).unwrap_err();
            assert!(error.contains("100000, or back-to-back"), "{wrong}: {error}");
        }
    }
}
