//! Frames that come after the cycles that follow them gave up: while the node runs, and in its report.

use isochrone_engine::format_duration_ns;
use isochrone_ipc::ListedNode;
use isochrone_schedule::Schedule;
use isochrone_timing::{Arrivals, InVain, LateFrames, Punctuality, WarningCode};

use crate::alarms::Alarm;
use crate::lasting::{Lasting, StateChange};
use crate::records::Cycle;
use crate::sources::Sources;

/// The stretch of a run by which it is judged when frames come: so long, and at least so many periods.
const STRETCH_NS: u64 = 5_000_000_000;
const STRETCH_PERIODS: u64 = 25;
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
    /// `publishers` tells who publishes a service.
    pub(crate) fn judge(
        &mut self,
        publishers: impl FnOnce(&str) -> Vec<ListedNode>,
    ) -> Vec<StateChange> {
        let stretch_ns = self.schedule.period_ns.saturating_mul(STRETCH_PERIODS).max(STRETCH_NS);
        let since_ns = self.since_ns.unwrap_or(self.until_ns);
        let passed_ns = self.until_ns.saturating_sub(since_ns);
        if passed_ns < stretch_ns {
            return Vec::new();
        }
        match self.arrivals.punctuality(self.schedule.period_ns) {
            Punctuality::TooFew if passed_ns / MOST_STRETCHES < stretch_ns => return Vec::new(),
            Punctuality::Late(late) => self.take_late(late, publishers),
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

    fn take_late(&mut self, late: LateFrames, publishers: impl FnOnce(&str) -> Vec<ListedNode>) {
        let is_near = |other: Option<LateFrames>, part: u64| {
            let apart_ns = other.map(|other| other.median_ns.abs_diff(late.median_ns));
            apart_ns.is_some_and(|apart_ns| apart_ns <= self.schedule.period_ns / part)
        };
        let before = self.before.replace(late);
        // What comes now in time and now too late has no certain time.
        let is_like = |other: Option<LateFrames>, part: u64| match (late.in_vain, other) {
            (Some(_), Some(other)) => other.in_vain.is_some(),
            _ => is_near(other.filter(|other| other.in_vain.is_none()), part),
        };
        if !is_like(before, STEADY) || is_like(self.told, NEWS) {
            return;
        }
        let alarm = self.alarm(late, publishers);
        if self.lasting.begin(&alarm) {
            tracing::warn!("{}", alarm.sentence());
        }
        self.told = Some(late);
        self.first.get_or_insert(alarm);
    }

    /// What the report says, if frames were late over the whole run, or for a while.
    pub(crate) fn end(
        self,
        late: Option<LateFrames>,
        publishers: impl FnOnce(&str) -> Vec<ListedNode>,
    ) -> Option<Alarm> {
        late.map(|late| self.alarm(late, publishers)).or(self.first)
    }

    fn alarm(&self, late: LateFrames, publishers: impl FnOnce(&str) -> Vec<ListedNode>) -> Alarm {
        let sources = Sources::of(publishers(&self.service));
        Alarm::LateFrames {
            task: self.task.clone(),
            service: self.service.clone(),
            within_ns: self.schedule.follow_within_ns.unwrap_or_default(),
            late,
            remedy: self.remedy(late, &sources),
            sources: sources.nodes,
        }
    }

    fn remedy(&self, late: LateFrames, sources: &Sources) -> String {
        let catch = || {
            catch(&self.schedule, late)
                .unwrap_or_else(|| WarningCode::LateFrames.remedy().to_owned())
        };
        let Some(InVain { scattered, .. }) = late.in_vain else { return catch() };
        let mut ways = Vec::new();
        // Neither a phase nor a time catches what the task itself holds up.
        let may_wait = sources.may_wait_for(self.priority);
        if let Some(priority) = self.priority.filter(|_| may_wait) {
            ways.push(make_way(priority, sources));
        }
        if sources.may_be_control_nodes() {
            ways.push(
                "if the task and its source follow each other, let one of them be a plain task"
                    .to_owned(),
            );
        }
        if scattered {
            ways.push(
                "if the source is off the grid, align it with the releases of the task, as docs/wire.md says \
                 (The grid)"
                    .to_owned(),
            );
        } else if !may_wait {
            ways.push(catch());
        }
        ways.join("; ")
    }
}

/// How the source gets the CPU on which a task of this priority watches for it.
fn make_way(priority: u8, sources: &Sources) -> String {
    if sources.may_be_control_nodes() {
        return "if the task keeps its source from running, give the task a lower priority than its source has, or \
                another CPU"
            .to_owned();
    }
    let above = priority.saturating_add(1).min(99);
    let commands = sources.nodes.iter().map(|node| format!("chrt -f -p {above} {}", node.pid));
    let commands = commands.collect::<Vec<_>>().join(", ");
    format!(
        "if the task keeps its source from running, give that a higher priority ({commands}) or another CPU"
    )
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
        LateFrames { median_ns, p99_ns, age_ns, in_vain: None }
    }

    fn followed(priority: Option<u8>) -> FollowedFrames {
        FollowedFrames::new("fast".into(), priority, "plant/saw".into(), schedule(300))
    }

    #[test]
    fn the_warning_says_when_the_frames_come_and_what_would_catch_them() {
        let alarm = followed(Some(80)).end(Some(late(601, 610)), |_| Vec::new()).unwrap();
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
    fn cycles_that_time_out_in_vain_name_the_source_and_what_may_keep_it() {
        let in_vain = |scattered| {
            let in_vain = Some(InVain { timed_out: 930, cycles: 2409, scattered });
            LateFrames { in_vain, ..late(301, 310) }
        };
        let node = |name: &str| ListedNode {
            name: name.into(),
            pid: 4_000_001,
            program: "python3".into(),
        };
        let said = |priority, node: &ListedNode, scattered| {
            let nodes = vec![node.clone()];
            let alarm = followed(priority).end(Some(in_vain(scattered)), |_| nodes).unwrap();
            let Warning { message, remedy, .. } = Warning::from(&alarm);
            assert_eq!(
                message,
                format!(
                    "930 of 2409 cycles of task \"fast\" timed out although frames of service \"plant/saw\" \
                     were sent for them: {node} sends now within the 300 us for which the task waits, and now \
                     later"
                )
            );
            remedy
        };
        let sensor = node("");
        let starved = said(Some(80), &sensor, false);
        assert!(starved.contains("(chrt -f -p 81 4000001) or another CPU"), "{starved}");
        assert!(!starved.contains("within") && !starved.contains("grid"), "{starved}");
        assert!(said(Some(99), &sensor, false).contains("chrt -f -p 99 "));
        assert!(said(Some(80), &sensor, true).contains("chrt -f -p 81"));
        let off_grid = said(None, &sensor, true);
        assert!(off_grid.starts_with("if the source is off the grid, align it"), "{off_grid}");
        let at_the_edge = said(None, &sensor, false);
        assert_eq!(at_the_edge, "write phase = \"300us\" or within = \"350us\" in its [[task]]");
        let of_node = said(Some(80), &node("isochrone/plant"), false);
        assert!(
            of_node.contains("a lower priority than its source") && !of_node.contains("chrt"),
            "{of_node}"
        );
        assert!(of_node.contains("follow each other"), "{of_node}");
    }

    /// How a cycle begins.
    #[derive(Clone, Copy)]
    enum Begins {
        /// With a frame that is so old at the release, in us; below 0 it comes after that.
        With(i64),
        /// Without one, though one was sent for it.
        InVain,
        /// Without one, as none was sent.
        Without,
    }
    use Begins::{InVain as Vain, With, Without};

    struct Run {
        followed: FollowedFrames,
        counts: FollowRecord,
    }

    impl Run {
        fn of(followed: FollowedFrames) -> Self {
            Self { followed, counts: FollowRecord::default() }
        }

        /// Goes on for so many seconds; whether it says something new of the frames, and whether they are late
        /// then.
        fn on(&mut self, seconds: u64, begins: impl Fn(u64) -> Begins) -> Option<bool> {
            let period_ns = self.followed.schedule.period_ns;
            let first = self.followed.until_ns / period_ns + 1;
            let mut changes = Vec::new();
            for cycle in first..first + seconds * 1_000_000_000 / period_ns {
                let release_ns = cycle * period_ns;
                let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
                let begins = begins(cycle - first);
                self.counts.sent += u64::from(!matches!(begins, Without));
                self.counts.timed_out += u64::from(!matches!(begins, With(_)));
                let frame_ns = match begins {
                    With(age_us) => Some(release_ns.wrapping_add_signed(-age_us * 1_000)),
                    Vain | Without => None,
                };
                let follow = FollowRecord { frame_ns, ..self.counts };
                self.followed.note(&Cycle { record, follow: Some(follow) });
                changes.extend(self.followed.judge(|_| Vec::new()));
            }
            changes.pop().map(|change| change.meaning.is_some())
        }
    }

    #[test]
    fn frames_that_are_late_for_two_stretches_are_an_alarm_until_they_come_in_time_or_not_at_all() {
        let mut run = Run::of(followed(None));
        assert_eq!(run.on(9, |_| With(399)), None, "it is early to say");
        assert_eq!(run.on(2, |_| With(399)), Some(true));
        assert_eq!(run.on(20, |_| With(410)), None, "that is known");
        assert_eq!(run.on(20, |_| With(500)), Some(true), "that is news");
        assert_eq!(run.on(10, |_| With(0)), Some(false));
        assert_eq!(run.on(20, |_| With(399)), Some(true));
        assert_eq!(run.on(11, |_| Without), Some(false), "the source has stopped");
        let held_up = |cycle: u64| {
            if cycle.is_multiple_of(2) { With(300 + cycle as i64 % 400) } else { Vain }
        };
        assert_eq!(run.on(21, held_up), Some(true), "whenever those come");
        let said = run.followed.end(None, |_| Vec::new()).unwrap();
        assert!(said.to_string().contains("come 601 us after"), "the first is kept: {said}");
    }

    #[test]
    fn more_than_one_cycle_in_ten_that_times_out_in_vain_is_an_alarm_whatever_the_pattern() {
        let starved_at_times = |cycle: u64| match cycle % 13 {
            0 | 2 | 4 | 6 | 8 => Vain,
            1 | 3 | 5 | 7 | 9 => With(699),
            _ => With(-20),
        };
        let in_turns = |cycle: u64| match cycle % 1_000 {
            ..150 => Vain,
            150..300 => With(650),
            _ => With(-20),
        };
        let every_eighth = |cycle: u64| if cycle.is_multiple_of(8) { Vain } else { With(-20) };
        let every_fifteenth = |cycle: u64| if cycle.is_multiple_of(15) { Vain } else { With(-20) };
        let slower = |cycle: u64| if cycle.is_multiple_of(2) { Without } else { With(-20) };
        let patterns: [(&dyn Fn(u64) -> Begins, _); 5] = [
            (&starved_at_times, Some(true)),
            (&in_turns, Some(true)),
            (&every_eighth, Some(true)),
            (&every_fifteenth, None),
            (&slower, None),
        ];
        for (index, (begins, expected)) in patterns.into_iter().enumerate() {
            let mut run = Run::of(followed(Some(80)));
            assert_eq!(run.on(11, begins), expected, "{index}");
            let over = expected.map(|_| false);
            assert_eq!(run.on(20, |_| With(-20)), over, "{index}");
        }
    }

    #[test]
    fn frames_that_come_around_the_end_of_the_wait_of_a_slow_task_are_an_alarm_soon() {
        let schedule = Schedule {
            follow_within_ns: Some(80_000 * US),
            phase_ns: 40_000 * US,
            ..Schedule::every(200_000 * US, Wake::Sleep)
        };
        let mut run =
            Run::of(FollowedFrames::new("slow".into(), None, "plant/saw".into(), schedule));
        let around = |cycle: u64| match cycle % 4 {
            0 => With(-79_900),
            1 => Vain,
            _ => With(119_950),
        };
        assert_eq!(run.on(11, around), Some(true));
        let remedy = run.followed.end(None, |_| Vec::new()).unwrap().remedy();
        let catch = "write phase = \"120ms\" or within = \"90ms\" in its [[task]]";
        assert!(remedy.ends_with(catch), "{remedy}");
    }

    #[test]
    fn a_slow_source_takes_longer_to_judge() {
        let mut run = Run::of(followed(None));
        let once_a_second =
            |cycle: u64| if cycle.is_multiple_of(1_000) { With(399) } else { Without };
        assert_eq!(run.on(30, once_a_second), None);
        assert_eq!(run.on(30, once_a_second), Some(true));
        let the_last = |cycle: u64| if cycle < 10_000 { once_a_second(cycle) } else { Without };
        assert_eq!(run.on(50, the_last), None);
        assert_eq!(run.on(30, |_| Without), Some(false), "no more come");
    }

    #[test]
    fn a_source_that_drifts_through_the_grid_is_no_alarm_while_it_is_late() {
        let mut run = Run::of(followed(None));
        // Seven microseconds a second, through what counts as late and on.
        assert_eq!(run.on(90, |cycle| With(700 - cycle as i64 * 7 / 1_000)), None);
    }
}
