//! What values are worth, through real processes: sensors that hang, die, never come or send nonsense,
//! and nodes that learn of it from the frames.

use std::time::Instant;

use crate::plant::{Frame, Observer, Source, sensor};
use isochrone_ipc::{Flags, FrameHeader};
use isochrone_testing::plants::GUARD;
use isochrone_testing::{Domain, PATIENCE, Plant, wait_for_ok};
use rustix::process::Signal;

/// What holds of every frame of the guard: value, flags, `ok` and `age` are of one cycle.
fn agrees(frame: &Frame) {
    let [x, ok, age] = frame.values[..] else { panic!("three values") };
    let flags = frame.flags().without(Flags::STOPPED);
    if age == f64::INFINITY {
        assert_eq!((x, ok, flags), (-1.0, 0.0, Flags::SUBSTITUTE));
    } else if age > 0.5 {
        assert_eq!((x, ok, flags), (7.5, 0.0, Flags::STALE), "{age}");
    } else {
        assert_eq!((x, ok, flags), (7.5, 1.0, Flags::NONE), "{age}");
        assert!(age >= 0.0);
    }
}

#[test]
fn a_sensor_that_hangs_is_stale_in_the_first_frame_after_its_max_age_and_good_again_when_it_goes_on()
 {
    let domain = Domain::new();
    let node = domain.start_node("guard.toml", GUARD, "--report guard.json");
    let mut observer = Observer::of(&domain, "guard/out");
    let sensor = sensor(&domain, "7.5");
    let is_good = |frame: &Frame| frame.values[1] == 1.0;
    let is_stale = |frame: &Frame| frame.flags().contains(Flags::STALE);
    // On a busy machine the sensor may hang at other times too, and this test may miss frames.
    let mut falls = Vec::new();
    let mut before: Option<(FrameHeader, bool)> = None;
    let mut check = |frame: &Frame| {
        agrees(frame);
        if let Some((header, was_stale)) = before {
            let is_next = frame.header.sequence <= header.sequence + 1;
            if !is_next || (is_stale(frame) && !was_stale) {
                falls.push(header.cycle + 1..=frame.header.cycle);
            }
        }
        before = Some((frame.header, is_stale(frame)));
    };
    observer.until("good", &mut check, is_good);
    sensor.signal(Signal::STOP);
    observer.until("stale", &mut check, is_stale);
    sensor.signal(Signal::CONT);
    observer.until("good again", &mut check, is_good);
    node.signal(Signal::TERM);
    let last =
        observer.until("the last", &mut check, |frame| frame.flags().contains(Flags::STOPPED));
    let ended = node.finish().expect_code(0);
    let told = ended.stderr.lines().filter_map(|line| {
        let (_, cycle) = line.split_once("older than max_age; it keeps its value (cycle ")?;
        cycle.split(')').next()?.parse::<u64>().ok()
    });
    let told: Vec<u64> = told.collect();
    assert!(!told.is_empty(), "{}", ended.stderr);
    let is_fall = |cycle: &u64| falls.iter().any(|fall| fall.contains(cycle));
    assert!(told.iter().all(is_fall), "{falls:?}\n{}", ended.stderr);
    assert!(ended.stderr.contains("input \"x\" takes samples again (cycle "), "{}", ended.stderr);
    let report = domain.json("guard.json");
    let input = &report["tasks"][0]["inputs"][0];
    let is_ok = last.values[1] == 1.0;
    assert_eq!((&input["name"], &input["ok"]), (&"x".into(), &is_ok.into()), "{report}");
    assert!(
        input["falls"].as_u64() >= Some(1) && input["not_ok_ns"].as_u64() > Some(0),
        "{report}"
    );
    assert_eq!(report["warnings"][0]["code"], "input_not_ok", "{report}");
}

#[test]
fn the_value_of_a_sensor_that_is_killed_goes_to_its_default_and_comes_back_with_the_next_one() {
    let domain = Domain::new();
    let ramp = GUARD.replace("max_age", "on_stale = { ramp = 100.0 }\nmax_age");
    let _node = domain.start_node("guard.toml", &ramp, "");
    let mut observer = Observer::of(&domain, "guard/out");
    let first = sensor(&domain, "7.5");
    observer.until("good", |_| {}, |frame| frame.values[..2] == [7.5, 1.0]);
    first.kill();
    // 100 a second in cycles of 5 ms are steps of 0.5.
    let is_step = |frame: &Frame| {
        let x = frame.values[0];
        assert!((x * 2.0).fract() == 0.0 && (-1.0..=7.5).contains(&x), "{x}");
        let is_substitute = frame.flags().contains(Flags::SUBSTITUTE);
        assert_eq!(is_substitute, x != 7.5, "{}", frame.flags());
    };
    let landed = observer.until("safe", is_step, |frame| frame.values[0] == -1.0);
    assert_eq!(landed.flags(), Flags::STALE | Flags::SUBSTITUTE);
    assert_eq!(landed.header.source_ns, 0, "no sample is behind a default");
    let _second = sensor(&domain, "7.5");
    let back = observer.until("back", is_step, |frame| frame.flags() == Flags::NONE);
    assert_eq!(back.values[..2], [7.5, 1.0]);
}

#[test]
fn a_sensor_that_never_comes_is_said_and_the_frames_carry_a_substitute() {
    let domain = Domain::new();
    let mut node = domain.start_node("guard.toml", GUARD, "--report guard.json");
    let mut observer = Observer::of(&domain, "guard/out");
    let frame = observer.until("one", agrees, |_| true);
    assert_eq!(frame.values, [-1.0, 0.0, f64::INFINITY]);
    assert_eq!((frame.flags(), frame.header.source_ns), (Flags::SUBSTITUTE, 0));
    node.wait_for(
        "input \"x\" has no sample yet, because service \"plant/sensor\" has sent no frame",
    );
    let ended = node.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("has no sample yet").count(), 1, "{}", ended.stderr);
    let report = domain.json("guard.json");
    let message = report["warnings"][0]["message"].as_str().unwrap();
    assert!(message.starts_with("input \"x\" was never ok, for "), "{report}");
    assert_eq!(report["tasks"][0]["inputs"][0]["falls"], 0, "{report}");
}

#[test]
fn a_sensor_that_sends_nan_is_rejected_or_where_it_is_taken_an_error_of_the_block_that_reads_it() {
    let domain = Domain::new();
    let text = Plant::new("guard")
        .task("t", "5ms")
        .input("count", "plant/sensor", "type = \"INT\"\nchannel = 0")
        .input("level", "plant/sensor", "channel = 1\nfinite = false")
        .input("flow", "plant/sensor", "channel = 1\nrange = [0.0, 10.0]")
        .ramp("ramp", "value = \"level\", setChangeRate = inf")
        .output("guard/count", &["count", "count.ok"])
        .output("guard/flow", &["flow", "flow.ok"])
        .output("guard/ramp", &["ramp.delayedValue", "level.ok"]);
    let node = domain.start_node("guard.toml", &text, "");
    let mut observers =
        ["guard/count", "guard/flow", "guard/ramp"].map(|service| Observer::of(&domain, service));
    let mut source = Source::open(&domain, "plant/sensor", &["a", "b"]);
    let mut expect = |values: [f64; 2], frames: [([f64; 2], Flags); 3]| {
        for (observer, expected) in observers.iter_mut().zip(frames) {
            wait_for_ok(&format!("a frame has {:?} {}", expected.0, expected.1), || {
                source.send(&values);
                let frame = observer.until("there", |_| {}, |_| true);
                let is_there = (&frame.values[..], frame.flags()) == (&expected.0[..], expected.1);
                let seen = || format!("{:?} {}", frame.values, frame.flags());
                is_there.then_some(()).ok_or_else(seen)
            });
        }
    };
    let good = |value| ([value, 1.0], Flags::NONE);
    let rejected = |value| ([value, 0.0], Flags::REJECTED);
    expect([3.0, 2.5], [good(3.0), good(2.5), good(2.5)]);
    let error = ([2.5, 1.0], Flags::ERROR);
    expect([f64::NAN, f64::NAN], [rejected(3.0), rejected(2.5), error]);
    expect([4.0, 1.5], [good(4.0), good(1.5), good(1.5)]);
    expect([4.0, 10.5], [good(4.0), rejected(1.5), good(10.5)]);
    drop(source);
    node.stop().expect_code(0).says(&[
        "input \"count\" rejects NaN, which INT cannot hold",
        "input \"flow\" rejects NaN, which is not finite",
        "input \"flow\" rejects 10.5, which is out of its range from 0.0 to 10.0",
    ]);
}

#[test]
fn the_last_frame_of_a_node_says_so_however_it_ends() {
    let domain = Domain::with(&[("guard.toml", GUARD)]);
    for arguments in ["--cycles 800", ""] {
        let mut observer = Observer::before(&domain, "guard/out", 3);
        let node = domain.start(&format!("run guard.toml {arguments}"));
        observer.until("one", |_| {}, |_| true);
        if arguments.is_empty() {
            node.signal(Signal::TERM);
        }
        let is_last = |frame: &Frame| frame.flags().contains(Flags::STOPPED);
        let last = observer.until("the last", |_| {}, is_last);
        node.finish().expect_code(0);
        assert!(observer.next().is_none(), "{arguments}: nothing comes after it");
        if !arguments.is_empty() {
            assert_eq!(last.header.sequence, 799, "it is the frame of the last cycle");
        }
        drop(observer.participant);
    }
}

#[test]
fn inputs_of_one_service_change_at_one_frame_together() {
    let domain = Domain::new();
    let text = Plant::new("guard")
        .task("t", "1ms")
        .input("a", "plant/sensor", "channel = 0")
        .input("b", "plant/sensor", "channel = 1")
        .output("guard/out", &["a", "b", "a.ok", "b.ok"]);
    let _node = domain.start_node("guard.toml", &text, "");
    let mut observer = Observer::of(&domain, "guard/out");
    let mut source = Source::open(&domain, "plant/sensor", &["a", "b"]);
    let mut seen = std::collections::HashSet::new();
    let since = Instant::now();
    for count in 0_u64.. {
        source.send(&[count as f64; 2]);
        while let Some(Frame { values, .. }) = observer.next() {
            assert_eq!((values[0], values[2]), (values[1], values[3]));
            seen.insert(values[0].to_bits());
        }
        if seen.len() > 300 {
            break;
        }
        assert!(since.elapsed() < PATIENCE, "{} values", seen.len());
    }
    drop(source);
}

#[test]
fn a_wired_ok_takes_the_example_to_its_safe_value_and_back() {
    let domain = Domain::new();
    let text = include_str!("../../../examples/dead_sensor.toml");
    let _node = domain.start_node("dead_sensor.toml", text, "");
    let mut shown = domain.start("subscribe plant/safe_level");
    let first = sensor(&domain, "1.5");
    shown.wait_for("safe.outputValue=1.5 level=1.5 level.ok=TRUE");
    first.kill();
    shown.wait_for("safe.outputValue=0.0 level=1.5 level.ok=FALSE");
    shown.wait_for("STALE");
    let mut observer = Observer::of(&domain, "plant/safe_level");
    let _second = sensor(&domain, "1.0");
    observer.until("back", |_| {}, |frame| frame.values[..3] == [1.0, 1.0, 1.0]);
}
