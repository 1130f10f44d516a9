//! `simulate` with several tasks: what is due when, and which values it sees.
//!
//! A sawtooth counts the cycles of each task: `fast` from 100, `slow` from 10. A ramp without a
//! limit in each task shows what it sees of the other. The numbers here are worked out by hand.

use isochrone_testing::{Domain, Plant, assert_says, cells};

fn counters() -> Plant {
    Plant::new("tasks")
        .task("fast", "1ms")
        .with("#FAST")
        .task("slow", "2ms")
        .with("#SLOW")
        .on("fast")
        .saw("f", "startValue = 100, incrementRange = 1, endlessSteps = true")
        .ramp("f_sees", "value = \"s.value\", setChangeRate = inf")
        .on("slow")
        .saw("s", "startValue = 10, incrementRange = 1, endlessSteps = true")
        .ramp("s_sees", "value = \"f.value\", setChangeRate = inf")
        .output("slow", &["s.value", "s_sees.delayedValue"])
        .on("fast")
        .output("fast", &["f.value", "f_sees.delayedValue"])
}

/// Runs the tasks with keys added to each; the rows as whole numbers.
fn rows(fast: &str, slow: &str, args: &str) -> Vec<Vec<i64>> {
    let folder =
        Domain::with(&[("tasks.toml", &counters().replace("#FAST", fast).replace("#SLOW", slow))]);
    let out = folder.run(&format!("simulate tasks.toml {args}")).silently();
    let mut rows = cells(&out).into_iter();
    let header = rows.next().unwrap();
    assert_eq!(
        header,
        ["cycle", "s.value", "s_sees.delayedValue", "f.value", "f_sees.delayedValue"],
        "outputs in the order of the file"
    );
    let whole = |cell: &str| {
        let value: f64 = cell.parse().unwrap();
        assert_eq!(value.fract(), 0.0);
        value as i64
    };
    rows.map(|row| row.into_iter().map(whole).collect()).collect()
}

/// At the same instant `fast` comes before `slow`.
const FAST_FIRST: [[i64; 5]; 5] = [
    [0, 0, 0, 100, 0],
    [1, 10, 100, 101, 10],
    [2, 10, 100, 102, 10],
    [3, 11, 102, 103, 11],
    [4, 11, 102, 104, 11],
];
/// At the same instant `slow` comes before `fast`.
const SLOW_FIRST: [[i64; 5]; 5] = [
    [0, 10, 0, 100, 10],
    [1, 10, 0, 101, 10],
    [2, 11, 101, 102, 11],
    [3, 11, 101, 103, 11],
    [4, 12, 103, 104, 12],
];

#[test]
fn tasks_due_at_the_same_instant_run_by_priority_and_then_in_the_order_of_the_file() {
    for (fast, slow, expected) in [
        ("", "", FAST_FIRST),
        ("priority = 50", "priority = 50", FAST_FIRST),
        ("priority = 2", "priority = 1", FAST_FIRST),
        ("priority = 1", "", FAST_FIRST),
        ("", "priority = 1", SLOW_FIRST),
        ("priority = 1", "priority = 89", SLOW_FIRST),
    ] {
        assert_eq!(rows(fast, slow, "--cycles 5"), expected, "{fast} {slow}");
    }
}

#[test]
fn a_phase_moves_a_task_between_the_cycles_of_the_other() {
    // Whatever its priority, `slow` runs 500 us after the row that it would have been in.
    for slow in
        ["phase = \"500us\"", "phase = \"500us\"\npriority = 80", "phase = \"1ns\"\npriority = 80"]
    {
        assert_eq!(rows("", slow, "--cycles 5"), FAST_FIRST, "{slow}");
    }
    // A phase of one fast cycle: they meet again, one millisecond later.
    assert_eq!(
        rows("", "phase = \"1ms\"\npriority = 80", "--cycles 4"),
        [[0, 0, 0, 100, 0], [1, 10, 100, 101, 10], [2, 10, 100, 102, 10], [3, 11, 102, 103, 11]]
    );
    // A phase of the task whose cycles are the rows: the other runs before its first row.
    assert_eq!(
        rows("phase = \"500us\"", "", "--cycles 4"),
        [[0, 10, 0, 100, 10], [1, 10, 0, 101, 10], [2, 11, 101, 102, 11], [3, 11, 101, 103, 11]]
    );
}

#[test]
fn the_rows_are_the_cycles_of_the_task_that_is_named() {
    assert_eq!(rows("", "", "--cycles 5 --task fast"), FAST_FIRST);
    assert_eq!(
        rows("", "", "--cycles 3 --task slow"),
        [[0, 10, 100, 100, 0], [1, 11, 102, 102, 10], [2, 12, 104, 104, 11]]
    );
    assert_eq!(
        rows("", "priority = 1", "--cycles 3 --task slow"),
        [[0, 10, 0, 0, 0], [1, 11, 101, 101, 10], [2, 12, 103, 103, 11]]
    );
}

#[test]
fn a_task_that_does_not_exist_is_refused_with_those_that_do() {
    let folder = Domain::with(&[("tasks.toml", &counters())]);
    let error = folder.run("simulate tasks.toml --cycles 1 --task slwo").refused(2);
    assert_says(&error, &["tasks.toml", "no task \"slwo\"", "fast, slow"]);
}

#[test]
fn a_row_of_inputs_applies_from_the_cycle_of_the_task_that_is_named() {
    let config = Plant::new("inputs")
        .task("fast", "1ms")
        .task("slow", "2ms")
        .on("fast")
        .column("target", "LREAL")
        .on("slow")
        .column("seen", "LREAL")
        .on("fast")
        .ramp("ramp", "value = \"target\", setChangeRate = 1000.0")
        .output("out", &["ramp.delayedValue", "target"])
        .on("slow")
        .output("seen", &["seen"]);
    let inputs = "target,seen\n1e9,1\n-1e9,2\n5,3\n";
    let folder = Domain::with(&[("inputs.toml", &config), ("in.csv", inputs)]);
    // One step of 1 in each fast cycle. Slow cycle 1 is at 2 ms: the fast cycle at 1 ms still had
    // the first row, the one at 2 ms has the second. The last row holds.
    assert_eq!(
        folder.run("simulate inputs.toml --inputs in.csv --task slow --cycles 4").silently(),
        "cycle,ramp.delayedValue,target,seen\n\
         0,1.0,1000000000.0,1.0\n1,1.0,-1000000000.0,2.0\n2,1.0,5.0,3.0\n3,3.0,5.0,3.0\n"
    );
    assert_eq!(
        folder.run("simulate inputs.toml --inputs in.csv").silently(),
        "cycle,ramp.delayedValue,target,seen\n\
         0,1.0,1000000000.0,1.0\n1,0.0,-1000000000.0,2.0\n2,1.0,5.0,3.0\n"
    );
}

#[test]
fn two_runs_are_the_same_to_the_last_byte() {
    let folder = Domain::with(&[(
        "tasks.toml",
        &counters().replace("inf", "12345.678").replace("2ms", "1.7ms"),
    )]);
    for output in ["a.csv", "b.csv"] {
        folder.run(&format!("simulate tasks.toml --cycles 20000 --output {output}")).silently();
    }
    let (first, second) = (folder.read("a.csv"), folder.read("b.csv"));
    assert_eq!(first.lines().count(), 20_001);
    assert!(first == second, "the same configuration gave another file");
    let shown = folder.run("simulate tasks.toml --cycles 20000").silently();
    assert!(first == shown, "the file differs from stdout");
    let short = folder.run("simulate tasks.toml --cycles 137").silently();
    assert!(first.starts_with(&short), "a shorter run is the beginning of a longer one");
}

/// A ramp of 10 per second in `fast` whose sample time is that of the task at `callOB`, and a
/// sawtooth with a TIME as it is written.
fn ramp_and_saw(call_ob: &str, time_range: &str) -> Plant {
    let ramp = format!("value = 100.0, setChangeRate = 10.0, callOB = {call_ob}");
    let saw = format!("timeRange = {time_range}, incrementRange = 1, endlessSteps = true");
    Plant::new("named")
        .task("fast", "1ms")
        .task("slow", "100ms")
        .on("fast")
        .ramp("ramp", &ramp)
        .saw("saw", &saw)
        .output("o", &["ramp.delayedValue", "ramp.status", "saw.value"])
}

#[test]
fn a_task_that_call_ob_names_gives_its_period_though_it_has_no_number() {
    for (call_ob, step) in [("\"slow\"", "1.0"), ("\"fast\"", "0.01")] {
        let folder = Domain::with(&[("named.toml", &ramp_and_saw(call_ob, "0"))]);
        let out = folder.run("simulate named.toml --cycles 1").silently();
        assert_eq!(out.lines().nth(1).unwrap(), format!("0,{step},0.0,0.0"), "{call_ob}");
    }
}

#[test]
fn a_time_steps_alike_however_it_is_written() {
    let run = |written: &str| {
        let folder = Domain::with(&[("named.toml", &ramp_and_saw("\"fast\"", written))]);
        folder.run("simulate named.toml --cycles 10").silently()
    };
    let expected = run("2");
    assert!(expected.lines().last().unwrap().ends_with(",4.0"), "{expected}");
    for written in ["\"2ms\"", "\"T#2ms\"", "\"TIME#0.002s\""] {
        assert_eq!(run(written), expected, "{written}");
    }
}
