//! Reasons to read numbers with care.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A reason to treat the numbers with care, and the remedy.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Warning {
    /// Kind of warning.
    pub code: WarningCode,
    /// What happened and why.
    pub message: String,
    /// What to do about it, in one line; empty if there is nothing to do.
    pub remedy: String,
}

/// Declares [`WarningCode`] with the word that each code has in a report.
macro_rules! codes {
    ($($(#[$doc:meta])+ $name:ident = $word:literal,)+) => {
        /// Kind of a [`Warning`]; a word in reports, such as `rt_denied`.
        #[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(from = "String", into = "String")]
        pub enum WarningCode {
            $($(#[$doc])+ $name,)+
            /// A code that another version wrote.
            Unknown(String),
        }

        impl WarningCode {
            /// All codes of this version.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// The word used in reports.
            pub fn as_str(&self) -> &str {
                match self {
                    $(Self::$name => $word,)+
                    Self::Unknown(word) => word,
                }
            }
        }

        impl From<&str> for WarningCode {
            fn from(word: &str) -> Self {
                match word {
                    $($word => Self::$name,)+
                    _ => Self::Unknown(word.to_owned()),
                }
            }
        }
    };
}

codes! {
    /// The kernel refused the real-time priority.
    RtDenied = "rt_denied",
    /// The task could not be pinned to its CPU.
    CpuDenied = "cpu_denied",
    /// Memory could not be locked.
    LockDenied = "lock_denied",
    /// A second publisher sends on the service.
    OtherWriter = "other_writer",
    /// Time stamps are in the receiver's future.
    FutureStamps = "future_stamps",
    /// Time stamps are older than any wait explains.
    PastStamps = "past_stamps",
    /// A publisher runs on another machine.
    ForeignHost = "foreign_host",
    /// An input does not match the frames of its service.
    UnfitInput = "unfit_input",
    /// A channel carries a different signal than before.
    MovedChannel = "moved_channel",
    /// Frames have no announced layout, so channels are selected by number.
    PlainFrames = "plain_frames",
    /// Frames name a layout that nobody announced.
    UnknownLayout = "unknown_layout",
    /// New frames were computed from a sample more than 10 s older.
    OldSource = "old_source",
    /// An input was not ok: its samples were too old, were refused, or did not arrive.
    InputNotOk = "input_not_ok",
    /// Telemetry omits some signals.
    TelemetryCut = "telemetry_cut",
    /// A block panicked, and the node ended with it.
    Panicked = "panicked",
    /// The program is a debug build.
    DebugBuild = "debug_build",
    /// A spinning arm was measured in short parts because of the kernel's throttling.
    SpinInBursts = "spin_in_bursts",
    /// The arm `sleep` is no substitute for cyclictest in this run.
    SleepDiffers = "sleep_differs",
    /// A paced sender missed more than 1 % of its send times.
    PaceNotKept = "pace_not_kept",
}

impl Default for WarningCode {
    fn default() -> Self {
        Self::Unknown(String::new())
    }
}

impl From<String> for WarningCode {
    fn from(word: String) -> Self {
        word.as_str().into()
    }
}

impl From<WarningCode> for String {
    fn from(code: WarningCode) -> Self {
        code.as_str().to_owned()
    }
}

impl fmt::Display for WarningCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_reads_back_from_its_word_and_has_one_of_its_own() {
        for (index, code) in WarningCode::ALL.iter().enumerate() {
            assert_eq!(&WarningCode::from(code.as_str()), code);
            assert!(WarningCode::ALL[..index].iter().all(|other| other.as_str() != code.as_str()));
        }
    }

    #[test]
    fn a_code_of_another_version_is_kept_as_it_was_written() {
        let text = r#"{"code":"gremlins","message":"they are in","remedy":""}"#;
        let warning: Warning = serde_json::from_str(text).unwrap();
        assert_eq!(warning.code, WarningCode::Unknown("gremlins".to_owned()));
        assert_eq!(serde_json::to_string(&warning).unwrap(), text);
    }
}
