//! Wires between tasks: the values of the producer's last finished cycle, all of the same one.

use crate::two_tasks;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use crate::two_tasks::{TASKS, engines_with, input, output, plan_of};
use isochrone_engine::TaskEngine;

/// A ScaleLinear that adds 1 to what its wire brings.
fn plus_1(name: &str, task: &str, wire: &str) -> String {
    format!(
        "[[block]]\nname = \"{name}\"\ntype = \"ScaleLinear\"\ntask = \"{task}\"\n\
         in = {{ x = \"{wire}\", x1 = 0.0, y1 = 1.0, x2 = 1.0, y2 = 2.0, yMin = -inf, yMax = inf }}\n"
    )
}

fn frame<const N: usize>(engine: &TaskEngine, output: usize) -> [f64; N] {
    let mut frame = [f64::NAN; N];
    engine.read_output(output, &mut frame);
    frame
}

#[test]
fn a_wire_between_tasks_carries_the_value_of_the_producers_last_finished_cycle() {
    let (mut fast, mut slow) = engines_with(
        &(plus_1("counter", "fast", "counter.y@prev")
            + &plus_1("reader", "slow", "counter.y")
            + &output("slow", &["reader.y", "counter.y"])),
    );
    slow.step(0);
    assert_eq!(frame(&slow, 0), [1.0, 0.0], "nothing is finished yet");
    for cycle in 0..3 {
        fast.step(cycle);
    }
    assert_eq!(frame(&slow, 0), [1.0, 0.0], "a value comes with the reader's cycle");
    slow.step(1);
    assert_eq!(frame(&slow, 0), [4.0, 3.0]);
    slow.step(2);
    assert_eq!(frame(&slow, 0), [4.0, 3.0], "the producer has not stepped again");
}

#[test]
fn the_cycle_before_of_another_task_is_its_last_finished_cycle_too() {
    let (mut fast, mut slow) = engines_with(
        &(plus_1("counter", "fast", "counter.y@prev")
            + &plus_1("reader", "slow", "counter.y@prev")
            + &output("slow", &["reader.y"])),
    );
    fast.step(0);
    slow.step(0);
    assert_eq!(frame(&slow, 0), [2.0]);
}

#[test]
fn tasks_may_read_each_other() {
    let (mut fast, mut slow) = engines_with(
        &(plus_1("a", "fast", "b.y")
            + &plus_1("b", "slow", "a.y")
            + &output("slow", &["b.y", "a.y"])),
    );
    for cycle in 0..3 {
        fast.step(cycle);
        slow.step(cycle);
    }
    assert_eq!(frame(&slow, 0), [6.0, 5.0]);
}

#[test]
fn an_input_of_another_task_reads_its_default_until_that_task_has_run() {
    let (mut fast, mut slow) = engines_with(
        &(input("x", "fast")
            + "default = 7.0\n"
            + &plus_1("reader", "slow", "x")
            + &output("slow", &["reader.y", "x"])),
    );
    slow.step(0);
    assert_eq!(frame(&slow, 0), [8.0, 7.0]);
    fast.set_input(0, 1.0, 5);
    slow.step(1);
    assert_eq!(frame(&slow, 0), [8.0, 7.0], "the cycle that took the sample is not finished");
    fast.step(0);
    slow.step(2);
    assert_eq!((frame(&slow, 0), slow.output_source_ns(0)), ([2.0, 1.0], 5));
}

#[test]
fn the_source_time_goes_through_tasks_for_each_value_on_its_own() {
    let (mut fast, mut slow) = engines_with(
        &(input("old", "fast")
            + &input("young", "fast")
            + &input("own", "slow")
            + &plus_1("a", "fast", "old")
            + &plus_1("b", "fast", "young")
            + &plus_1("c", "slow", "b.y")
            + &plus_1("d", "slow", "own")
            + &output("slow", &["a.y"])
            + &output("slow", &["c.y"])
            + &output("slow", &["d.y"])
            + &output("slow", &["c.y", "d.y"])),
    );
    fast.set_input(0, 1.0, 10);
    fast.set_input(1, 1.0, 30);
    slow.set_input(0, 1.0, 20);
    fast.step(0);
    slow.step(0);
    let times: Vec<u64> = (0..4).map(|output| slow.output_source_ns(output)).collect();
    assert_eq!(times, [10, 30, 20, 20]);
}

#[test]
fn the_source_time_goes_through_tasks_that_only_pass_a_value_on() {
    let (mut fast, mut slow) = engines_with(
        &(input("x", "fast")
            + &plus_1("a", "slow", "x")
            + &plus_1("b", "fast", "a.y")
            + &output("fast", &["b.y"])),
    );
    fast.set_input(0, 1.0, 10);
    for cycle in 0..2 {
        fast.step(cycle);
        slow.step(cycle);
    }
    assert_eq!((frame(&fast, 0), fast.output_source_ns(0)), ([3.0], 10));
}

#[test]
fn call_ob_names_the_period_of_another_task() {
    let (mut fast, mut slow) = engines_with(
        &("[[block]]\nname = \"r\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
          in = { value = 100.0, setChangeRate = 10.0, callOB = 31 }\n"
            .to_string()
            + &output("fast", &["r.delayedValue", "r.status"])),
    );
    slow.step(0);
    fast.step(0);
    assert_eq!(frame(&fast, 0), [0.1, 0.0]);
}

#[test]
fn call_ob_names_a_task_by_its_name_with_or_without_a_number() {
    for (task, step) in [("fast", 0.01), ("slow", 0.1)] {
        for number in ["ob = 31\n", ""] {
            let text = format!(
                "[[block]]\nname = \"r\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
                 in = {{ value = 100.0, setChangeRate = 10.0, callOB = \"{task}\" }}\n"
            ) + &output("fast", &["r.delayedValue", "r.status"]);
            let (mut fast, _) =
                two_tasks::engines(&plan_of(&TASKS.replace("ob = 31\n", number), &text));
            fast.step(0);
            assert_eq!(frame(&fast, 0), [step, 0.0], "{task} {number}");
        }
    }
}

#[test]
fn all_values_of_one_cycle_come_from_one_cycle_of_the_producer_while_both_run() {
    const CYCLES: u64 = 20_000;
    // Many blocks between the two counters, so that a torn copy would be seen.
    let mut text = plus_1("first", "fast", "first.y@prev");
    for index in 0..64 {
        text += &plus_1(&format!("between{index}"), "fast", "first.y");
    }
    text += &plus_1("last", "fast", "last.y@prev");
    let mut signals = vec!["first.y".to_string(), "last.y".to_string()];
    signals.extend((0..64).map(|index| format!("between{index}.y")));
    let signals: Vec<&str> = signals.iter().map(String::as_str).collect();
    let (mut fast, mut slow) = engines_with(&(text + &output("slow", &signals)));

    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            for cycle in 0..CYCLES {
                fast.step(cycle);
            }
            done.store(true, Ordering::Release);
        });
        let (mut newest, mut cycle) = (0.0, 0);
        loop {
            let last_round = done.load(Ordering::Acquire);
            slow.step(cycle);
            cycle += 1;
            let values: [f64; 66] = frame(&slow, 0);
            assert_eq!(values[0], values[1], "of different cycles");
            assert!(values[2..].iter().all(|value| *value == values[0] + 1.0 || values[0] == 0.0));
            assert!(values[0] >= newest, "an older cycle after a newer one");
            newest = values[0];
            if last_round {
                break;
            }
        }
        assert_eq!(newest, CYCLES as f64, "the last finished cycle is seen");
    });
}

#[test]
fn an_automatic_phase_keeps_the_releases_away_from_the_ticks_at_whole_milliseconds() {
    for (period_ns, period, furthest_ns) in [
        (1_000_000, "1ms", 500_000),
        (10_000_000, "10ms", 500_000),
        (500_000, "500us", 250_000),
        (250_000, "250us", 125_000),
        (100_000, "100us", 50_000),
        (750_000, "750us", 125_000),
        (1_250_000, "1.25ms", 125_000),
        (1_500_000, "1.5ms", 250_000),
        (2_500_000, "2.5ms", 250_000),
        (1_001_000, "1001us", 500),
    ] {
        let text = format!(
            "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"{period}\"\nphase = \"auto\"\n"
        );
        let phase_ns = plan_of("", &text).tasks[0].settings.phase_ns;
        assert!(phase_ns < period_ns, "{period}");
        let behind_tick_ns = (isochrone_model::EPOCH_OFFSET_NS + phase_ns) % 1_000_000;
        for release in 0..2_000 {
            let since_tick_ns = (behind_tick_ns + release * period_ns) % 1_000_000;
            let distance_ns = since_tick_ns.min(1_000_000 - since_tick_ns);
            assert!(distance_ns >= furthest_ns, "{period}: {distance_ns}");
        }
    }
}
