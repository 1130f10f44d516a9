//! What is compared, and how often messages are sent.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use super::{follow_path, node_path};

/// Values of a message through nodes.
pub(super) const NODE_VALUES: usize = 1;

/// A way from one process to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arm {
    /// Raw iceoryx2 calls
    Raw,
    /// isochrone's ports
    Ports,
    /// Unix datagram socket
    Unix,
    /// Pipe
    Pipe,
    /// TCP over the loopback interface, TCP_NODELAY
    Tcp,
    /// Shared memory with a sequence counter: the floor. Has room for one message; one that is
    /// overwritten before it was read is lost, and no sample
    #[value(name = "cache_line")]
    CacheLine,
    /// Publisher, control node at 1 kHz, subscriber; paced with one value only
    Node,
    /// Through a control node that follows, from sending to reading in one thread; with one value
    /// only, at paces whose period divides 20 ms, up to 10 kHz
    Follow,
    /// The same through two control nodes, the second of which follows the first
    Chain,
}

impl Arm {
    /// Its name in reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Ports => "ports",
            Self::Unix => "unix",
            Self::Pipe => "pipe",
            Self::Tcp => "tcp",
            Self::CacheLine => "cache_line",
            Self::Node => "node",
            Self::Follow => "follow",
            Self::Chain => "chain",
        }
    }

    /// Whether its receiver can sleep in the kernel until a message comes.
    pub const fn can_block(self) -> bool {
        matches!(self, Self::Unix | Self::Pipe | Self::Tcp)
    }

    /// Whether its receiver watches for messages all the time, unless it can block and shall. Through
    /// nodes that follow it is the sender that watches, and only while a message is on its way.
    pub(super) const fn polls(self) -> bool {
        !matches!(self, Self::Follow | Self::Chain)
    }

    /// Whether it has messages of this size at this pace.
    pub(super) fn has(self, values: usize, pace: Pace) -> bool {
        match self {
            Self::Node => values == NODE_VALUES && pace == Pace::Hz(node_path::RATE_HZ),
            Self::Follow | Self::Chain => {
                values == NODE_VALUES && follow_path::period_ns(pace).is_some()
            }
            _ => true,
        }
    }
}

impl fmt::Display for Arm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

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
pub enum Pace {
    /// So many times a second.
    Hz(f64),
    /// As soon as the one before was answered.
    BackToBack,
}

const PACES_HZ: std::ops::RangeInclusive<f64> = 0.1..=100_000.0;

impl Pace {
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

impl fmt::Display for Pace {
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
        assert_eq!(Pace::parse("1000"), Ok(Pace::Hz(1_000.0)));
        assert_eq!(Pace::parse("back-to-back"), Ok(Pace::BackToBack));
        for wrong in ["0", "-1", "NaN", "inf", "200000", "", "fast"] {
            let error = Pace::parse(wrong).unwrap_err();
            assert!(error.contains("100000, or back-to-back"), "{wrong}: {error}");
        }
    }

    #[test]
    fn an_arm_has_the_same_name_in_reports_and_on_the_command_line() {
        for arm in Arm::value_variants() {
            assert_eq!(arm.to_possible_value().unwrap().get_name(), arm.as_str());
        }
    }
}
