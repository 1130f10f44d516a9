//! What is wrong with the frames that arrive, in words.
//!
//! An alarm is logged when it comes up, and stands in the report among the warnings.

use isochrone_timing::{Warning, WarningCode};

/// A second publisher sends on a service.
pub fn other_writer(service: &str) -> Warning {
    Warning {
        code: WarningCode::OtherWriter,
        message: format!(
            "service \"{service}\" has a second publisher; the frames of one are read, those of the \
             other are counted only (one of isochrone is followed at once, any other when the first \
             falls silent)"
        ),
        remedy: "end one of the two; `iox2 service details` lists the publishers of a service"
            .into(),
    }
}

/// The stamps of a publisher lie in the future.
pub fn future_stamps(service: &str, ahead_ns: u64) -> Warning {
    Warning {
        code: WarningCode::FutureStamps,
        message: format!(
            "the stamps of service \"{service}\" lie {} in the future, so its publisher has another \
             clock; ages count from the arrival, and there are no latencies",
            seconds(ahead_ns)
        ),
        remedy: OTHER_CLOCK.into(),
    }
}

/// The stamps of a publisher lie in the past.
pub fn past_stamps(service: &str, behind_ns: u64) -> Warning {
    Warning {
        code: WarningCode::PastStamps,
        message: format!(
            "frames of service \"{service}\" arrive with stamps that are {} old, so its publisher has \
             another clock or was held up; they count as old as they say, and inputs with a max_age \
             below that are stale",
            seconds(behind_ns)
        ),
        remedy: OTHER_CLOCK.into(),
    }
}

/// A publisher runs on another machine.
pub fn foreign_host(service: &str, publisher: &str) -> Warning {
    Warning {
        code: WarningCode::ForeignHost,
        message: format!(
            "\"{publisher}\", which publishes service \"{service}\", runs on another machine, whose \
             clock says nothing here; ages count from the arrival, and there are no latencies"
        ),
        remedy: String::new(),
    }
}

/// An input does not fit the frames of its service.
pub fn unfit_input(input: &str, service: &str, publisher: &str, why: &str) -> Warning {
    Warning {
        code: WarningCode::UnfitInput,
        message: format!(
            "input \"{input}\" cannot read service \"{service}\" of \"{publisher}\": {why}; it keeps \
             its value"
        ),
        remedy: "correct the input's signal, channel or type, or what the publisher sends".into(),
    }
}

/// A channel carries another signal than before.
pub fn moved_channel(input: &str, service: &str, channel: usize, names: [&str; 2]) -> Warning {
    let [before, now] = names;
    Warning {
        code: WarningCode::MovedChannel,
        message: format!(
            "input \"{input}\" reads channel {channel} of service \"{service}\", which was \"{before}\" \
             and is \"{now}\" now"
        ),
        remedy: format!("write signal = \"{before}\" to follow the signal wherever it stands"),
    }
}

/// Frames do not say what they are, and an input wants a signal by its name.
pub fn plain_frames(input: &str, service: &str) -> Warning {
    Warning {
        code: WarningCode::PlainFrames,
        message: format!(
            "the frames of service \"{service}\" do not say which layout they have, so input \
             \"{input}\" finds no signal by its name; it keeps its value"
        ),
        remedy: "bind the input by channel, or have the publisher announce its layout".into(),
    }
}

/// Frames have a layout that nobody announces.
pub fn unknown_layout(service: &str, number: u64) -> Warning {
    Warning {
        code: WarningCode::UnknownLayout,
        message: format!(
            "the frames of service \"{service}\" have layout {number:016x}, which nobody announces; \
             its inputs keep their values"
        ),
        remedy: format!(
            "see that the publisher announces its layout on isochrone/layout/{service}"
        ),
    }
}

const OTHER_CLOCK: &str =
    "run both processes in one time namespace, and have publish_ns read from CLOCK_MONOTONIC";

/// An alarm as a log line.
pub fn sentence(alarm: &Warning) -> String {
    match alarm.remedy.as_str() {
        "" => alarm.message.clone(),
        remedy => format!("{}; {remedy}", alarm.message),
    }
}

fn seconds(ns: u64) -> String {
    format!("{:?} s", (ns as f64 / 1e8).round() / 10.0)
}
