use isochrone_model::{Margin, Wake};
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

fn following(task: &str, priority: Option<u8>, schedule: Schedule) -> FollowedFrames {
    let (task, service) = (task.into(), "plant/saw".into());
    let (sources, history) = (Sources::default(), ArrivalHistory::default());
    FollowedFrames { task, priority, schedule, service, sources, asks: false, due: None, history }
}

fn followed(priority: Option<u8>) -> FollowedFrames {
    following("fast", priority, schedule(300))
}

#[test]
fn the_warning_says_when_the_frames_come_and_what_would_catch_them() {
    let alarm = followed(Some(80)).alarm(late(601, 610));
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
    let node =
        |name: &str| ListedNode { name: name.into(), pid: 4_000_001, program: "python3".into() };
    let said = |priority, node: &ListedNode, scattered| {
        let mut followed = followed(priority);
        followed.look_up(|_| Some(vec![node.clone()]));
        let Warning { message, remedy, .. } = Warning::from(&followed.alarm(in_vain(scattered)));
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
    assert!(starved.contains("(chrt -a -f -p 81 4000001) or another CPU"), "{starved}");
    assert!(!starved.contains("within") && !starved.contains("grid"), "{starved}");
    let highest = said(Some(99), &sensor, false);
    let way = "a priority below 99 and its source a higher one (chrt -a -f -p 99 4000001) or";
    assert!(highest.contains(way), "{highest}");
    assert!(said(Some(80), &sensor, true).contains("chrt -a -f -p 81"));
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
    let mut left = followed(Some(80));
    left.look_up(|_| Some(vec![sensor.clone()]));
    left.look_up(|_| Some(Vec::new()));
    let remedy = left.alarm(in_vain(false)).remedy();
    assert_eq!(remedy, starved, "a source that has ended is known yet");
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
    /// Who answers for the publishers; `None`: the domain is busy.
    answer: Option<Vec<ListedNode>>,
    /// The alarms so far, as they were raised.
    raised: Vec<String>,
}

impl Run {
    fn of(followed: FollowedFrames) -> Self {
        let (counts, raised) = (FollowRecord::default(), Vec::new());
        Self { followed, counts, answer: Some(Vec::new()), raised }
    }

    /// Goes on for so many seconds; whether it says something new of the frames, and whether they are late
    /// then.
    fn on(&mut self, seconds: u64, begins: impl Fn(u64) -> Begins) -> Option<bool> {
        let period_ns = self.followed.schedule.period_ns;
        let first = self.followed.history.until_ns / period_ns + 1;
        let mut changes = Vec::new();
        for cycle in first..first + seconds * 1_000_000_000 / period_ns {
            let release_ns = cycle * period_ns;
            let record = CycleRecord { cycle, release_ns, ..CycleRecord::default() };
            let begins = begins(cycle - first);
            self.counts.sent += u64::from(!matches!(begins, Without));
            self.counts.begun.timed_out += u64::from(!matches!(begins, With(_)));
            let frame_ns = match begins {
                With(age_us) => Some(release_ns.wrapping_add_signed(-age_us * 1_000)),
                Vain | Without => None,
            };
            let follow = FollowRecord { frame_ns, ..self.counts };
            self.followed.note(&Cycle { record, follow: Some(follow) });
            changes.extend(self.followed.judge(|_| self.answer.clone()));
        }
        self.raised.extend(changes.iter().filter_map(|change| change.meaning.clone()));
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
    let held_up =
        |cycle: u64| if cycle.is_multiple_of(2) { With(300 + cycle as i64 % 400) } else { Vain };
    assert_eq!(run.on(21, held_up), Some(true), "whenever those come");
    let said = run.followed.end(|_| Some(Vec::new())).unwrap();
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
    let mut run = Run::of(following("slow", None, schedule));
    let around = |cycle: u64| match cycle % 4 {
        0 => With(-79_900),
        1 => Vain,
        _ => With(119_950),
    };
    // A second of warm-up, and two stretches of 25 periods.
    assert_eq!(run.on(12, around), Some(true));
    let remedy = run.followed.end(|_| Some(Vec::new())).unwrap().remedy();
    let catch = "write phase = \"120ms\" or within = \"90ms\" in its [[task]]";
    assert!(remedy.ends_with(catch), "{remedy}");
}

#[test]
fn a_slow_source_takes_longer_to_judge() {
    let mut run = Run::of(followed(None));
    let once_a_second = |cycle: u64| if cycle.is_multiple_of(1_000) { With(399) } else { Without };
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

#[test]
fn who_sends_late_frames_is_asked_until_it_is_known() {
    let sensor = ListedNode { name: "".into(), pid: 4_000_001, program: "python3".into() };
    let starved = |cycle: u64| if cycle.is_multiple_of(2) { Vain } else { With(699) };
    let names = |said: &String| {
        let parts = [&format!("{sensor} sends now within"), "chrt -a -f -p 81 4000001"];
        parts.map(|part| said.contains(part))
    };
    let mut run = Run::of(followed(Some(80)));
    run.answer = None;
    assert_eq!(run.on(12, starved), None, "the alarm waits for the answer");
    run.answer = Some(vec![sensor.clone()]);
    assert_eq!(run.on(1, starved), Some(true));
    assert_eq!(run.raised.iter().map(names).collect::<Vec<_>>(), [[true; 2]], "{:?}", run.raised);

    let mut run = Run::of(followed(Some(80)));
    run.answer = None;
    assert_eq!(run.on(40, starved), Some(true), "nor for ever");
    run.answer = Some(vec![sensor.clone()]);
    assert_eq!(run.on(1, starved), Some(true), "that it has come is news");
    let named = run.raised.iter().map(names).collect::<Vec<_>>();
    assert_eq!(named, [[false; 2], [true; 2]], "{:?}", run.raised);
    assert_eq!(run.on(20, starved), None);

    let mut run = Run::of(followed(Some(80)));
    run.answer = None;
    assert_eq!(run.on(11, starved), None);
    assert_eq!(run.on(20, |_| With(-20)), None, "it is over before anybody was told");
    run.answer = Some(vec![sensor.clone()]);
    assert_eq!(run.on(4, starved), None);
}
