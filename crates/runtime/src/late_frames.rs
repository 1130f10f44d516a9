//! Frames that come after the cycles that follow them gave up: while the node runs, and in its report.

use isochrone_engine::format_duration_ns;
use isochrone_schedule::{Margin, Schedule};
use isochrone_timing::{Arrivals, LateFrames, WarningCode};

use crate::alarms::Alarm;
use crate::lasting::{Lasting, StateChange};
use crate::records::Cycle;

/// The stretch of a run by which it is judged when frames come: so long, and at least so many periods.
const STRETCH_NS: u64 = 5_000_000_000;
const STRETCH_PERIODS: u64 = 50;

/// The frames of a service that a task follows.
pub(crate) struct FollowedFrames {
    task: String,
    service: String,
    schedule: Schedule,
    /// Of the stretch that has begun at a release.
    arrivals: Arrivals,
    since_ns: Option<u64>,
    until_ns: u64,
    lasting: Lasting,
    /// What was said last.
    said: Option<Alarm>,
}

impl FollowedFrames {
    /// Those of a service that a task follows.
    pub(crate) fn new(task: String, service: String, schedule: Schedule) -> Self {
        Self {
            task,
            service,
            schedule,
            arrivals: Arrivals::default(),
            since_ns: None,
            until_ns: 0,
            lasting: Lasting::default(),
            said: None,
        }
    }

    /// Takes note of the next cycle.
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Some(follow) = &cycle.follow else { return };
        self.arrivals.record(&cycle.record, follow, self.schedule.period_ns);
        self.since_ns.get_or_insert(cycle.record.release_ns);
        self.until_ns = cycle.record.release_ns;
    }

    /// At the end of a stretch, logs that frames have come to be late in it, or no longer are; returns what
    /// has changed.
    pub(crate) fn judge(&mut self) -> Vec<StateChange> {
        let stretch_ns = self.schedule.period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let since_ns = self.since_ns.unwrap_or(self.until_ns);
        if self.until_ns.saturating_sub(since_ns) < stretch_ns {
            return Vec::new();
        }
        let late = self.arrivals.late_frames(self.schedule.period_ns);
        self.arrivals.clear();
        self.since_ns = None;
        if let Some(alarm) = late.map(|late| self.alarm(late)) {
            if self.lasting.observe(&alarm) {
                tracing::warn!("{}", alarm.sentence());
            }
            self.said = Some(alarm);
        } else if let Some(over) = self.lasting.end(&WarningCode::LateFrames, &self.service) {
            tracing::info!("{}", over.end());
        }
        self.lasting.changes()
    }

    /// What the report says, where frames were late in all, or else for a stretch.
    pub(crate) fn end(self, late: Option<LateFrames>) -> Option<Alarm> {
        late.map(|late| self.alarm(late)).or(self.said)
    }

    fn alarm(&self, late: LateFrames) -> Alarm {
        Alarm::LateFrames {
            task: self.task.clone(),
            service: self.service.clone(),
            within_ns: self.schedule.follow_within_ns.unwrap_or_default(),
            late,
            remedy: remedy(&self.schedule, late),
        }
    }
}

/// The configuration with which the frames would come in time.
fn remedy(schedule: &Schedule, late: LateFrames) -> String {
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
    let catch = format!("write {} in its [[task]]", ways.join(" or "));
    let within_ns = schedule.follow_within_ns.unwrap_or_default();
    if late.median_ns > within_ns.saturating_add(period_ns / 5) {
        return catch;
    }
    // They come as soon as the task gives up, as those of a source do that runs only then.
    format!(
        "{catch}; or, if the task keeps their source from running, give that a higher priority (chrt -f 85 for a \
         publisher) or another CPU"
    )
}

/// The largest of 1, 2, 5, 10, 20 ns ... that is not above `ns`.
fn round_ns(ns: u64) -> u64 {
    let ten = 10_u64.pow(ns.checked_ilog10().unwrap_or_default());
    [5, 2].into_iter().map(|n| n * ten).find(|round_ns| *round_ns <= ns).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use isochrone_schedule::Wake;
    use isochrone_timing::{CycleRecord, FollowRecord, Warning};

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

    fn followed(within_us: u64) -> FollowedFrames {
        FollowedFrames::new("fast".into(), "plant/saw".into(), schedule(within_us))
    }

    #[test]
    fn the_warning_says_when_the_frames_come_and_what_would_catch_them() {
        let alarm = followed(300).end(Some(late(601, 610))).unwrap();
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
        let late_by = late(601, 900);
        assert_eq!(remedy(&schedule(300), late_by), "write phase = \"600us\" in its [[task]]");
        let hybrid = Wake::Hybrid(Margin::Fixed(300 * US));
        let margin = Schedule { wake: hybrid, phase_ns: 800 * US, ..schedule(300) };
        assert_eq!(remedy(&margin, late(601, 610)), "write phase = \"400us\" in its [[task]]");
        let short = remedy(&schedule(10), late(120, 120));
        assert_eq!(short, "write within = \"150us\" or phase = \"100us\" in its [[task]]");
    }

    #[test]
    fn frames_that_come_when_the_task_gives_up_may_be_of_a_source_that_it_keeps_from_running() {
        let says = |median_us| remedy(&schedule(300), late(median_us, median_us)).contains("chrt");
        assert_eq!([310, 490, 510].map(says), [true, true, false]);
    }

    /// Has a task run for so many seconds on frames that are so old at its releases; whether it says something new
    /// of them, and whether they are late then.
    fn run(followed: &mut FollowedFrames, seconds: u64, age_us: u64) -> Option<bool> {
        let first = followed.until_ns / followed.schedule.period_ns;
        let mut changes = Vec::new();
        for cycle in first..first + seconds * 1_000 {
            let release_ns = cycle * followed.schedule.period_ns;
            let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
            let frame_ns = Some(release_ns.saturating_sub(age_us * US));
            let follow = FollowRecord { frame_ns, sent: cycle, ..FollowRecord::default() };
            followed.note(&Cycle { record, follow: Some(follow) });
            changes.extend(followed.judge());
        }
        changes.pop().map(|change| change.meaning.is_some())
    }

    #[test]
    fn while_the_node_runs_it_is_judged_every_five_seconds_and_said_when_it_changes() {
        let mut followed = followed(300);
        assert_eq!(run(&mut followed, 4, 399), None, "it is early to say");
        assert_eq!(run(&mut followed, 2, 399), Some(true));
        assert_eq!(run(&mut followed, 20, 500), None, "that is known");
        assert_eq!(run(&mut followed, 11, 0), Some(false));
        assert_eq!(run(&mut followed, 11, 399), Some(true));
        assert_eq!(run(&mut followed, 11, 0), Some(false));
        let said = followed.end(None).unwrap();
        assert!(said.to_string().contains("come 601 us after"), "for a stretch: {said}");
    }
}
