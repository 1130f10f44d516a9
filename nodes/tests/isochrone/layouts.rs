//! Frames that explain themselves: inputs bound by names, layouts that change, readers that wait.

use iceoryx2::prelude::ipc;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{FrameHeader, FrameLayout, LayoutAnnouncer, SignalSpec};
use isochrone_testing::plants::{relay_with, tank};
use isochrone_testing::{Domain, Plant, Process, wait_until};
use serde_json::Value;

/// Publishes two signals, in an order that a test chooses.
fn two_signals() -> Plant {
    Plant::new("sender")
        .task("t", "2ms")
        .ramp("four", "defaultOutValue = 4.0, enDefaultOutValue = true")
        .ramp("seven", "defaultOutValue = 7.0, enDefaultOutValue = true")
        .output("sender/out", &["four.delayedValue", "seven.delayedValue"])
}

/// The node `relay`, which reads the second of them by its name: `sender/out` to `relay/out`.
fn reader() -> String {
    relay_with("signal = \"seven.delayedValue\"\ndefault = -1.0").replace("relay/in", "sender/out")
}

const SIGNALS: &str = "[\"four.delayedValue\", \"seven.delayedValue\"]";

fn observer(domain: &Domain) -> Process {
    domain.start_until("subscribe relay/out", "x=")
}

fn codes(report: &Value) -> Vec<&str> {
    let warnings = report["warnings"].as_array().unwrap();
    warnings.iter().map(|warning| warning["code"].as_str().unwrap()).collect()
}

#[test]
fn a_node_comes_back_with_other_outputs_while_its_subscriber_waits() {
    let domain = Domain::new();
    let sender = domain.start_node("sender.toml", &two_signals(), "");
    let mut observer =
        domain.start_until("subscribe sender/out", "four.delayedValue=4.0 seven.delayedValue=7.0");
    sender.stop().expect_code(0);
    let reordered =
        two_signals().replace(SIGNALS, "[\"seven.delayedValue\", \"four.delayedValue\"]");
    let _sender = domain.start_node("sender.toml", &reordered, "");
    observer.wait_for("has changed, and now carries seven.delayedValue, four.delayedValue");
    observer.wait_for("seven.delayedValue=7.0 four.delayedValue=4.0");
    let printed = observer.stop().expect_code(0).stdout;
    // No line has the values of one layout under the names of the other.
    assert!(!printed.contains("four.delayedValue=7.0"), "{printed}");
}

#[test]
fn an_input_whose_channel_carries_another_signal_from_now_on_says_so() {
    let domain = Domain::new();
    let by_channel = reader().replace("signal = \"seven.delayedValue\"", "channel = 0");
    let mut reader = domain.start_node("reader.toml", &by_channel, "--report reader.json");
    let mut observer = observer(&domain);
    let sender = domain.start_node("sender.toml", &two_signals(), "");
    observer.wait_for("x=4.0");
    sender.stop().expect_code(0);
    let reordered =
        two_signals().replace(SIGNALS, "[\"seven.delayedValue\", \"four.delayedValue\"]");
    let sender = domain.start_node("sender.toml", &reordered, "");
    observer.wait_for("x=7.0");
    reader.wait_for("which was \"four.delayedValue\" and is \"seven.delayedValue\" now");
    observer.stop().expect_code(0);
    sender.stop().expect_code(0);
    reader.stop().expect_code(0);
    assert_eq!(codes(&domain.json("reader.json")), ["moved_channel", "input_not_ok"]);
}

#[test]
fn a_recording_goes_on_with_another_header_where_the_layout_changes() {
    let domain = Domain::new();
    let sender = domain.start_node("sender.toml", &two_signals(), "");
    let mut observer = domain.start_until(
        "subscribe sender/out --csv out.csv",
        "carries four.delayedValue, seven.delayedValue (from \"sender\")",
    );
    sender.stop().expect_code(0);
    let more =
        two_signals().replace(SIGNALS, "[\"seven.delayedValue\", \"seven.error\", \"four.error\"]");
    let sender = domain.start_node("sender.toml", &more, "");
    observer.wait_for("has changed, and now carries seven.delayedValue, seven.error, four.error");
    observer.stop().expect_code(0);
    sender.stop().expect_code(0);
    let recording = domain.read("out.csv");
    let heads: Vec<&str> = recording.lines().filter(|row| row.starts_with("time_s")).collect();
    assert_eq!(
        heads,
        [
            "time_s,cycle,four.delayedValue,seven.delayedValue",
            "time_s,cycle,seven.delayedValue,seven.error,four.error"
        ]
    );
    let mut columns = 0;
    for row in recording.lines() {
        if row.starts_with("time_s") {
            columns = row.split(',').count();
        }
        assert_eq!(row.split(',').count(), columns, "{row}");
    }
}

#[test]
fn a_reader_that_comes_first_finds_its_signal_by_name_wherever_that_moves() {
    let domain = Domain::new();
    let reader = domain.start_node("reader.toml", &reader(), "--report reader.json");
    let mut observer = observer(&domain);
    observer.wait_for("x=-1.0");
    let moved = "[\"seven.delayedValue\", \"four.delayedValue\", \"four.error\"]";
    // The second sender's value is another one, so that it is not taken for what the first one has sent.
    for (order, value) in [(SIGNALS, "7.0"), (moved, "8.0")] {
        let text = two_signals().replace(SIGNALS, order).replace("7.0", value);
        let _sender = domain.start_node("sender.toml", &text, "");
        observer.wait_for(&format!("x={value}"));
    }
    let printed = observer.stop().expect_code(0).stdout;
    assert!(!printed.contains("x=4.0"), "a frame was read as if it were another: {printed}");
    reader.stop().expect_code(0);
    let report = domain.json("reader.json");
    assert_eq!(codes(&report), ["input_not_ok"], "the senders ended: {report}");
    assert_eq!(report["links"][0]["restarts"], 1, "{report}");
}

#[test]
fn what_does_not_fit_is_an_alarm_that_names_both_sides_and_not_the_end_of_the_node() {
    for (from, to, parts) in [
        ("seven.delayedValue\"\n", "eight.y\"\n", ["no signal \"eight.y\"", "four.delayedValue"]),
        ("signal = \"seven.delayedValue\"", "channel = 5", ["2 channels", "6 are needed"]),
        ("default = -1.0", "type = \"BOOL\"", ["carries LREAL", "BOOL is needed"]),
    ] {
        let (domain, _sender) = tank(&two_signals());
        let text = reader().replace(from, to);
        let mut reader = domain.start_node("reader.toml", &text, "--report reader.json");
        reader.wait_for("cannot read service \"sender/out\" of \"sender\"");
        let mut observer = observer(&domain);
        observer.wait_for("x=");
        observer.stop().expect_code(0);
        let ended = reader.stop().expect_code(0);
        for part in parts.into_iter().chain(["input \"x\""]) {
            assert!(ended.stderr.contains(part), "{part}: {}", ended.stderr);
        }
        let told = ended.stderr.matches("cannot read service").count();
        assert_eq!(told, 1, "once, and not every cycle: {}", ended.stderr);
        let report = domain.json("reader.json");
        // On a busy machine the input may also have been without a value for long enough to be told.
        let codes = codes(&report).into_iter().filter(|code| *code != "input_not_ok");
        assert_eq!(codes.collect::<Vec<_>>(), ["unfit_input"], "{report}");
        assert!(report["tasks"][0]["input_rejects"].as_u64() > Some(0), "{report}");
    }
}

#[test]
fn an_input_that_did_not_fit_is_read_once_its_publisher_comes_back_with_what_it_wants() {
    let (domain, mut reader) = tank(&reader());
    let only = two_signals().replace(SIGNALS, "[\"four.delayedValue\"]");
    let sender = domain.start_node("sender.toml", &only, "");
    reader.wait_for("no signal \"seven.delayedValue\"");
    sender.stop().expect_code(0);
    let sender = domain.start_node("sender.toml", &two_signals(), "");
    reader.wait_for("reads service \"sender/out\" again");
    let mut observer = observer(&domain);
    observer.wait_for("x=7.0");
    for process in [observer, sender] {
        process.stop().expect_code(0);
    }
    let told = reader.stop().expect_code(0).stderr;
    let again = told.lines().find(|line| line.contains("reads service")).unwrap();
    assert!(again.contains("INFO"), "what is well again is no warning: {told}");
}

#[test]
fn a_publisher_may_come_back_with_other_columns_while_its_subscriber_waits() {
    let domain = Domain::with(&[("xy.csv", "x,y\n1,2\n"), ("yx.csv", "y,x\n2,1\n")]);
    let first = domain.publish("some/where --csv xy.csv --count 100000");
    let mut observer = domain.start_until("subscribe some/where", "x=1.0 y=2.0");
    first.stop().expect_code(0);
    let _second = domain.start("publish some/where --csv yx.csv --count 100000");
    observer.wait_for("y=2.0 x=1.0");
}

#[test]
fn telemetry_has_names_for_an_observer_that_waited_for_the_node() {
    let domain = Domain::new();
    let mut observer = domain.start("subscribe isochrone/sender/telemetry");
    let sender = domain.start_node("sender.toml", &two_signals(), "");
    observer.wait_for("four.delayedValue=4.0");
    observer.wait_for("task.t.cycle=");
    observer.stop().expect_code(0);
    sender.stop().expect_code(0);
    domain.expect_no_leftovers();
}

#[test]
fn a_chain_of_two_nodes_shows_the_whole_age_and_the_last_hop() {
    let domain = Domain::new();
    // The second node reads what the first one sends every 50 ms; the publisher sends once.
    let first = reader()
        .replace("\"relay\"", "\"first\"")
        .replace("signal = \"seven.delayedValue\"", "signal = \"x\"")
        .replace("sender/out", "chain/in")
        .replace("relay/out", "chain/middle");
    let second = first
        .replace("\"first\"", "\"second\"")
        .replace("chain/middle", "chain/out")
        .replace("chain/in", "chain/middle");
    domain.write("in.csv", "x\n1\n");
    let _first = domain.start_node("first.toml", &first.replace("2ms", "50ms"), "");
    let _second = domain.start_node("second.toml", &second, "");
    let mut observer = domain.start_until("subscribe chain/out --every 20", "x=-1.0");
    domain.run("publish chain/in --csv in.csv --rate 20 --count 3").expect_code(0);
    observer.wait_for("x=1.0");
    std::thread::sleep(std::time::Duration::from_millis(300));
    let ended = domain.run("subscribe chain/out --stats --json --count 50").expect_code(0);
    let report = ended.json();
    let link = &report["links"][0];
    let (hop, whole) = (&link["one_way_ns"], &link["end_to_end_ns"]);
    assert_eq!((&hop["count"], &whole["count"]), (&50.into(), &50.into()), "{link}");
    // The sample is as old as its publisher made it, although the node before sent it just now.
    assert!(whole["min"].as_u64() > Some(300_000_000), "{link}");
    assert!(hop["p50"].as_u64() < whole["min"].as_u64(), "{link}");
}

#[test]
fn a_frame_that_is_shorter_than_its_announced_layout_is_told_from_one_whose_layout_is_unknown() {
    let (domain, _node) = tank(&relay_with("signal = \"b\""));
    let participant = domain.join("short");
    let signals = ["a", "b"].map(|name| SignalSpec::new(name, "LREAL")).to_vec();
    let layout = FrameLayout { signals, period_ns: None };
    let mut announcer = None;
    let port = domain.plain_writer::<ipc::Service>("relay/in");
    let mut sequence = 0;
    let mut wait_for_reason = |reason: &str, announcer: &mut Option<LayoutAnnouncer<_>>| {
        wait_until(reason, || {
            let mut frame = port.loan_slice(1).unwrap();
            let (layout, publish_ns) = (layout.number(), Monotonic.now_ns());
            *frame.user_header_mut() =
                FrameHeader { sequence, publish_ns, layout, ..FrameHeader::default() };
            frame.send().unwrap();
            sequence += 1;
            announcer.iter_mut().for_each(|it| it.tend(&participant));
            // A look at the alarms takes long.
            sequence % 50 == 0 && domain.run("alarms relay").expect_code(0).stdout.contains(reason)
        });
    };
    wait_for_reason("have a layout that nobody announces", &mut announcer);
    announcer = Some(LayoutAnnouncer::open(&participant, "relay/in", "short", &layout).unwrap());
    let reason = "takes no sample: it reads channel 1, counted from 0, and the frames of service \"relay/in\" have \
                  1 value; have their publisher send as many values as it announces";
    wait_for_reason(reason, &mut announcer);
}
