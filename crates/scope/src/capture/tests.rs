use proptest::prelude::*;

use super::*;
use crate::{Comparator, Condition};

const MS: u64 = 1_000_000;

fn observed(task: &str, period_ns: u64) -> ObservedTask {
    let signal = TrackSignal { name: format!("{task}.y"), ..TrackSignal::default() };
    ObservedTask { task: task.into(), period_ns: Some(period_ns), signals: vec![signal] }
}

fn above_one() -> Edge {
    Edge::new(Condition::Compare(Comparator::Greater, 1.0))
}

fn capture(window: Window) -> Capture {
    Capture::armed("n", vec![observed("t", MS)], window, (0, 0), ("x", "x > 1"), above_one())
}

const WINDOW: Window = Window { before_ns: 20 * MS, after_ns: 100 * MS };

/// Pushes cycle by cycle until there is a shot, with 2.0 in the cycles that `is_high` names.
fn shots(capture: &mut Capture, cycles: u64, is_high: impl Fn(u64) -> bool) -> Vec<Shot> {
    let mut shots = Vec::new();
    for cycle in 0..cycles {
        let head = Head { cycle, release_ns: (1_000 + cycle) * MS, ..Head::default() };
        if capture.push(0, head, &[if is_high(cycle) { 2.0 } else { 0.0 }]) {
            shots.extend(capture.take());
        }
    }
    shots
}

fn cycles(shot: &Shot) -> Vec<u64> {
    shot.tracks[0].rows.heads().map(|head| head.cycle).collect()
}

#[test]
fn a_shot_has_the_cycles_before_the_trigger_and_those_from_it_on_and_no_others() {
    let shots = shots(&mut capture(WINDOW), 300, |cycle| cycle == 57);
    assert_eq!(shots.len(), 1);
    assert_eq!(cycles(&shots[0]), (37..157).collect::<Vec<_>>());
    let trigger = shots[0].trigger.as_ref().unwrap();
    assert_eq!((trigger.cycle, trigger.release_ns), (57, 1_057 * MS));
    assert_eq!(shots[0].shortened_ns(), (0, 0));
}

#[test]
fn a_trigger_that_comes_early_has_a_shorter_history_and_is_not_passed_over() {
    let shots = shots(&mut capture(WINDOW), 200, |cycle| cycle == 5);
    assert_eq!(cycles(&shots[0]), (0..105).collect::<Vec<_>>());
    assert_eq!(shots[0].shortened_ns(), (15 * MS, 0));
}

#[test]
fn after_a_shot_it_waits_for_the_next_trigger_whose_history_may_be_in_the_shot_before() {
    let high = |cycle: u64| [50, 60, 155, 400].contains(&cycle);
    let shots = shots(&mut capture(WINDOW), 520, high);
    let triggers: Vec<u64> =
        shots.iter().map(|shot| shot.trigger.as_ref().unwrap().cycle).collect();
    assert_eq!(triggers, [50, 155, 400]);
    assert_eq!(cycles(&shots[1]), (135..255).collect::<Vec<_>>());
}

#[test]
fn without_a_trigger_it_begins_with_the_first_row() {
    let mut capture = Capture::now("n", vec![observed("t", MS)], 10 * MS);
    let shots = shots(&mut capture, 25, |_| false);
    assert_eq!(cycles(&shots[0]), (0..10).collect::<Vec<_>>());
    assert_eq!(cycles(&shots[1]), (10..20).collect::<Vec<_>>());
    assert_eq!(shots[0].trigger, None);
}

#[test]
fn what_ends_early_gives_what_there_is() {
    let mut capture = capture(WINDOW);
    assert!(shots(&mut capture, 100, |cycle| cycle == 57).is_empty());
    assert!(capture.is_triggered());
    let shot = capture.take().unwrap();
    assert_eq!((cycles(&shot).len(), shot.shortened_ns()), (63, (0, 57 * MS)));
    assert_eq!(capture.take(), None);
    let seen = Some(Extremes { low: 0.0, high: 2.0 });
    assert_eq!(capture.looked(), TriggerSearch { cycles: 100, lost: 0, seen });
    assert_eq!(cycles(&capture.latest()).len(), 100);
}

#[test]
fn the_signal_of_the_trigger_need_not_be_shown() {
    let hidden = ObservedTask { signals: Vec::new(), ..observed("slow", 10 * MS) };
    let tasks = vec![observed("fast", MS), hidden];
    let mut capture = Capture::armed("n", tasks, WINDOW, (1, 0), ("x", ""), above_one());
    let mut shot = None;
    for cycle in 0..400 {
        let head = Head { cycle, release_ns: (1_000 + cycle) * MS, ..Head::default() };
        let mut is_there = capture.push(0, head, &[0.0]);
        if cycle % 10 == 0 {
            let head = Head { cycle: cycle / 10, ..head };
            is_there |= capture.push(1, head, &[if cycle == 150 { 2.0 } else { 0.0 }]);
        }
        if is_there {
            shot = shot.or(capture.take());
        }
    }
    let shot = shot.unwrap();
    assert_eq!((shot.tracks.len(), shot.trigger.as_ref().unwrap().cycle), (1, 15));
    assert_eq!(cycles(&shot), (130..250).collect::<Vec<_>>());
}

#[test]
fn hours_of_waiting_keep_no_more_than_the_window() {
    let mut capture = capture(WINDOW);
    assert!(shots(&mut capture, 1_000_000, |_| false).is_empty());
    assert!(capture.tracks[0].rows.len() <= 125, "{}", capture.tracks[0].rows.len());
    // A task that goes on while that of the trigger stands still is bounded as well.
    let tasks = vec![observed("a", MS), observed("b", MS)];
    let mut capture = Capture::armed("n", tasks, WINDOW, (0, 0), ("x", ""), above_one());
    shots(&mut capture, 1, |_| false);
    for cycle in 0..100_000 {
        capture.push(1, Head { cycle, release_ns: cycle * MS, ..Head::default() }, &[0.0]);
    }
    assert!(capture.tracks[1].rows.len() as u64 <= WINDOW.rows(MS));
}

proptest! {
    /// Two tasks of any periods, whose rows come in bursts of any length.
    #[test]
    fn a_shot_does_not_depend_on_which_task_is_read_first(
        periods in (1u64..8, 1u64..8),
        phases in (0u64..8, 0u64..8),
        trigger_cycle in 2u64..300,
        bursts in prop::collection::vec(1usize..60, 200),
    ) {
        let (before_ns, after_ns) = (40 * MS, 90 * MS);
        let tasks = vec![observed("a", periods.0 * MS), observed("b", periods.1 * MS)];
        let window = Window { before_ns, after_ns };
        let mut capture = Capture::armed("n", tasks, window, (0, 0), ("x", ""), above_one());
        let row = |track: u64, cycle: u64| {
            let (period, phase) =
                if track == 0 { (periods.0, phases.0) } else { (periods.1, phases.1) };
            let release_ns = (1_000 + phase + cycle * period) * MS;
            let value = if track == 0 && cycle >= trigger_cycle { 2.0 } else { 0.0 };
            (Head { cycle, release_ns, ..Head::default() }, value)
        };
        let mut next = [0u64; 2];
        let mut shot = None;
        for (turn, burst) in bursts.iter().enumerate() {
            let track = turn % 2;
            for _ in 0..*burst {
                let (head, value) = row(track as u64, next[track]);
                next[track] += 1;
                // No task runs far ahead of the other one.
                let other = row(1 - track as u64, next[1 - track]).0.release_ns;
                if head.release_ns > other + 3_000 * MS {
                    next[track] -= 1;
                    break;
                }
                if capture.push(track, head, &[value]) && shot.is_none() {
                    shot = capture.take();
                }
            }
        }
        if let Some(shot) = shot {
            let at_ns = row(0, trigger_cycle).0.release_ns;
            prop_assert_eq!(shot.trigger.as_ref().unwrap().cycle, trigger_cycle);
            for (track, of) in shot.tracks.iter().enumerate() {
                let half_ns = of.period_ns.unwrap() / 2;
                let expected: Vec<u64> = (0..3_000)
                    .filter(|cycle| {
                        let at = row(track as u64, *cycle).0.release_ns + half_ns;
                        (at_ns - before_ns..at_ns + after_ns).contains(&at)
                    })
                    .collect();
                let found: Vec<u64> = of.rows.heads().map(|head| head.cycle).collect();
                prop_assert_eq!(found, expected);
            }
        }
    }
}
