//! Frames that come after the cycles that follow them gave up.

use isochrone_engine::format_duration_ns;
use isochrone_schedule::{Margin, Schedule};
use isochrone_timing::LateFrames;

use crate::alarms::Alarm;
use crate::outcome::TaskOutcome;

impl TaskOutcome {
    /// The alarm that the frames of the service that it follows come late.
    pub(crate) fn late_frames(&self, service: &str, schedule: &Schedule) -> Option<Alarm> {
        let late = self.timing.late_frames()?;
        let link = self.links.iter().find(|link| link.service == service)?;
        let sent = link.frames.saturating_add(link.lost);
        let releases = self.timing.cycles().saturating_add(self.timing.missed());
        FollowedFrames { task: &self.name, service, schedule, sent, releases }.alarm(late)
    }
}

/// What a task follows, and how many of its frames there were.
struct FollowedFrames<'a> {
    task: &'a str,
    service: &'a str,
    schedule: &'a Schedule,
    /// Frames that were sent while it ran.
    sent: u64,
    /// Its releases.
    releases: u64,
}

impl FollowedFrames<'_> {
    /// The alarm that the frames come late, unless their source is faster: of its frames the newest lies ready at
    /// a release, whenever that is.
    fn alarm(&self, late: LateFrames) -> Option<Alarm> {
        let is_faster = self.sent > self.releases.saturating_add(self.releases / 2);
        let within_ns = self.schedule.follow_within_ns.filter(|_| !is_faster)?;
        Some(Alarm::LateFrames {
            task: self.task.to_owned(),
            service: self.service.to_owned(),
            within_ns,
            late,
            remedy: remedy(self.schedule, late)?,
        })
    }
}

/// The configuration with which the frames would come in time.
fn remedy(schedule: &Schedule, late: LateFrames) -> Option<String> {
    let period_ns = schedule.period_ns.max(1);
    let step_ns = round_ns(period_ns / 20);
    let within_ns = (late.p99_ns + step_ns / 2).next_multiple_of(step_ns);
    let margin_ns = schedule.wake.margin().and_then(Margin::fixed_ns).unwrap_or_default();
    // A real-time task may not watch for nearly all of its period.
    let longest_ns = (period_ns - period_ns / 10).saturating_sub(margin_ns);
    let phase_ns = (schedule.phase_ns + late.median_ns) % period_ns / step_ns * step_ns;
    let written = |key: &str, ns: u64| format!("{key} = \"{}\"", format_duration_ns(ns));
    let longer = (within_ns <= longest_ns).then(|| written("within", within_ns));
    let later = (phase_ns != schedule.phase_ns).then(|| written("phase", phase_ns));
    let ways: Vec<String> = longer.into_iter().chain(later).collect();
    (!ways.is_empty()).then(|| format!("write {} in its [[task]]", ways.join(" or ")))
}

/// The largest of 1, 2, 5, 10, 20 ns ... that is not above `ns`.
fn round_ns(ns: u64) -> u64 {
    let ten = 10_u64.pow(ns.checked_ilog10().unwrap_or_default());
    [5, 2].into_iter().map(|n| n * ten).find(|round_ns| *round_ns <= ns).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use isochrone_schedule::Wake;
    use isochrone_timing::{Warning, WarningCode};

    use super::*;

    const US: u64 = 1_000;

    fn schedule(within_us: u64) -> Schedule {
        let follow_within_ns = Some(within_us * US);
        Schedule { follow_within_ns, ..Schedule::every(1_000 * US, Wake::Sleep) }
    }

    fn late(median_us: u64, p99_us: u64) -> LateFrames {
        let age_ns = (1_000 - median_us) * US;
        LateFrames { median_ns: median_us * US, p99_ns: p99_us * US, age_ns }
    }

    fn alarm(schedule: &Schedule, sent: u64, late: LateFrames) -> Option<Alarm> {
        let (task, service) = ("fast", "plant/saw");
        FollowedFrames { task, service, schedule, sent, releases: 1_000 }.alarm(late)
    }

    #[test]
    fn the_warning_says_when_the_frames_come_and_what_would_catch_them() {
        let alarm = alarm(&schedule(300), 1_000, late(601, 610)).unwrap();
        let Warning { code, message, remedy } = Warning::from(&alarm);
        assert_eq!(code, WarningCode::LateFrames);
        assert_eq!(
            message,
            "the frames of service \"plant/saw\" come 601 us after the releases of task \"fast\", which waits \
             300 us for them: each waits for the next release, 399 us at the median"
        );
        assert_eq!(remedy, "write within = \"650us\" or phase = \"600us\" in its [[task]]");
    }

    #[test]
    fn a_remedy_is_one_that_the_task_can_have() {
        let remedy = |schedule: &Schedule, late| super::remedy(schedule, late).unwrap();
        let late_by = late(601, 900);
        assert_eq!(remedy(&schedule(300), late_by), "write phase = \"600us\" in its [[task]]");
        let hybrid = Wake::Hybrid(Margin::Fixed(300 * US));
        let margin = Schedule { wake: hybrid, phase_ns: 800 * US, ..schedule(300) };
        assert_eq!(remedy(&margin, late(601, 610)), "write phase = \"400us\" in its [[task]]");
        assert_eq!(remedy(&schedule(10), late(20, 20)), "write within = \"50us\" in its [[task]]");
    }

    #[test]
    fn the_newest_frame_of_a_faster_source_is_not_late() {
        assert!(alarm(&schedule(300), 1_500, late(601, 610)).is_some());
        assert_eq!(alarm(&schedule(300), 2_000, late(601, 610)), None);
    }
}
