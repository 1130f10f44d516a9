//! Publishers that lie, fight or die: what a node and a subscriber make of them.

use std::process::Command;
use std::thread;
use std::time::Duration;

use iceoryx2::prelude::ipc;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{FrameHeader, is_stopped};
use isochrone_testing::plants::{counter, relay_with};
use isochrone_testing::{Domain, Process, not_tested, wait_until};
use rustix::process::Signal;
use serde_json::Value;

fn configuration() -> String {
    relay_with("default = -1.0\nmax_age = \"100ms\"\non_stale = \"default\"")
}

fn relay(domain: &Domain) -> (Process, Process) {
    let node = domain.start_node("node.toml", &configuration(), "--report node.json");
    let observer = domain.start_until("subscribe relay/out", "x=-1.0");
    (node, observer)
}

/// Starts the program with at most so many file descriptors.
fn start_limited(domain: &Domain, descriptors: u32, arguments: &str) -> Process {
    let script = format!("ulimit -n {descriptors}; exec \"$0\" \"$@\"");
    domain.start_by(&["sh", "-c", &script], arguments)
}

/// Lets one send frames of one value, a millisecond apart.
fn send_plain(domain: &Domain, frames: u64, mut frame: impl FnMut(u64) -> (FrameHeader, f64)) {
    let port = domain.plain_writer::<ipc::Service>("relay/in");
    for index in 0..frames {
        let mut sample = port.loan_slice(1).unwrap();
        (*sample.user_header_mut(), sample.payload_mut()[0]) = frame(index);
        sample.send().unwrap();
        thread::sleep(Duration::from_millis(1));
    }
}

/// The header of a frame that is sent now.
fn now(sequence: u64) -> FrameHeader {
    FrameHeader { sequence, publish_ns: Monotonic.now_ns(), ..FrameHeader::default() }
}

/// Whether the newest frame has the default in place of a sample, and says so.
fn is_default_again(stdout: &str) -> bool {
    stdout
        .lines()
        .last()
        .is_some_and(|frame| frame.contains("x=-1.0  [") && frame.contains("SUBSTITUTE"))
}

fn link(domain: &Domain) -> Value {
    domain.json("node.json")["links"][0].clone()
}

fn number(value: &Value, key: &str) -> u64 {
    value[key].as_u64().unwrap_or_default()
}

#[test]
fn a_value_from_the_future_goes_stale_when_its_publisher_dies() {
    for publish_ns in [u64::MAX, Monotonic.now_ns() + 1_000_000_000_000] {
        let domain = Domain::new();
        let (mut node, mut observer) = relay(&domain);
        send_plain(&domain, 100, |sequence| {
            (FrameHeader { sequence, publish_ns, ..FrameHeader::default() }, 9.0)
        });
        observer.wait_until("9 and then the default again", |stdout, _| {
            stdout.contains("x=9.0") && is_default_again(stdout)
        });
        node.wait_for("in the future, so its publisher has another clock");
        observer.stop().expect_code(0);
        node.stop().expect_code(0);
        assert!(number(&link(&domain), "future_stamps") > 0, "{}", link(&domain));
        let report = domain.json("node.json");
        assert_eq!(report["warnings"][0]["code"], "future_stamps", "{report}");
    }
}

#[test]
fn a_publisher_whose_clock_is_ahead_is_read_while_it_lives_and_stale_when_it_is_killed() {
    let probe = Command::new("unshare").args(["-T", "--monotonic", "1000", "true"]).output();
    if !probe.is_ok_and(|probe| probe.status.success()) {
        return not_tested("a clock that is ahead", "no time namespace can be had");
    }
    let domain = Domain::new();
    let (mut node, mut observer) = relay(&domain);
    let ahead = ["unshare", "-T", "--monotonic", "1000"];
    let publisher = domain.start_by(&ahead, "publish relay/in --value 9");
    observer.wait_for("x=9.0");
    node.wait_for("in the future, so its publisher has another clock");
    let stats = domain.start_until("subscribe relay/in --stats --json", "in the future");
    let stats = stats.stop().expect_code(0);
    let report = stats.json();
    let link = &report["links"][0];
    assert_eq!(link["one_way_ns"]["count"], 0, "no latency is made up: {link}");
    assert_eq!(number(link, "future_stamps"), number(link, "frames"));
    publisher.kill();
    observer.wait_until("the default again", |stdout, _| is_default_again(stdout));
}

#[test]
fn stamps_from_the_past_are_stale_and_the_clock_is_named() {
    let domain = Domain::new();
    let (mut node, observer) = relay(&domain);
    // A thousand seconds behind, as far as the clock has run for so long.
    let behind = |sequence| {
        let publish_ns = (Monotonic.now_ns() / 2).max(1);
        (FrameHeader { sequence, publish_ns, ..FrameHeader::default() }, 9.0)
    };
    send_plain(&domain, 100, behind);
    node.wait_for("has another clock or was held up");
    assert!(!observer.stop().expect_code(0).stdout.contains("x=9.0"));
    let ended = node.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("held up").count(), 1, "{}", ended.stderr);
    assert!(number(&link(&domain), "past_stamps") > 0, "{}", link(&domain));
}

#[test]
fn a_second_writer_is_told_and_counted_and_its_frames_are_no_loss() {
    let domain = Domain::new();
    let (mut node, mut observer) = relay(&domain);
    let publisher = domain.start("publish relay/in --value 1");
    observer.wait_for("x=1.0");
    // It began earlier and is far ahead in its count.
    send_plain(&domain, 300, |index| (now(7_000_000 + index), 2.0));
    node.wait_for("has a second publisher");
    let printed = observer.stop().expect_code(0).stdout;
    publisher.stop().expect_code(0);
    node.stop().expect_code(0);
    let link = link(&domain);
    assert!(number(&link, "other_writers") > 0, "{link}");
    assert!(number(&link, "lost") < 10_000, "{link}");
    // Whoever comes first is followed, but nobody goes back from the node with a term.
    let last_other = printed.rfind("x=2.0").unwrap_or_default();
    assert!(last_other < printed.rfind("x=1.0").unwrap(), "{printed}");
}

#[test]
fn a_service_is_taken_from_a_living_plain_writer_only_where_that_is_asked_for() {
    let domain = Domain::new();
    let (_node, _observer) = relay(&domain);
    domain.write("sender.toml", counter("sender", "2ms").replace("plant/sender", "relay/in"));
    let plain = domain.plain_writer::<ipc::Service>("relay/in");
    let own = format!("pid {}", std::process::id());
    let starts = ["publish relay/in --value 1 --count 1", "run sender.toml --cycles 5"];
    for start in starts {
        domain.expect(
            start,
            1,
            &["\"relay/in\" is written by", &own, "end that one", "(--take-over"],
        );
        domain.run(&format!("{start} --take-over")).expect_code(0);
    }
    drop(plain);
    for start in starts {
        domain.run(start).expect_code(0);
    }
}

#[test]
fn of_a_writer_that_is_stopped_it_is_said_so_with_how_to_go_on() {
    let domain = Domain::new();
    let publisher = domain.publish("relay/in --value 1");
    publisher.signal(Signal::STOP);
    wait_until("it is stopped", || is_stopped(publisher.id()));
    let way_out = format!("which is stopped (kill -CONT {} continues it", publisher.id());
    let start = "publish relay/in --value 1 --count 1 --take-over";
    domain.expect(start, 1, &[&way_out, "only one that is not of isochrone can be taken over"]);
    publisher.signal(Signal::CONT);
    publisher.stop().expect_code(0);
}

#[test]
fn a_sequence_that_alternates_between_its_ends_is_restarts_and_never_a_loss() {
    // A busy machine may keep the node from most of the frames.
    let mut restarts = 0;
    for _ in 0..20 {
        let domain = Domain::new();
        let (node, observer) = relay(&domain);
        send_plain(&domain, 300, |index| (now(if index % 2 == 0 { 0 } else { u64::MAX }), 3.0));
        observer.stop().expect_code(0);
        node.stop().expect_code(0);
        let link = link(&domain);
        assert_eq!(number(&link, "lost"), 0, "{link}");
        restarts += number(&link, "restarts");
        if restarts > 50 {
            return;
        }
    }
    panic!("{restarts} restarts in twenty runs");
}

#[test]
fn frames_whose_layout_nobody_announces_all_count_at_the_end_of_a_subscriber() {
    let domain = Domain::new();
    let (_node, _observer) = relay(&domain);
    let subscriber = domain.start_until("subscribe relay/in --count 20", "subscribed to");
    send_plain(&domain, 1000, |sequence| (FrameHeader { layout: 7, ..now(sequence) }, 3.0));
    let ended = subscriber.finish().expect_code(0);
    assert_eq!(ended.stdout.lines().count(), 20);
    assert!(ended.stderr.contains("20 frames, "), "{}", ended.stderr);
}

#[test]
fn a_publisher_that_restarts_is_one_restart_in_the_report_of_the_node() {
    let domain = Domain::new();
    let (node, mut observer) = relay(&domain);
    for value in ["1", "2", "3"] {
        let publisher = domain.start(&format!("publish relay/in --value {value}"));
        observer.wait_for(&format!("x={value}.0"));
        match value {
            "2" => publisher.kill(),
            _ => drop(publisher.stop().expect_code(0)),
        }
    }
    observer.stop().expect_code(0);
    node.stop().expect_code(0);
    let link = link(&domain);
    assert_eq!(number(&link, "restarts"), 2, "{link}");
    assert_eq!(number(&link, "other_writers"), 0, "{link}");
}

#[test]
fn subscribers_that_a_publisher_cannot_connect_to_say_so_and_fail() {
    let domain = Domain::new();
    let mut publisher = start_limited(&domain, 22, "publish relay/in --value 1");
    publisher.wait_for("publishing");
    // On a busy machine fifteen that run for seconds may not run at once.
    let has_failed = |seconds: u32| {
        let start =
            |_| domain.start(&format!("subscribe relay/in --seconds {seconds} --every 1000"));
        let subscribers: Vec<_> = (0..15).map(start).collect();
        let mut failed = 0;
        for subscriber in subscribers {
            let ended = subscriber.finish();
            match ended.status.code() {
                Some(0) => assert!(!ended.stdout.is_empty(), "{}", ended.stderr),
                Some(1) => {
                    assert_eq!(ended.stdout, "");
                    for part in ["has a publisher, but nothing of it arrived", "file descriptors"] {
                        assert!(ended.stderr.contains(part), "{part}: {}", ended.stderr);
                    }
                    failed += 1;
                }
                // Its time may be up before it has looked for long.
                Some(3) => assert!(ended.stderr.contains("relay/in"), "{}", ended.stderr),
                code => panic!("{code:?}: {}", ended.stderr),
            }
        }
        failed > 0
    };
    let found = [8, 30, 90].into_iter().any(has_failed);
    assert!(found, "22 file descriptors were enough for fifteen subscribers");
    drop(publisher);
}

#[test]
fn a_subscriber_with_few_descriptors_has_the_names_of_its_values_or_says_which_limit_to_raise() {
    let domain = Domain::new();
    let _publisher = domain.start("publish relay/in --value 1 --signals level");
    let (mut named, mut told) = (0, 0);
    for descriptors in 12..=26 {
        let mut process = start_limited(&domain, descriptors, "subscribe relay/in --count 3");
        let why = format!("too many open files: the limit is {descriptors}, raise it (ulimit -n)");
        process.wait_until("names, or which limit to raise", |stdout, stderr| {
            stdout.contains("level=1.0") || stderr.contains(&why)
        });
        let has_names = process.stop().stdout.contains("level=1.0");
        named += u32::from(has_names);
        told += u32::from(!has_names);
    }
    assert!(named > 0 && told > 0, "{named} limits were high enough, and {told} too low");
}

#[test]
fn a_subscriber_without_file_descriptors_says_so_and_fails() {
    let domain = Domain::new();
    let publisher = domain.start("publish relay/in --value 1");
    let mut fails = 0;
    for descriptors in [9, 12, 15] {
        let ended = start_limited(&domain, descriptors, "subscribe relay/in --count 5").finish();
        match ended.status.code() {
            Some(0) => assert_eq!(ended.stdout.lines().count(), 5),
            Some(1) => assert!(!ended.stderr.contains("0 lost"), "{}", ended.stderr),
            code => panic!("{code:?}: {}", ended.stderr),
        }
        fails += u32::from(ended.stdout.is_empty());
    }
    publisher.stop().expect_code(0);
    assert!(fails > 0, "9 file descriptors were enough");
}
