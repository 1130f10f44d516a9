//! What values are worth between nodes: what one has lost, rejects or forces, the next ones learn from the
//! flags of its frames.

use std::cell::Cell;

use crate::plant::{Frame, Observer, sensor};
use isochrone_ipc::Flags;
use isochrone_testing::plants::{GUARD, tank};
use isochrone_testing::{Domain, Plant};
use rustix::process::Signal;
use serde_json::Value;

/// Reads the guard's frames: as they are, and only the good ones.
fn second() -> Plant {
    Plant::new("second")
        .task("t", "5ms")
        .input("any", "guard/out", "signal = \"x\"")
        .input("good", "guard/out", "signal = \"x\"\nbad = \"stale\"")
        .output("second/any", &["any", "any.ok"])
        .output("second/good", &["good", "good.ok"])
}

#[test]
fn the_second_node_of_a_chain_learns_from_the_frames_what_the_first_has_lost() {
    let (domain, guard) = tank(GUARD);
    let mut second = domain.start_node("second.toml", &second(), "");
    let sensor = sensor(&domain, "7.5");
    let mut any = Observer::of(&domain, "second/any");
    let mut good = Observer::of(&domain, "second/good");
    let is_well = |frame: &Frame| frame.flags().is_empty() && frame.values == [7.5, 1.0];
    any.until("good", |_| {}, is_well);
    good.until("good", |_| {}, is_well);

    sensor.signal(Signal::STOP);
    let frame = any.flagged(Flags::UPSTREAM);
    assert_eq!(frame.values, [7.5, 1.0], "its frames are fresh");
    let frame = good.flagged(Flags::STALE | Flags::UPSTREAM);
    assert_eq!(frame.values, [7.5, 0.0], "and taken for stale where they are to be good");
    second.wait_for("input \"good\" is stale: its frames of service \"guard/out\" say STALE; it keeps its value");
    sensor.signal(Signal::CONT);
    any.until("good again", |_| {}, is_well);
    good.until("good again", |_| {}, is_well);

    guard.stop().expect_code(0);
    // On a busy machine the guard's last frame may say that its sensor hung once more.
    let frame = any.until("stale", |_| {}, |frame| frame.flags().contains(Flags::STALE));
    assert_eq!(frame.values, [7.5, 0.0], "there is no max_age: the end was said");
    second.wait_for("input \"any\" is stale: its publisher of service \"guard/out\" has ended; it keeps its value");
}

/// Adds what the other node says to a sensor's value.
fn looped(name: &str, other: &str, feedback: bool) -> Plant {
    Plant::new(name)
        .task("t", "5ms")
        .input("other", &format!("loop/{other}"), &format!("feedback = {feedback}"))
        .input("x", "plant/sensor", "max_age = \"500ms\"")
        .output(&format!("loop/{name}"), &["other", "x"])
}

#[test]
fn what_goes_round_a_loop_of_nodes_ends_where_one_of_them_says_feedback() {
    let (domain, _a) = tank(&looped("a", "b", true));
    let _b = domain.start_node("b.toml", &looped("b", "a", false), "");
    let (mut of_a, mut of_b) = (Observer::of(&domain, "loop/a"), Observer::of(&domain, "loop/b"));
    let sensor = sensor(&domain, "7.5");
    of_a.flagged(Flags::NONE);
    of_b.flagged(Flags::NONE);
    sensor.signal(Signal::STOP);
    of_a.flagged(Flags::STALE);
    of_b.flagged(Flags::STALE | Flags::UPSTREAM);
    sensor.signal(Signal::CONT);
    of_a.flagged(Flags::NONE);
    of_b.flagged(Flags::NONE);
}

/// Reads the guard's frames with the age that they tell, which is another one in each of them.
fn aged() -> Plant {
    Plant::new("aged")
        .task("t", "5ms")
        .input("any", "guard/out", "signal = \"x\"")
        .input("age", "guard/out", "signal = \"x.age\"")
        .output("aged/out", &["any", "any.ok", "age"])
}

/// A publisher is killed; `None` if this test was so late that it missed a frame.
fn killed() -> Option<()> {
    const MAX_AGE_NS: u64 = 500_000_000;
    const PERIOD_NS: u64 = 5_000_000;
    let (domain, guard) = tank(GUARD);
    let aged = domain.start_node("aged.toml", &aged(), "");
    let mut first = Observer::of(&domain, "guard/out");
    let mut second = Observer::of(&domain, "aged/out");
    let sensor = sensor(&domain, "7.5");
    let is_ok = |frame: &Frame| frame.values[1] == 1.0;
    first.until("good", |_| {}, is_ok);
    sensor.kill();

    // On a busy machine the sensor may have hung before.
    let last_fall = Cell::new(None);
    let mut before: Option<Frame> = None;
    let mut is_whole = true;
    let mut check = |frame: &Frame| {
        let now = Frame { header: frame.header, values: frame.values.clone() };
        let Some(before) = before.replace(now) else { return };
        is_whole &= frame.header.sequence == before.header.sequence + 1;
        if !is_whole || !is_ok(&before) || is_ok(frame) {
            return;
        }
        assert_eq!((before.flags(), frame.flags()), (Flags::NONE, Flags::STALE));
        let missed = frame.header.missed - before.header.missed;
        let sample_ns = before.header.source_ns;
        assert_eq!(frame.header.source_ns, sample_ns, "the same sample is behind both");
        let late_ns = frame.header.release_ns - sample_ns;
        assert!(late_ns <= MAX_AGE_NS + (1 + missed) * PERIOD_NS, "{late_ns}, {missed} missed");
        last_fall.set(Some(frame.header.cycle));
    };
    first.until("not ok", &mut check, |_| last_fall.get().is_some());
    // The alarm is that of the last fall, and stays.
    let mut alarm = Value::Null;
    isochrone_testing::wait_until("the alarm names the input", || {
        alarm = domain.answer("alarms guard --json")[0].clone();
        alarm["name"] == "x"
    });
    let since = alarm["since_cycle"].as_u64().unwrap();
    first.until("of that cycle", &mut check, |frame| frame.header.cycle >= since);
    if !is_whole {
        return None;
    }
    assert_eq!(last_fall.get(), Some(since), "{alarm}");
    assert!(alarm["meaning"].as_str().unwrap().contains("plant/sensor"), "{alarm}");

    let knows = |frame: &Frame| {
        // Before the guard's first frame its own inputs are substitutes.
        if !frame.flags().contains(Flags::SUBSTITUTE) {
            let is_upstream = frame.flags().contains(Flags::UPSTREAM);
            assert_eq!(is_upstream, frame.values[2] > 0.5, "{:?} {}", frame.values, frame.flags());
            assert_eq!(frame.values[1], 1.0, "the guard's frames are fresh");
        }
    };
    let is_stale = |frame: &Frame| frame.values[2] > 0.5 && frame.values[2].is_finite();
    second.until("of what is stale", knows, is_stale);
    for node in [aged, guard] {
        node.stop().expect_code(0);
    }
    Some(())
}

#[test]
fn an_input_whose_publisher_is_killed_falls_in_time_is_an_alarm_and_the_next_node_knows_at_once() {
    (0..10).find_map(|_| killed()).expect("one of ten runs in which no frame was missed");
}

#[test]
fn what_is_forced_in_one_node_is_flagged_in_the_frames_of_the_next_for_as_long_as_it_is_held() {
    let domain = Domain::new();
    let free = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\n\
                in = { incrementRange = 1, endlessSteps = true }\n\
                [[output]]\nservice = \"guard/free\"\nsignals = [\"saw.value\"]\n";
    let forcing = GUARD.replace("[node]", "[node]\ncontrol = \"force\"") + free;
    let _guard = domain.start_node("guard.toml", &forcing, "");
    let _second = domain.start_node("second.toml", &second(), "");
    let first_sensor = sensor(&domain, "7.5");
    let services = ["guard/out", "second/any", "second/good"];
    let mut observers = services.map(|service| Observer::of(&domain, service));
    let mut free = Observer::of(&domain, "guard/free");
    for observer in &mut observers {
        observer.until("good", |_| {}, |frame| frame.flags() == Flags::NONE);
    }
    // Of every frame, whichever was read: it is flagged if its value is the forced one.
    let agrees = |frame: &Frame| {
        let is_forced = frame.flags().contains(Flags::FORCED);
        assert_eq!(is_forced, frame.values[0] == 42.0, "{:?} {}", frame.values, frame.flags());
    };
    domain.stdout("force guard x=42 --hold");
    let mut forced_in = None;
    for observer in &mut observers {
        let forced = observer.until("forced", agrees, |frame| frame.flags() == Flags::FORCED);
        assert_eq!(forced.values[..2], [42.0, 1.0], "a forced value is no bad one");
        forced_in.get_or_insert(forced.header.cycle);
    }
    // Frames that have nothing to do with the input are not flagged.
    let forced_in = forced_in.unwrap();
    let is_none = |frame: &Frame| assert_eq!(frame.flags(), Flags::NONE);
    free.until("after the force", is_none, |frame| frame.header.cycle > forced_in);
    // `ok` keeps telling the truth under a force.
    first_sensor.kill();
    let [out, any, good] = &mut observers;
    let stale = Flags::STALE | Flags::FORCED;
    let frame = out.until("stale", agrees, |frame| frame.flags() == stale);
    assert_eq!(frame.values[..2], [42.0, 0.0]);
    let frame = any.until("upstream", agrees, |frame| frame.flags().contains(Flags::UPSTREAM));
    assert_eq!((frame.flags(), frame.values[1]), (Flags::UPSTREAM | Flags::FORCED, 1.0));
    let frame = good.until("stale", agrees, |frame| frame.values[1] == 0.0);
    assert_eq!(frame.flags(), stale | Flags::UPSTREAM);

    domain.stdout("release guard x");
    for (observer, flags) in [(out, Flags::STALE), (any, Flags::UPSTREAM)] {
        let released = observer.until("released", agrees, |frame| frame.values[0] != 42.0);
        assert_eq!((released.values[0], released.flags()), (7.5, flags));
    }
    // What holds the last good value holds the forced one, and says so until there is another.
    let _second_sensor = sensor(&domain, "7.5");
    let held = stale | Flags::UPSTREAM;
    let is_held = |frame: &Frame| frame.flags() == held || frame.flags() == Flags::NONE;
    let check = |frame: &Frame| {
        agrees(frame);
        assert!(is_held(frame), "{}", frame.flags());
    };
    let back = good.until("good again", check, |frame| frame.flags() == Flags::NONE);
    assert_eq!(back.values[..2], [7.5, 1.0]);
}
