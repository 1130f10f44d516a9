//! The sentences of alarms.

use std::fmt;

use isochrone_ipc::ListedNode;
use isochrone_timing::InputReport;
use isochrone_timing::LateFrames;
use isochrone_timing::units::{counted, duration};

use super::alarms::Alarm;
use crate::task::bindings::quoted_unit;

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OtherWriter { service, publishers } => write!(
                f,
                "service \"{service}\" has a second publisher{}; the frames of one are read, those of \
                 the other are counted only (one of isochrone is followed at once, any other when the \
                 first falls silent)",
                of(publishers)
            ),
            Self::FutureStamps { service, ahead_ns } => write!(
                f,
                "the stamps of service \"{service}\" lie {} in the future, so its publisher has \
                 another clock; ages count from the arrival, and there are no latencies",
                seconds(*ahead_ns)
            ),
            Self::PastStamps { service, behind_ns } => write!(
                f,
                "frames of service \"{service}\" arrive with stamps that are {} old, so its publisher \
                 has another clock or was held up; they count as old as they say, and inputs with a \
                 max_age below that are stale",
                seconds(*behind_ns)
            ),
            Self::ForeignHost { service, publisher } => write!(
                f,
                "\"{publisher}\", which publishes service \"{service}\", runs on another machine, \
                 whose clock says nothing here; ages count from the arrival, and there are no latencies"
            ),
            Self::FarFollow { task, service } => write!(
                f,
                "task \"{task}\" follows service \"{service}\", which another machine sends: its frames come \
                 when the link delivers them, so cycles begin anywhere within the time that follow allows"
            ),
            Self::LateFrames {
                task,
                service,
                within_ns,
                late: LateFrames { in_vain: Some(in_vain), .. },
                sources,
                ..
            } => write!(
                f,
                "{} of {} cycles of task \"{task}\" timed out although frames of service \"{service}\" were \
                 sent for them: {} sends now within the {} for which the task waits, and now later",
                in_vain.timed_out,
                in_vain.cycles,
                names(sources),
                duration(*within_ns as f64),
            ),
            Self::LateFrames { task, service, within_ns, late, .. } => write!(
                f,
                "the frames of service \"{service}\" come {} after the releases of task \"{task}\", which \
                 waits {} for them: each waits for the next release, {} at the median",
                duration(late.median_ns as f64),
                duration(*within_ns as f64),
                duration(late.age_ns as f64)
            ),
            Self::UnfitInput { input, service, publisher, why } => write!(
                f,
                "input \"{input}\" cannot read service \"{service}\" of \"{publisher}\": {why}; it \
                 takes no sample of it, and reads what its on_stale says"
            ),
            Self::MovedChannel { input, service, channel, before, now } => write!(
                f,
                "input \"{input}\" reads channel {channel} of service \"{service}\", which was \
                 \"{before}\" and is \"{now}\" now"
            ),
            Self::Unit { input, service, unit, announced, is_declared: true } => write!(
                f,
                "input \"{input}\" is in {}, and service \"{service}\" announces it in {}; its samples are \
                 rejected",
                quoted_unit(unit),
                quoted_unit(announced)
            ),
            Self::Unit { input, service, unit, announced, .. } => write!(
                f,
                "input \"{input}\" has no unit, and service \"{service}\", which announced it in {}, announces it \
                 in {} now; its samples are taken",
                quoted_unit(unit),
                quoted_unit(announced)
            ),
            Self::PlainFrames { input, service } => write!(
                f,
                "the frames of service \"{service}\" do not say which layout they have, so input \
                 \"{input}\" finds no signal by its name; it takes no sample, and reads \
                 what its on_stale says"
            ),
            Self::UnknownLayout { service, number } => write!(
                f,
                "the frames of service \"{service}\" have layout {number:016x}, which nobody \
                 announces; its inputs take no sample, and read what their on_stale says"
            ),
            Self::OldSource { service, behind_ns, flags } if !flags.is_empty() => write!(
                f,
                "the frames of service \"{service}\" say {flags} and are computed from a sample that is {} old: \
                 nodes that read each other hand both round, or a source before its publisher has been stale for \
                 so long",
                seconds(*behind_ns)
            ),
            Self::OldSource { service, behind_ns, .. } => write!(
                f,
                "fresh frames of service \"{service}\" are computed from a sample that is {} old: nodes \
                 that read each other hand it round, or its publisher died and nobody noticed",
                seconds(*behind_ns)
            ),
            Self::InputNotOk(InputReport { name, ok: false, falls: 0, not_ok_ns, .. }) => {
                write!(f, "input \"{name}\" was never ok, for {}", seconds(*not_ok_ns))
            }
            Self::InputNotOk(InputReport { name, ok, falls, not_ok_ns, .. }) => {
                let times = if *falls == 1 { "once".into() } else { format!("{falls} times") };
                let end = if *ok { "it was ok in the end" } else { "it was not ok in the end" };
                let not_ok = duration(*not_ok_ns as f64);
                write!(f, "input \"{name}\" ceased to be ok {times}, for {not_ok} in all; {end}")
            }
            Self::BlockErrors { task, steps } => {
                let steps = counted(*steps, "step");
                write!(f, "blocks of task \"{task}\" reported an error in {steps}")
            }
            Self::MissedReleases { task, missed, cycles } => {
                let (missed, cycles) = (counted(*missed, "release"), counted(*cycles, "cycle"));
                write!(f, "task \"{task}\" missed {missed} beside the {cycles} that it ran")
            }
            Self::TelemetryCut { task, signals, shown, service } => write!(
                f,
                "task \"{task}\" has {signals} signals, and {service} shows the first {shown} of them"
            ),
            Self::JournalIncomplete { reason }
            | Self::RecordingIncomplete { reason }
            | Self::StateIncomplete { reason }
            | Self::StateNotRetained { reason }
            | Self::DamagedState { reason }
            | Self::ColdStart { reason } => f.write_str(reason),
        }
    }
}

/// Lists the publishers of a service, or says that they are unknown.
fn names(publishers: &[ListedNode]) -> String {
    match publishers {
        [] => "its source".to_owned(),
        known => known.iter().map(ListedNode::to_string).collect::<Vec<_>>().join(" and "),
    }
}

/// Lists two or more publishers after the word for them.
fn of(publishers: &[ListedNode]) -> String {
    match publishers {
        [] | [_] => String::new(),
        several => format!(": {}", names(several)),
    }
}

fn seconds(ns: u64) -> String {
    format!("{:?} s", (ns as f64 / 1e8).round() / 10.0)
}
