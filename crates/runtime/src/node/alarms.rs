//! Alarms of a running node.

use isochrone_ipc::{Flags, ListedNode};
use isochrone_timing::{InputReport, LateFrames, TaskTiming, WarningCode};

/// Something that operators should know about a running node. It is logged when it comes up, and it is in the
/// [`Outcome`](crate::Outcome). `Display` says what happened and why.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Alarm {
    /// A second publisher sends on a service.
    OtherWriter {
        /// The service.
        service: String,
        /// All its publishers, as far as they are known.
        publishers: Vec<ListedNode>,
    },
    /// The stamps of a publisher lie in the future.
    FutureStamps {
        /// The service.
        service: String,
        /// How far, in ns.
        ahead_ns: u64,
    },
    /// The stamps of a publisher lie in the past.
    PastStamps {
        /// The service.
        service: String,
        /// How far, in ns.
        behind_ns: u64,
    },
    /// A publisher runs on another machine.
    ForeignHost {
        /// The service.
        service: String,
        /// Who publishes it.
        publisher: String,
    },
    /// A task follows a service that another machine sends.
    FarFollow {
        /// The task.
        task: String,
        /// The service.
        service: String,
    },
    /// Frames that a task follows come after its cycles gave up.
    LateFrames {
        /// The task.
        task: String,
        /// The service.
        service: String,
        /// How long after a release the task waits for a frame, in ns.
        within_ns: u64,
        /// When the frames arrive instead.
        late: LateFrames,
        /// The publishers, as far as they are known.
        sources: Vec<ListedNode>,
        /// What to do about it.
        remedy: String,
    },
    /// An input does not fit the frames of its service.
    UnfitInput {
        /// The input.
        input: String,
        /// Its service.
        service: String,
        /// Who publishes it.
        publisher: String,
        /// How they differ.
        why: String,
    },
    /// A channel carries another signal than before.
    MovedChannel {
        /// The input that reads it.
        input: String,
        /// Its service.
        service: String,
        /// The channel, from 0.
        channel: usize,
        /// The signal before.
        before: String,
        /// The signal now.
        now: String,
    },
    /// Frames do not say what they are, and an input wants a signal by its name.
    PlainFrames {
        /// The input.
        input: String,
        /// Its service.
        service: String,
    },
    /// Frames have a layout that nobody announces.
    UnknownLayout {
        /// The service.
        service: String,
        /// The layout's number.
        number: u64,
    },
    /// Fresh frames are computed from a sample that is long past.
    OldSource {
        /// The service.
        service: String,
        /// How much older than its frame the sample is, in ns.
        behind_ns: u64,
        /// The flags of the frames, which may come from the frames that they were computed from.
        flags: Flags,
    },
    /// An input was not ok.
    InputNotOk(InputReport),
    /// Blocks of a task reported an error.
    BlockErrors {
        /// The task.
        task: String,
        /// Steps of blocks that did.
        steps: u64,
    },
    /// A task missed releases.
    MissedReleases {
        /// The task.
        task: String,
        /// How many it missed.
        missed: u64,
        /// How many cycles it ran.
        cycles: u64,
    },
    /// A task has more signals than telemetry shows.
    TelemetryCut {
        /// The task.
        task: String,
        /// How many it has.
        signals: usize,
        /// How many are shown.
        shown: usize,
        /// The telemetry service.
        service: String,
    },
    /// The latest changes are not in the journal.
    JournalIncomplete {
        /// Which journal, and why, in a sentence.
        reason: String,
    },
    /// The last state of the node could not be written.
    StateIncomplete {
        /// Which file, and why, in a sentence.
        reason: String,
    },
    /// There is no time to copy the state of a task while it runs.
    StateNotRetained {
        /// Of which task, and why, in a sentence.
        reason: String,
    },
    /// The newest state of the node is damaged, and the one before it was restored.
    DamagedState {
        /// Which file, and how, in a sentence.
        reason: String,
    },
    /// Blocks and inputs do not go on from the state of the node.
    ColdStart {
        /// Why, in a sentence.
        reason: String,
    },
    /// Cycles or changes are missing from the recording.
    RecordingIncomplete {
        /// Which recording, and why, in a sentence.
        reason: String,
    },
}

impl Alarm {
    /// The alarms that follow from the counts of a task.
    pub(crate) fn of_counts(
        task: &str,
        block_errors: u64,
        timing: &TaskTiming,
    ) -> impl Iterator<Item = Self> {
        let (missed, cycles) = (timing.missed(), timing.cycles());
        let task = || task.to_owned();
        let errors =
            (block_errors > 0).then(|| Self::BlockErrors { task: task(), steps: block_errors });
        let missed = (missed > 0).then(|| Self::MissedReleases { task: task(), missed, cycles });
        errors.into_iter().chain(missed)
    }

    /// Whether a report shows it as numbers of a task and needs no warning for it.
    pub(crate) fn is_counted(&self) -> bool {
        matches!(self, Self::BlockErrors { .. } | Self::MissedReleases { .. })
    }

    /// Its code in reports, to which the remedy belongs.
    pub fn code(&self) -> WarningCode {
        match self {
            Self::OtherWriter { .. } => WarningCode::OtherWriter,
            Self::FutureStamps { .. } => WarningCode::FutureStamps,
            Self::PastStamps { .. } => WarningCode::PastStamps,
            Self::ForeignHost { .. } => WarningCode::ForeignHost,
            Self::FarFollow { .. } => WarningCode::FarFollow,
            Self::LateFrames { .. } => WarningCode::LateFrames,
            Self::UnfitInput { .. } => WarningCode::UnfitInput,
            Self::MovedChannel { .. } => WarningCode::MovedChannel,
            Self::PlainFrames { .. } => WarningCode::PlainFrames,
            Self::UnknownLayout { .. } => WarningCode::UnknownLayout,
            Self::OldSource { .. } => WarningCode::OldSource,
            Self::InputNotOk(_) => WarningCode::InputNotOk,
            Self::BlockErrors { .. } => WarningCode::BlockErrors,
            Self::MissedReleases { .. } => WarningCode::MissedReleases,
            Self::TelemetryCut { .. } => WarningCode::TelemetryCut,
            Self::JournalIncomplete { .. } => WarningCode::JournalIncomplete,
            Self::StateIncomplete { .. } => WarningCode::StateIncomplete,
            Self::StateNotRetained { .. } => WarningCode::StateNotRetained,
            Self::DamagedState { .. } => WarningCode::DamagedState,
            Self::ColdStart { .. } => WarningCode::ColdStart,
            Self::RecordingIncomplete { .. } => WarningCode::RecordingIncomplete,
        }
    }

    /// What to do about it; empty if there is nothing to do.
    pub fn remedy(&self) -> String {
        match self {
            Self::LateFrames { remedy, .. } => remedy.clone(),
            _ => self.code().remedy().to_owned(),
        }
    }

    /// What it is about: an input, or else a service; empty for others.
    pub(crate) fn subject(&self) -> &str {
        match self {
            Self::OtherWriter { service, .. }
            | Self::FutureStamps { service, .. }
            | Self::PastStamps { service, .. }
            | Self::FarFollow { service, .. }
            | Self::LateFrames { service, .. }
            | Self::OldSource { service, .. } => service,
            Self::MovedChannel { input, .. } => input,
            _ => "",
        }
    }

    /// The log line for its end.
    pub(crate) fn end(&self) -> String {
        let subject = self.subject();
        match self {
            Self::OtherWriter { .. } => format!("service \"{subject}\" has one publisher again"),
            Self::FutureStamps { .. } | Self::PastStamps { .. } => {
                format!("no frame of service \"{subject}\" has a stamp of another clock any more")
            }
            Self::FarFollow { task, .. } => {
                format!(
                    "service \"{subject}\", which task \"{task}\" follows, is sent by this machine again"
                )
            }
            Self::LateFrames { task, .. } => {
                format!(
                    "the frames of service \"{subject}\" no longer come late for task \"{task}\""
                )
            }
            Self::OldSource { .. } => {
                format!("no frame of service \"{subject}\" is computed from an old sample any more")
            }
            Self::MovedChannel { before, channel, .. } => {
                format!("input \"{subject}\" reads \"{before}\" in channel {channel} again")
            }
            other => format!("over: {other}"),
        }
    }

    /// What happened and what to do about it, as a log line.
    pub fn sentence(&self) -> String {
        match self.remedy().as_str() {
            "" => self.to_string(),
            remedy => format!("{self}; {remedy}"),
        }
    }
}
