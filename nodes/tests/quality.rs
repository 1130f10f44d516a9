//! What values are worth, through real processes: sensors that hang, die, never come or send nonsense,
//! and nodes that learn of it from the frames.

mod domain;

use std::thread;
use std::time::{Duration, Instant};

use domain::{Domain, Process};
use isochrone_ipc::{
    Depth, Flags, FrameHeader, FrameLayout, FramePublisher, FrameSubscriber, Participant,
    SignalSpec, Stamp, ipc,
};
use rustix::process::Signal;

const PATIENCE: Duration = Duration::from_secs(60);

/// Reads one value of a sensor, and publishes it with what it is worth.
const GUARD: &str = r#"
[node]
name = "guard"
[[task]]
name = "t"
period = "5ms"
[[input]]
name = "x"
service = "plant/sensor"
default = -1.0
max_age = "500ms"
[[output]]
service = "guard/out"
signals = ["x", "x.ok", "x.age"]
"#;

/// Reads the guard's frames: as they are, and only the good ones.
const SECOND: &str = r#"
[node]
name = "second"
[[task]]
name = "t"
period = "5ms"
[[input]]
name = "any"
service = "guard/out"
signal = "x"
[[input]]
name = "good"
service = "guard/out"
signal = "x"
bad = "stale"
[[output]]
service = "second/any"
signals = ["any", "any.ok"]
[[output]]
service = "second/good"
signals = ["good", "good.ok"]
"#;

fn run(domain: &Domain, file: &str, text: &str) -> Process {
    domain.write(file, text);
    let mut node = domain.start(&format!("run {file} --report {file}.json"));
    node.wait_for("is running");
    node
}

fn sensor(domain: &Domain, value: &str) -> Process {
    let value = format!("--value={value}");
    let mut sensor = domain.start_with(&["publish", "plant/sensor", &value, "--rate", "100"]);
    sensor.wait_for("publishing");
    sensor
}

/// Sees every frame of a service.
struct Observer {
    subscriber: FrameSubscriber<ipc::Service>,
    participant: Participant<ipc::Service>,
}

struct Frame {
    header: FrameHeader,
    values: Vec<f64>,
}

impl Frame {
    fn flags(&self) -> Flags {
        self.header.flags()
    }
}

impl Observer {
    fn of(domain: &Domain, service: &str) -> Self {
        let participant = domain.join("observer");
        let since = Instant::now();
        loop {
            let found = FrameSubscriber::open_existing(&participant, service, Depth::All).unwrap();
            if let Some(subscriber) = found {
                return Self { subscriber, participant };
            }
            assert!(since.elapsed() < PATIENCE, "there is no {service}");
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn next(&mut self) -> Option<Frame> {
        self.subscriber.maintain();
        let frame = self.subscriber.next(now_ns())?;
        Some(Frame { header: *frame.header(), values: frame.values().to_vec() })
    }

    /// Looks at all frames that come, with `check`, until one fits.
    #[track_caller]
    fn until(
        &mut self,
        what: &str,
        check: impl Fn(&Frame),
        fits: impl Fn(&Frame) -> bool,
    ) -> Frame {
        let since = Instant::now();
        loop {
            match self.next() {
                Some(frame) => {
                    check(&frame);
                    if fits(&frame) {
                        return frame;
                    }
                }
                None => thread::sleep(Duration::from_millis(1)),
            }
            assert!(since.elapsed() < PATIENCE, "no frame that is {what}");
        }
    }

    #[track_caller]
    fn flagged(&mut self, flags: Flags) -> Frame {
        self.until(&format!("\"{flags}\""), |_| {}, |frame| frame.flags() == flags)
    }
}

/// The clock of frames; a reader of all frames needs it for silent writers only.
fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

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
    let node = run(&domain, "guard.toml", GUARD);
    let mut observer = Observer::of(&domain, "guard/out");
    let sensor = sensor(&domain, "7.5");
    let is_good = |frame: &Frame| frame.values[1] == 1.0;
    observer.until("good", agrees, is_good);
    sensor.signal(Signal::STOP);
    let stale = observer.until("stale", agrees, |frame| frame.flags() == Flags::STALE);
    sensor.signal(Signal::CONT);
    observer.until("good again", agrees, is_good);
    let ended = node.stop().expect_code(0);
    let told = format!("older than max_age; it keeps its value (cycle {})", stale.header.cycle);
    assert!(ended.stderr.contains(&told), "{told}\n{}", ended.stderr);
    assert!(ended.stderr.contains("input \"x\" takes samples again (cycle "), "{}", ended.stderr);
    let report = domain.json("guard.toml.json");
    let input = &report["tasks"][0]["inputs"][0];
    assert_eq!((&input["name"], &input["ok"]), (&"x".into(), &true.into()), "{report}");
    assert!(
        input["falls"].as_u64() >= Some(1) && input["not_ok_ns"].as_u64() > Some(0),
        "{report}"
    );
    assert_eq!(report["warnings"][0]["code"], "input_not_ok", "{report}");
    sensor.stop().expect_code(0);
}

#[test]
fn the_value_of_a_sensor_that_is_killed_goes_to_its_default_and_comes_back_with_the_next_one() {
    let domain = Domain::new();
    let ramp = GUARD.replace("max_age", "on_stale = { ramp = 100.0 }\nmax_age");
    let node = run(&domain, "guard.toml", &ramp);
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
    let second = sensor(&domain, "7.5");
    let back = observer.until("back", is_step, |frame| frame.flags() == Flags::NONE);
    assert_eq!(back.values[..2], [7.5, 1.0]);
    second.stop().expect_code(0);
    node.stop().expect_code(0);
}

#[test]
fn a_sensor_that_never_comes_is_said_and_the_frames_carry_a_substitute() {
    let domain = Domain::new();
    let mut node = run(&domain, "guard.toml", GUARD);
    let mut observer = Observer::of(&domain, "guard/out");
    let frame = observer.until("one", agrees, |_| true);
    assert_eq!(frame.values, [-1.0, 0.0, f64::INFINITY]);
    assert_eq!((frame.flags(), frame.header.source_ns), (Flags::SUBSTITUTE, 0));
    node.wait_for(
        "input \"x\" has no sample yet, because service \"plant/sensor\" has sent no frame",
    );
    let ended = node.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("has no sample yet").count(), 1, "{}", ended.stderr);
    let report = domain.json("guard.toml.json");
    let message = report["warnings"][0]["message"].as_str().unwrap();
    assert!(message.starts_with("input \"x\" was never ok, for "), "{report}");
    assert_eq!(report["tasks"][0]["inputs"][0]["falls"], 0, "{report}");
}

#[test]
fn a_sensor_that_sends_nan_is_rejected_or_an_error_of_the_block_that_reads_it() {
    let domain = Domain::new();
    let text = r#"
[node]
name = "guard"
[[task]]
name = "t"
period = "5ms"
[[input]]
name = "count"
type = "INT"
service = "plant/sensor"
channel = 0
[[input]]
name = "level"
service = "plant/sensor"
channel = 1
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = "level", setChangeRate = inf }
[[output]]
service = "guard/count"
signals = ["count", "count.ok"]
[[output]]
service = "guard/ramp"
signals = ["ramp.delayedValue", "level.ok"]
"#;
    let node = run(&domain, "guard.toml", text);
    let (mut count, mut ramp) =
        (Observer::of(&domain, "guard/count"), Observer::of(&domain, "guard/ramp"));
    let participant = domain.join("sensor");
    let signal = |name: &str| SignalSpec::new(name, "LREAL");
    let layout = FrameLayout { signals: vec![signal("a"), signal("b")], period_ns: None };
    let publisher = FramePublisher::open(&participant, "plant/sensor", &layout).unwrap();
    let mut publisher = publisher.plain();
    let mut send = |values: [f64; 2]| {
        publisher.prepare();
        publisher.values_mut().unwrap().copy_from_slice(&values);
        publisher.send(Stamp::default(), now_ns);
    };
    let mut expect = |values: [f64; 2], count_is: ([f64; 2], Flags), ramp_is: ([f64; 2], Flags)| {
        for (observer, expected) in [(&mut count, count_is), (&mut ramp, ramp_is)] {
            let since = Instant::now();
            loop {
                send(values);
                let frame = observer.until("there", |_| {}, |_| true);
                if (&frame.values[..], frame.flags()) == (&expected.0[..], expected.1) {
                    break;
                }
                assert!(since.elapsed() < PATIENCE, "{:?} {}", frame.values, frame.flags());
            }
        }
    };
    expect([3.0, 2.5], ([3.0, 1.0], Flags::NONE), ([2.5, 1.0], Flags::NONE));
    let nan = [f64::NAN, f64::NAN];
    expect(nan, ([3.0, 0.0], Flags::REJECTED), ([2.5, 1.0], Flags::ERROR));
    expect([4.0, 1.5], ([4.0, 1.0], Flags::NONE), ([1.5, 1.0], Flags::NONE));
    drop(publisher);
    let ended = node.stop().expect_code(0);
    assert!(ended.stderr.contains("input \"count\" rejects NaN, which INT cannot hold"));
}

#[test]
fn the_second_node_of_a_chain_learns_from_the_frames_what_the_first_has_lost() {
    let domain = Domain::new();
    let guard = run(&domain, "guard.toml", GUARD);
    let mut second = run(&domain, "second.toml", SECOND);
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
    let frame = any.flagged(Flags::STALE);
    assert_eq!(frame.values, [7.5, 0.0], "there is no max_age: the end was said");
    second.wait_for("input \"any\" is stale: its publisher of service \"guard/out\" has ended; it keeps its value");
    second.stop().expect_code(0);
    sensor.stop().expect_code(0);
}

#[test]
fn the_last_frame_of_a_node_says_so_however_it_ends() {
    let domain = Domain::new();
    domain.write("guard.toml", GUARD);
    for arguments in ["--cycles 800", ""] {
        let node = domain.start(&format!("run guard.toml {arguments}"));
        let mut observer = Observer::of(&domain, "guard/out");
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

/// Adds what the other node says to a sensor's value.
fn looped(name: &str, other: &str, feedback: bool) -> String {
    format!(
        "[node]\nname = \"{name}\"\n[[task]]\nname = \"t\"\nperiod = \"5ms\"\n\
         [[input]]\nname = \"other\"\nservice = \"loop/{other}\"\nfeedback = {feedback}\n\
         [[input]]\nname = \"x\"\nservice = \"plant/sensor\"\nmax_age = \"500ms\"\n\
         [[output]]\nservice = \"loop/{name}\"\nsignals = [\"other\", \"x\"]\n"
    )
}

#[test]
fn what_goes_round_a_loop_of_nodes_ends_where_one_of_them_says_feedback() {
    let domain = Domain::new();
    let a = run(&domain, "a.toml", &looped("a", "b", true));
    let b = run(&domain, "b.toml", &looped("b", "a", false));
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
    for process in [a, b, sensor] {
        process.stop().expect_code(0);
    }
}

#[test]
fn inputs_of_one_service_change_at_one_frame_together() {
    let domain = Domain::new();
    let text = r#"
[node]
name = "guard"
[[task]]
name = "t"
period = "1ms"
[[input]]
name = "a"
service = "plant/sensor"
channel = 0
[[input]]
name = "b"
service = "plant/sensor"
channel = 1
[[output]]
service = "guard/out"
signals = ["a", "b", "a.ok", "b.ok"]
"#;
    let node = run(&domain, "guard.toml", text);
    let mut observer = Observer::of(&domain, "guard/out");
    let participant = domain.join("sensor");
    let signal = |name: &str| SignalSpec::new(name, "LREAL");
    let layout = FrameLayout { signals: vec![signal("a"), signal("b")], period_ns: None };
    let publisher = FramePublisher::open(&participant, "plant/sensor", &layout).unwrap();
    let mut publisher = publisher.plain();
    let mut seen = std::collections::HashSet::new();
    let since = Instant::now();
    for count in 0_u64.. {
        publisher.prepare();
        publisher.values_mut().unwrap().copy_from_slice(&[count as f64, count as f64]);
        publisher.send(Stamp::default(), now_ns);
        while let Some(Frame { values, .. }) = observer.next() {
            assert_eq!((values[0], values[2]), (values[1], values[3]));
            seen.insert(values[0].to_bits());
        }
        if seen.len() > 300 {
            break;
        }
        assert!(since.elapsed() < PATIENCE, "{} values", seen.len());
    }
    drop(publisher);
    node.stop().expect_code(0);
}

#[test]
fn a_wired_ok_takes_the_example_to_its_safe_value_and_back() {
    let domain = Domain::new();
    let text = include_str!("../../examples/dead_sensor.toml");
    let node = run(&domain, "dead_sensor.toml", text);
    let mut shown = domain.start("subscribe plant/safe_level");
    let first = sensor(&domain, "1.5");
    shown.wait_for("safe.outputValue=1.5 level=1.5 level.ok=TRUE");
    first.kill();
    shown.wait_for("safe.outputValue=0.0 level=1.5 level.ok=FALSE");
    shown.wait_for("STALE");
    let mut observer = Observer::of(&domain, "plant/safe_level");
    let second = sensor(&domain, "1.0");
    observer.until("back", |_| {}, |frame| frame.values[..3] == [1.0, 1.0, 1.0]);
    for process in [node, second, shown] {
        process.stop().expect_code(0);
    }
}
