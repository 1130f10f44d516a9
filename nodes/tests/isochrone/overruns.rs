//! Missed releases: counted exactly, told on the wire, and where the node ends because of them.

use std::cell::{Cell, RefCell};
use std::time::Duration;

use isochrone_ipc::{Depth, FrameSubscriber};
use isochrone_machine::Environment;
use isochrone_testing::plants::SAW;
use isochrone_testing::{Domain, wait_until};
use rustix::process::Signal;

/// Freezes a process as a stall of the machine would.
fn freeze(process: &isochrone_testing::Process, time: Duration) {
    process.signal(Signal::STOP);
    std::thread::sleep(time);
    process.signal(Signal::CONT);
}

#[test]
fn every_release_missed_while_the_process_was_frozen_is_counted_and_told_on_the_wire() {
    let domain = Domain::new();
    // 200 frames fit into the buffer, so they are all there in the end. They take four seconds, so
    // that the freeze is over before even where the machine is busy.
    let slow = SAW.replace("2ms", "20ms");
    let observer = domain.join("observer");
    let frames = FrameSubscriber::open(&observer, "plant/saw", 1, Depth::All);
    let frames = RefCell::new(frames.unwrap());
    let arguments = "--cycles 200 --report node.json";
    let mut node = domain.start_node("node.toml", &slow, arguments);
    // A freeze before the first release would leave no frame to compare with.
    let first = Cell::new(None);
    node.wait_until_it("sends a frame", |_| {
        first.set(frames.borrow_mut().next(0).map(|frame| *frame.header()));
        first.get().is_some()
    });
    let mut last = first.get().unwrap();
    let mut frames = frames.into_inner();
    std::thread::sleep(Duration::from_millis(10));
    freeze(&node, Duration::from_secs(1));
    node.finish().expect_code(0);

    let mut longest = 0;
    let mut first_cycle = None;
    while let Some(frame) = frames.next(0) {
        let header = *frame.header();
        // An endless saw of one cycle a step counts cycles from the first that ran: time goes on
        // while cycles are missed.
        let saw = frame.values()[0];
        let first = *first_cycle.get_or_insert(header.cycle as f64 - saw);
        assert_eq!(saw, header.cycle as f64 - first);
        if last.sequence + 1 == header.sequence {
            let skipped = header.cycle - last.cycle - 1;
            assert_eq!(header.missed - last.missed, skipped, "told in the frame that came next");
            assert_eq!(header.release_ns - last.release_ns, (skipped + 1) * 20_000_000);
            longest = longest.max(skipped);
        }
        last = header;
    }
    // The freeze may begin and end anywhere in a period, and the machine may add to it.
    assert!(longest >= 48, "{longest} releases were missed in a freeze of 50 periods");
    let missed = domain.json("node.json")["tasks"][0]["missed"].as_u64().unwrap();
    assert_eq!(missed, last.missed, "the report and the last frame agree");
    assert_eq!(last.cycle + 1 - missed, 200, "every cycle either ran or was counted as missed");
}

/// A run that the node ends by its policy, and the cycles that were seen; `None` if the machine was
/// so busy that the node missed a release before it was frozen.
fn ended_by_a_freeze(policy: &str) -> Option<Vec<u64>> {
    let domain = Domain::new();
    // Slow enough that only the freeze makes it miss releases.
    let slow = SAW.replace("\"2ms\"", &format!("\"50ms\"\n{policy}"));
    let mut node = domain.start_node("node.toml", &slow, "--report node.json --seconds 50");
    let observer = domain.start_until("subscribe plant/saw --csv out.csv", "subscribed");
    let rows =
        || std::fs::read_to_string(domain.path("out.csv")).unwrap_or_default().lines().count();
    wait_until("three cycles have been seen, or it is over", || rows() > 3 || node.is_over());
    if node.is_over() {
        return None;
    }
    freeze(&node, Duration::from_millis(1500));
    node.finish().expect_code(1).says(&["task \"t\" missed a release"]);
    let task = domain.json("node.json")["tasks"][0].clone();
    let [ran, missed] = ["cycles", "missed"].map(|count| task[count].as_u64().unwrap());
    if missed < 20 {
        assert!(policy.contains("stop"), "{missed} misses are within the limit");
        return None;
    }
    domain.wait_for_cycle("out.csv", ran + missed - 1);
    observer.stop().expect_code(0);
    let recorded = domain.read("out.csv");
    let cycle = |row: &str| row.split(',').nth(1).unwrap().parse().unwrap();
    Some(recorded.lines().skip(1).map(cycle).collect())
}

#[test]
fn a_node_that_misses_more_than_its_limit_ends_with_a_last_frame_and_status_1() {
    for policy in ["on_overrun = { misses = 20, cycles = 1000 }", "overrun = \"stop\""] {
        let mut cycles = (0..12)
            .find_map(|_| ended_by_a_freeze(policy))
            .expect("one of a dozen runs in which nothing but the freeze misses releases");
        // The node says that it ends in another frame of its last cycle.
        cycles.dedup();
        let [.., before, last] = cycles.as_slice() else { panic!("{cycles:?}") };
        assert!(last - before > 20, "the last frame is that of the late cycle: {cycles:?}");
    }
}

#[test]
fn a_cycle_that_takes_too_long_stops_the_node_although_no_release_was_missed() {
    let domain = Domain::new();
    // No machine steps so many blocks in a period.
    let node = SAW
        .replace("\"2ms\"", "\"50us\"\nwake = \"spin\"\noverrun = \"stop\"")
        .replace("\"SawTooth\"", "\"SawTooth\"\ncount = 50000")
        .replace("saw.value", "saw.0.value");
    domain.write("node.toml", &node);
    let ended = domain.run("run node.toml --report node.json").expect_code(1);
    let task = domain.json("node.json")["tasks"][0].clone();
    // A machine that is late for the very first release misses some.
    let says = match task["missed"].as_u64() {
        Some(0) => "\"t\" ended a cycle after its next release was due and stopped the node",
        _ => "\"t\" missed a release and stopped the node",
    };
    assert_eq!((&task["cycles"], &task["overruns"]), (&1.into(), &1.into()), "{task}");
    assert!(ended.stderr.contains(says), "{}", ended.stderr);
}

/// A task of 1 ms, and how it waits.
fn waiting(name: &str, cpu: Option<u32>, wake: &str) -> String {
    let cpu = cpu.map_or(String::new(), |cpu| format!("cpu = {cpu}\n"));
    format!("[[task]]\nname = \"{name}\"\nperiod = \"1ms\"\npriority = 10\n{cpu}{wake}\n")
}

#[test]
fn waiting_that_the_kernel_would_throttle_is_refused_with_the_tasks_and_the_remedy() {
    let is_off = Environment::read().fifo_throttling().is_none();
    let longest = "wake = \"hybrid\"\nmargin = \"960us\"";
    let half = "wake = \"hybrid\"\nmargin = \"480us\"";
    for (tasks, parts) in [
        (waiting("t", None, "wake = \"spin\""), ["\"t\" (wake = \"spin\")", "100.0 %"]),
        (waiting("t", None, longest), ["\"t\" (wake = \"hybrid\")", "96.0 %"]),
        (
            waiting("a", Some(0), half) + &waiting("b", Some(0), half),
            ["\"a\" (wake = \"hybrid\"), \"b\"", "96.0 %"],
        ),
    ] {
        let domain = Domain::with(&[("node.toml", &format!("[node]\nname = \"n\"\n{tasks}"))]);
        let ended = domain.run("run node.toml --cycles 5");
        if is_off {
            ended.expect_code(0);
            continue;
        }
        let ended = ended.expect_code(1);
        for part in parts.into_iter().chain(["hybrid", "sched_rt_runtime_us=-1"]) {
            assert!(ended.stderr.contains(part), "{part}: {}", ended.stderr);
        }
    }
}

#[test]
fn waiting_that_leaves_the_kernel_its_share_runs() {
    let half = "wake = \"hybrid\"\nmargin = \"480us\"";
    for tasks in [
        waiting("a", Some(0), half) + &waiting("b", Some(0), "wake = \"sleep\""),
        waiting("a", Some(0), half) + &waiting("b", Some(0), "wake = \"hybrid\""),
    ] {
        let domain = Domain::with(&[("node.toml", &format!("[node]\nname = \"n\"\n{tasks}"))]);
        domain.run("run node.toml --cycles 5").expect_code(0);
    }
}
