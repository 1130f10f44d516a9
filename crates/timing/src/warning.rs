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

/// Declares [`WarningCode`]: of each code its meaning, the word that it has in a report, and the usual
/// remedy.
macro_rules! codes {
    ($($(#[doc = $meaning:literal])+ $name:ident = $word:literal, $remedy:literal;)+) => {
        /// Kind of a [`Warning`]; a word in reports, such as `rt_denied`.
        #[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(from = "String", into = "String")]
        #[non_exhaustive]
        pub enum WarningCode {
            $($(#[doc = $meaning])+ $name,)+
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

            /// Its meaning, as a sentence; empty for a code of another version.
            pub fn meaning(&self) -> &'static str {
                match self {
                    $(Self::$name => concat!($($meaning),+).trim_ascii(),)+
                    Self::Unknown(_) => "",
                }
            }

            /// What to do about it, in one line, unless the message says more; empty if there is
            /// nothing to do.
            pub fn remedy(&self) -> &'static str {
                match self {
                    $(Self::$name => $remedy,)+
                    Self::Unknown(_) => "",
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
        "run as root, or grant the program CAP_SYS_NICE, or set rtprio in /etc/security/limits.conf";
    /// The task could not be pinned to its CPU.
    CpuDenied = "cpu_denied",
        "set the task's cpu to one that the process may use, or widen the cpuset";
    /// Memory could not be locked.
    LockDenied = "lock_denied",
        "run as root, or grant the program CAP_IPC_LOCK, or set memlock unlimited in /etc/security/limits.conf";
    /// A second publisher sends on the service.
    OtherWriter = "other_writer",
        "end one of the two publishers; `isochrone list` shows those of each service";
    /// Time stamps are in the receiver's future.
    FutureStamps = "future_stamps",
        "run both processes in one time namespace, and have publish_ns read from CLOCK_MONOTONIC";
    /// Time stamps are older than any wait explains.
    PastStamps = "past_stamps",
        "run both processes in one time namespace, and have publish_ns read from CLOCK_MONOTONIC";
    /// A publisher runs on another machine.
    ForeignHost = "foreign_host",
        "";
    /// A task follows a service that another machine sends.
    FarFollow = "far_follow",
        "take follow out of its [[task]]: a plain task takes the newest frame at each release";
    /// Frames that a task follows come after its cycles have stopped waiting for them.
    LateFrames = "late_frames",
        "have the task wait longer (within), or give it the phase at which the frames come";
    /// An input does not match the frames of its service.
    UnfitInput = "unfit_input",
        "correct the input's signal, channel or type, or what the publisher sends";
    /// A channel carries a different signal than before.
    MovedChannel = "moved_channel",
        "select the signal by name: signal = \"...\" follows it wherever it stands";
    /// Frames have no announced layout, so channels are selected by number.
    PlainFrames = "plain_frames",
        "select the input's signal by channel, or have the publisher announce its layout";
    /// Frames name a layout that nobody announced.
    UnknownLayout = "unknown_layout",
        "see that the publisher announces the layout on isochrone/layout/<service>";
    /// New frames were computed from a sample more than 10 s older.
    OldSource = "old_source",
        "write feedback = true at the input that closes a loop of nodes, and max_age at the inputs of the nodes before";
    /// An input was not ok: its samples were too old, were refused, or did not arrive.
    InputNotOk = "input_not_ok",
        "see whether its publisher runs, and how punctually, and whether its samples fit the input's type; the log has the cycles";
    /// Blocks of a task reported an error.
    BlockErrors = "block_errors",
        "the log has the blocks and the cycles; `alarms` shows those that report one now";
    /// A task missed releases.
    MissedReleases = "missed_releases",
        "compare its execution times with its period, and see `isochrone doctor` for what else delays it";
    /// Telemetry omits some signals.
    TelemetryCut = "telemetry_cut",
        "publish what else is to be seen with an [[output]], or move a part of the blocks to another task";
    /// The journal lacks what was done last.
    JournalIncomplete = "journal_incomplete",
        "make room where the journal is before the node ends";
    /// The last state of the node could not be written.
    StateIncomplete = "state_incomplete",
        "make room where the state is before the node ends; what was written before is restored";
    /// There is no time to copy the state of a task while it runs.
    StateNotRetained = "state_not_retained",
        "give the task a longer period or fewer blocks; the state after an orderly end is retained all the same";
    /// The newest state of the node is damaged, and the one before it was restored.
    DamagedState = "damaged_state",
        "see what else the disk has lost; what changed last is not restored";
    /// Tasks start cold, not from the retained state of the node.
    ColdStart = "cold_start",
        "see that the outputs are where they should be before the plant goes on";
    /// The node's recording lacks cycles, or what was done.
    RecordingIncomplete = "recording_incomplete",
        "record to a faster disk with more room, or have the tasks publish less; replay compares what is there";
    /// A block panicked, and the node ended with it.
    Panicked = "panicked",
        "fix the block that the message names; what was measured ends with the panic";
    /// Tasks share a CPU and need it at the same time.
    SharedCpu = "shared_cpu",
        "give one of them phase = \"auto\", which keeps clear of what runs, or another cpu";
    /// A task that watches for a frame keeps the task that sends it from running.
    StarvedSource = "starved_source",
        "give the task that follows a lower priority than its source has, or another cpu";
    /// The program is a debug build.
    DebugBuild = "debug_build",
        "run a release build: cargo run --release, or cargo install";
    /// A spinning arm was measured in short parts because of the kernel's throttling.
    SpinInBursts = "spin_in_bursts",
        "sysctl -w kernel.sched_rt_runtime_us=-1";
    /// The arm `sleep` is no substitute for cyclictest in this run.
    SleepDiffers = "sleep_differs",
        "run it longer, or on a quieter machine; otherwise compare with the arm cyclictest itself";
    /// The nodes of the arm `chain` share a CPU.
    ChainSharesCpu = "chain_shares_cpu",
        "measure chains where the bench may use three CPUs";
    /// A paced sender missed more than 1 % of its send times.
    PaceNotKept = "pace_not_kept",
        "lower --pace or --values, or use a machine with less to do";
}

impl Warning {
    /// A warning with the usual remedy of its code.
    pub fn new(code: WarningCode, message: impl Into<String>) -> Self {
        let remedy = code.remedy().to_owned();
        Self { code, message: message.into(), remedy }
    }
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
    fn every_code_has_a_meaning_and_its_remedy_is_one_line() {
        for code in WarningCode::ALL {
            assert!(code.meaning().ends_with('.') && !code.meaning().starts_with(' '), "{code}");
            assert!(
                !code.remedy().contains(['\n', '|']) && !code.remedy().ends_with('.'),
                "{code}"
            );
        }
        assert_eq!(WarningCode::RtDenied.meaning(), "The kernel refused the real-time priority.");
    }

    #[test]
    fn a_code_of_another_version_is_kept_as_it_was_written() {
        let text = r#"{"code":"gremlins","message":"they are in","remedy":""}"#;
        let warning: Warning = serde_json::from_str(text).unwrap();
        assert_eq!(warning.code, WarningCode::Unknown("gremlins".to_owned()));
        assert_eq!(serde_json::to_string(&warning).unwrap(), text);
    }
}
