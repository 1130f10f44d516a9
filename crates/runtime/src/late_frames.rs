//! Frames that come after the cycles that follow them gave up: while the node runs, and in its report.

use isochrone_engine::format_duration_ns;
use isochrone_schedule::Schedule;
use isochrone_timing::{Arrivals, LateFrames, Punctuality, WarningCode};

use crate::alarms::Alarm;
use crate::lasting::{Lasting, StateChange};
use crate::records::Cycle;

/// The stretch of a run by which it is judged when frames come: so long, and at least so many periods.
const STRETCH_NS: u64 = 5_000_000_000;
const STRETCH_PERIODS: u64 = 50;
/// A slow source may take so many times as long to be judged.
const MOST_STRETCHES: u64 = 12;
/// Two stretches in which frames come this part of a period apart, or more, are of a source that drifts.
const STEADY: u64 = 50;
/// Frames that come this part of a period earlier or later than it was said are news.
const NEWS: u64 = 20;

/// The frames of a service that a task follows.
pub(crate) struct FollowedFrames {
    task: String,
    /// The task's real-time priority.
    priority: Option<u8>,
    service: String,
    schedule: Schedule,
    /// Of the stretch that has begun at a release.
    arrivals: Arrivals,
    since_ns: Option<u64>,
    until_ns: u64,
    lasting: Lasting,
    /// Of the stretch before, if frames were late in it.
    before: Option<LateFrames>,
    /// As the alarm says that stands.
    told: Option<LateFrames>,
    /// For the report.
    first: Option<Alarm>,
}

impl FollowedFrames {
    /// Those of a service that a task follows.
    pub(crate) fn new(
        task: String,
        priority: Option<u8>,
        service: String,
        schedule: Schedule,
    ) -> Self {
        Self {
            task,
            priority,
            service,
            schedule,
            arrivals: Arrivals::default(),
            since_ns: None,
            until_ns: 0,
            lasting: Lasting::default(),
            before: None,
            told: None,
            first: None,
        }
    }

    /// Takes note of the next cycle.
    pub(crate) fn note(&mut self, cycle: &Cycle) {
        let Some(follow) = &cycle.follow else { return };
        self.arrivals.record(&cycle.record, follow, self.schedule.period_ns);
        self.since_ns.get_or_insert(cycle.record.release_ns);
        self.until_ns = cycle.record.release_ns;
    }

    /// At the end of a stretch, logs when frames begin to come late, or no longer do; returns what has changed.
    pub(crate) fn judge(&mut self) -> Vec<StateChange> {
        let stretch_ns = self.schedule.period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let since_ns = self.since_ns.unwrap_or(self.until_ns);
        let passed_ns = self.until_ns.saturating_sub(since_ns);
        if passed_ns < stretch_ns {
            return Vec::new();
        }
        match self.arrivals.punctuality(self.schedule.period_ns) {
            Punctuality::TooFew if passed_ns / MOST_STRETCHES < stretch_ns => return Vec::new(),
            Punctuality::Late(late) => self.take_late(late),
            Punctuality::Between => self.before = None,
            Punctuality::InTime | Punctuality::TooFew => {
                (self.before, self.told) = (None, None);
                if let Some(over) = self.lasting.end(&WarningCode::LateFrames, &self.service) {
                    tracing::info!("{}", over.end());
                }
            }
        }
        self.arrivals.clear();
        self.since_ns = None;
        self.lasting.changes()
    }

    fn take_late(&mut self, late: LateFrames) {
        let is_near = |other: Option<LateFrames>, part: u64| {
            let apart_ns = other.map(|other| other.median_ns.abs_diff(late.median_ns));
            apart_ns.is_some_and(|apart_ns| apart_ns <= self.schedule.period_ns / part)
        };
        let before = self.before.replace(late);
        let is_held_up = |late: LateFrames| late.alternate;
        let is_certain =
            is_near(before, STEADY) || late.alternate && before.is_some_and(is_held_up);
        let is_known =
            is_near(self.told, NEWS) || late.alternate && self.told.is_some_and(is_held_up);
        if !is_certain || is_known {
            return;
        }
        let alarm = self.alarm(late);
        if self.lasting.begin(&alarm) {
            tracing::warn!("{}", alarm.sentence());
        }
        self.told = Some(late);
        self.first.get_or_insert(alarm);
    }

    /// What the report says, if frames were late over the whole run, or for a while.
    pub(crate) fn end(self, late: Option<LateFrames>) -> Option<Alarm> {
        late.map(|late| self.alarm(late)).or(self.first)
    }

    fn alarm(&self, late: LateFrames) -> Alarm {
        Alarm::LateFrames {
            task: self.task.clone(),
            service: self.service.clone(),
            within_ns: self.schedule.follow_within_ns.unwrap_or_default(),
            late,
            remedy: self.remedy(late),
        }
    }

    fn remedy(&self, late: LateFrames) -> String {
        if !late.alternate {
            return catch(&self.schedule, late)
                .unwrap_or_else(|| WarningCode::LateFrames.remedy().to_owned());
        }
        // Neither a phase nor a time catches what the task itself holds up.
        let plain = "if the task and its source follow each other, let one of them be a plain task";
        let Some(priority) = self.priority else { return plain.to_owned() };
        let above = priority.saturating_add(1).min(99);
        format!(
            "if the task keeps its source from running, give that a higher priority (chrt -f {above} for a \
             publisher) or another CPU; {plain}"
        )
    }
}

/// The configuration with which the frames would come in time, if there is one.
fn catch(schedule: &Schedule, late: LateFrames) -> Option<String> {
    let period_ns = schedule.period_ns.max(1);
    let step_ns = round_ns(period_ns / 20);
    let within_ns = (late.p99_ns + step_ns / 2).next_multiple_of(step_ns);
    // A real-time task may not watch for nearly all of its period.
    let longest_ns = (period_ns - period_ns / 10).saturating_sub(schedule.longest_watch_ns());
    let phase_ns = (schedule.phase_ns + late.median_ns) % period_ns / step_ns * step_ns;
    let written = |key: &str, ns: u64| format!("{key} = \"{}\"", format_duration_ns(ns));
    let longer = (within_ns <= longest_ns).then(|| written("within", within_ns));
    let later = (phase_ns != schedule.phase_ns).then(|| written("phase", phase_ns));
    // To wait longer takes more of a CPU.
    let ways: Vec<String> = later.into_iter().chain(longer).collect();
    (!ways.is_empty()).then(|| format!("write {} in its [[task]]", ways.join(" or ")))
}

/// The largest of 1, 2, 5, 10, 20 ns ... that is not above `ns`.
fn round_ns(ns: u64) -> u64 {
    let ten = 10_u64.pow(ns.checked_ilog10().unwrap_or_default());
    [5, 2].into_iter().map(|n| n * ten).find(|round_ns| *round_ns <= ns).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use isochrone_schedule::{Margin, Wake};
    use isochrone_timing::{CycleRecord, FollowRecord, Warning};

    use super::*;

    const US: u64 = 1_000;

    fn schedule(within_us: u64) -> Schedule {
        let follow_within_ns = Some(within_us * US);
        Schedule { follow_within_ns, ..Schedule::every(1_000 * US, Wake::Sleep) }
    }

    fn late(median_us: u64, p99_us: u64) -> LateFrames {
        let age_ns = (1_000 - median_us) * US;
        let (median_ns, p99_ns) = (median_us * US, p99_us * US);
        LateFrames { median_ns, p99_ns, age_ns, alternate: false }
    }

    fn followed(priority: Option<u8>) -> FollowedFrames {
        FollowedFrames::new("fast".into(), priority, "plant/saw".into(), schedule(300))
    }

    #[test]
    fn the_warning_says_when_the_frames_come_and_what_would_catch_them() {
        let alarm = followed(Some(80)).end(Some(late(601, 610))).unwrap();
        let Warning { code, message, remedy } = Warning::from(&alarm);
        assert_eq!(code, WarningCode::LateFrames);
        assert_eq!(
            message,
            "the frames of service \"plant/saw\" come 601 us after the releases of task \"fast\", which waits \
             300 us for them: each waits for the next release, 399 us at the median"
        );
        assert_eq!(remedy, "write phase = \"600us\" or within = \"650us\" in its [[task]]");
    }

    #[test]
    fn a_remedy_is_one_that_the_task_can_have() {
        let remedy = |schedule: &Schedule, late| catch(schedule, late).unwrap();
        let late_by = late(601, 900);
        assert_eq!(remedy(&schedule(300), late_by), "write phase = \"600us\" in its [[task]]");
        let hybrid = Wake::Hybrid(Margin::Fixed(300 * US));
        let margin = Schedule { wake: hybrid, phase_ns: 800 * US, ..schedule(300) };
        assert_eq!(remedy(&margin, late(601, 610)), "write phase = \"400us\" in its [[task]]");
        assert_eq!(remedy(&schedule(10), late(20, 20)), "write within = \"50us\" in its [[task]]");
        assert_eq!(catch(&schedule(10), late(20, 990)), None);
    }

    #[test]
    fn nobody_is_to_wait_longer_for_frames_that_come_late_because_they_are_waited_for() {
        let alternate = LateFrames { alternate: true, ..late(301, 310) };
        let remedy = |priority| followed(priority).remedy(alternate);
        assert!(remedy(Some(80)).contains("chrt -f 81") && remedy(Some(99)).contains("chrt -f 99"));
        assert!(!remedy(None).contains("chrt") && remedy(None).contains("plain task"));
    }

    /// Has a task run for so many seconds on frames that are so old at its releases; whether it says something new
    /// of them, and whether they are late then.
    fn run(
        followed: &mut FollowedFrames,
        seconds: u64,
        age_us: impl Fn(u64) -> Option<u64>,
    ) -> Option<bool> {
        let first = followed.until_ns / followed.schedule.period_ns;
        let mut changes = Vec::new();
        for cycle in first..first + seconds * 1_000 {
            let release_ns = cycle * followed.schedule.period_ns;
            let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
            let frame_ns = age_us(cycle - first).map(|age| release_ns.saturating_sub(age * US));
            let follow = FollowRecord { frame_ns, sent: cycle, ..FollowRecord::default() };
            followed.note(&Cycle { record, follow: Some(follow) });
            changes.extend(followed.judge());
        }
        changes.pop().map(|change| change.meaning.is_some())
    }

    #[test]
    fn frames_that_are_late_for_two_stretches_are_an_alarm_until_they_come_in_time_or_not_at_all() {
        let mut followed = followed(None);
        assert_eq!(run(&mut followed, 9, |_| Some(399)), None, "it is early to say");
        assert_eq!(run(&mut followed, 2, |_| Some(399)), Some(true));
        assert_eq!(run(&mut followed, 20, |_| Some(410)), None, "that is known");
        assert_eq!(run(&mut followed, 20, |_| Some(500)), Some(true), "that is news");
        assert_eq!(run(&mut followed, 10, |_| Some(0)), Some(false));
        assert_eq!(run(&mut followed, 20, |_| Some(399)), Some(true));
        assert_eq!(run(&mut followed, 11, |_| None), Some(false), "the source has stopped");
        let held_up = |cycle: u64| cycle.is_multiple_of(2).then_some(300 + cycle % 400);
        assert_eq!(run(&mut followed, 21, held_up), Some(true), "whenever those come");
        let said = followed.end(None).unwrap();
        assert!(said.to_string().contains("come 601 us after"), "the first is kept: {said}");
    }

    #[test]
    fn a_slow_source_takes_longer_to_judge() {
        let mut followed = followed(None);
        let once_a_second = |cycle: u64| cycle.is_multiple_of(1_000).then_some(399);
        assert_eq!(run(&mut followed, 30, once_a_second), None);
        assert_eq!(run(&mut followed, 30, once_a_second), Some(true));
        let the_last = |cycle: u64| (cycle < 10_000).then(|| once_a_second(cycle)).flatten();
        assert_eq!(run(&mut followed, 50, the_last), None);
        assert_eq!(run(&mut followed, 30, |_| None), Some(false), "no more come");
    }

    #[test]
    fn a_source_that_drifts_through_the_grid_is_no_alarm_while_it_is_late() {
        let mut followed = followed(None);
        // Seven microseconds a second, through what counts as late and on.
        assert_eq!(run(&mut followed, 90, |cycle| Some(700 - cycle * 7 / 1_000)), None);
    }
}
