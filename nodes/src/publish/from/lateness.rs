//! Frames that are sent later than they are due, and waits that are long.

use std::time::Duration;

use isochrone_timing::units::{counted, duration};

use crate::terminal;

/// How late a frame may be sent before that is reported.
const LATE_NS: u64 = 100_000_000;

/// How late frames were sent.
#[derive(Default)]
pub(super) struct Lateness {
    /// The latest.
    pub(super) latest_ns: u64,
    /// How many were later than is left unsaid.
    frames: u64,
    /// How often services changed their signals, and how long that took.
    pub(super) changes: (u64, Duration),
}

impl Lateness {
    pub(super) fn add(&mut self, late_ns: u64) {
        self.latest_ns = self.latest_ns.max(late_ns);
        self.frames += u64::from(late_ns > LATE_NS);
    }

    /// Says how many, and why.
    pub(super) fn note(&self) {
        let Self { latest_ns, frames, changes: (changes, took) } = *self;
        if frames == 0 {
            return;
        }
        let took_ns = took.as_nanos() as f64;
        let why = if took_ns > latest_ns as f64 / 2.0 {
            let changes = counted(changes, "time");
            format!("services changed their signals {changes}, which took {}", duration(took_ns))
        } else {
            "the machine was busy".into()
        };
        let (frames, latest) = (counted(frames, "frame"), duration(latest_ns as f64));
        let were = if self.frames == 1 { "was" } else { "were" };
        terminal::note(&format!("note: {frames} {were} sent late, by up to {latest}; {why}"));
    }
}

/// A time that may be longer than anybody waits.
pub(super) fn long(ns: u64) -> String {
    const HOUR_S: u64 = 3600;
    const DAY_S: u64 = 24 * HOUR_S;
    const YEAR_S: u64 = 365 * DAY_S + DAY_S / 4;
    let s = ns / 1_000_000_000;
    let (unit_s, unit) = match s {
        0..7200 => return duration(ns as f64),
        7200..172_800 => (HOUR_S, "hours"),
        _ if s < 2 * YEAR_S => (DAY_S, "days"),
        _ => (YEAR_S, "years"),
    };
    format!("{} {unit}", s / unit_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_waits_are_said_in_units_that_people_use() {
        let said = [12, 7200, 200_000, 18_446_744_073].map(|s: u64| long(s * 1_000_000_000));
        assert_eq!(said, ["12.0 s", "2 hours", "2 days", "584 years"]);
    }
}
