//! Peers that are absent, come late, leave, restart or are killed; and peers that do not fit.

use crate::plant::{Frame, Observer, Source};
use iceoryx2::prelude::{NodeBuilder, ServiceName, ipc};
use isochrone_ipc::{Depth, Flags, FrameSubscriber};
use isochrone_testing::plants::{relay_with, tank};
use isochrone_testing::{Domain, Process};
use rustix::process::Resource;

/// Passes its input on. What the subscriber prints shows what the node saw.
fn configuration() -> String {
    relay_with("default = -1.0")
}

fn relay() -> (Domain, Process) {
    let (domain, node) = tank(&configuration());
    (domain, node)
}

/// A subscriber of the node's output that is connected.
fn observer(domain: &Domain) -> Process {
    domain.start_until("subscribe relay/out", "x=")
}

fn publisher(domain: &Domain, value: &str) -> Process {
    domain.publish(&format!("relay/in --rate 200 --value {value}"))
}

#[test]
fn a_node_runs_on_its_defaults_until_a_publisher_comes() {
    let (domain, node) = relay();
    let mut observer = observer(&domain);
    observer.wait_for("x=-1.0");
    let publisher = publisher(&domain, "4.5");
    observer.wait_for("x=4.5");
    publisher.stop().expect_code(0);
    observer.stop().expect_code(0);
    node.stop().expect_code(0);
    domain.expect_no_leftovers();
}

#[test]
fn peers_may_start_in_any_order() {
    let domain = Domain::new();
    let mut observer = domain.start("subscribe relay/out");
    let publisher = publisher(&domain, "7");
    let node = domain.start_node("node.toml", &configuration(), "");
    observer.wait_for("x=7.0");
    for process in [observer, node, publisher] {
        process.stop().expect_code(0);
    }
    domain.expect_no_leftovers();
}

#[test]
fn a_publisher_that_was_killed_is_replaced_without_a_restart_of_the_node() {
    let (domain, node) = relay();
    let mut observer = observer(&domain);
    for value in 1..4 {
        let publisher = publisher(&domain, &value.to_string());
        observer.wait_for(&format!("x={value}.0"));
        publisher.kill();
    }
    observer.stop().expect_code(0);
    node.stop().expect_code(0);
    // The last publisher's remains go with the next process that joins.
    domain.run("subscribe relay/out --seconds 0.1").expect_code(3);
    domain.expect_no_leftovers();
}

#[test]
fn a_node_that_was_killed_while_it_started_starts_again() {
    let domain = Domain::with(&[("node.toml", &configuration())]);
    // From the first file to the first frame takes some milliseconds; every moment of it counts.
    for delay_us in (0..60).map(|step| 1000 + step * 150) {
        let node = domain.start("run node.toml");
        std::thread::sleep(std::time::Duration::from_micros(delay_us));
        node.kill();
    }
    domain.run("run node.toml --cycles 5").expect_code(0);
    domain.run("run node.toml --cycles 5").expect_code(0);
}

#[test]
fn subscribers_that_are_killed_neither_hold_up_the_node_nor_use_up_its_places() {
    let (domain, _node) = relay();
    // More than a service has places for.
    for _ in 0..20 {
        observer(&domain).kill();
    }
    observer(&domain).stop().expect_code(0);
}

#[test]
fn a_connection_that_failed_comes_about_once_its_cause_has_passed() {
    let domain = Domain::new();
    let mut node = domain.start_node("node.toml", &configuration(), "--report node.json");
    // Without a free file descriptor a port can open no shared memory.
    node.limit(Resource::Nofile, Some(1));
    let mut observer = domain.start("subscribe relay/out");
    node.wait_for("a connection to a subscriber of service \"relay/out\" keeps failing");
    node.limit(Resource::Nofile, None);
    observer.wait_for("x=-1.0");

    node.limit(Resource::Nofile, Some(1));
    let publisher = publisher(&domain, "4.5");
    node.wait_for("a connection to a publisher of service \"relay/in\" keeps failing");
    node.limit(Resource::Nofile, None);
    observer.wait_for("x=4.5");

    for process in [publisher, observer, node] {
        process.stop().expect_code(0);
    }
    let failed = domain.json("node.json")["tasks"][0]["connect_errors"].as_u64().unwrap();
    assert!(failed >= 2, "{failed} connections failed; there were to be two at least");
    domain.expect_no_leftovers();
}

#[test]
fn a_connection_comes_about_also_where_all_places_of_the_service_are_taken() {
    let (domain, mut node) = relay();
    let crowd = domain.join("crowd");
    let join = || FrameSubscriber::open_existing(&crowd, "relay/out", Depth::Newest);
    let readers: Vec<_> = (0..15).map(|_| join().unwrap().unwrap()).collect();
    node.limit(Resource::Nofile, Some(1));
    let mut observer = domain.start_until("subscribe relay/out", "subscribed");
    let full = join().unwrap_err().to_string();
    assert!(full.contains("no place for another subscriber"), "{full}");
    node.wait_for("a connection to a subscriber of service \"relay/out\" keeps failing");
    node.limit(Resource::Nofile, None);
    observer.wait_for("x=-1.0");

    drop(readers);
    drop(crowd);
    observer.stop().expect_code(0);
    node.stop().expect_code(0);
    domain.expect_no_leftovers();
}

#[test]
fn a_node_that_was_killed_starts_again_and_its_peers_carry_on() {
    let (domain, node) = relay();
    let publisher = publisher(&domain, "3");
    let mut observer = observer(&domain);
    observer.wait_for("x=3.0");
    node.kill();
    let node = domain.start_node("node.toml", &configuration(), "--report node.json");
    let seen = std::cell::Cell::new(0);
    observer.wait_until("frames of the second node", |stdout, _| {
        // The second node's sequence begins anew.
        seen.set(stdout.lines().filter(|line| line.trim_start().starts_with("5 ")).count());
        seen.get() >= 1 && stdout.lines().last().is_some_and(|line| line.contains("x=3.0"))
    });
    for process in [observer, node, publisher] {
        process.stop().expect_code(0);
    }
    domain.expect_no_leftovers();
}

#[test]
fn a_second_node_on_the_same_service_is_refused_and_told_who_has_it() {
    let (domain, node) = relay();
    let mut observer = observer(&domain);
    domain.write("other.toml", configuration().replace("\"relay\"", "\"other\""));
    for (file, says) in [("other", "\"relay/out\""), ("tank", "node \"relay\" runs already")] {
        domain.expect(&format!("run {file}.toml"), 1, &[says, "isochrone/relay"]);
    }
    domain.write("more.csv", "x\n1\n");
    domain.expect("publish relay/out --csv more.csv", 1, &["isochrone/relay"]);
    observer.wait_for("x=-1.0");
    observer.stop().expect_code(0);
    node.stop().expect_code(0);
    domain.expect_no_leftovers();
}

#[test]
fn a_service_of_another_type_is_refused_with_both_sides_named() {
    let domain = Domain::with(&[("node.toml", &configuration())]);
    let other = NodeBuilder::new().config(domain.config()).create::<ipc::Service>().unwrap();
    let name = ServiceName::new("relay/in").unwrap();
    let service = other.service_builder(&name).publish_subscribe::<u64>().create().unwrap();
    domain.expect("run node.toml", 1, &["relay/in", "u64", "f64", "isochrone.FrameHeader.v2"]);
    domain.expect("subscribe relay/in", 1, &["u64"]);
    drop(service);
}

#[test]
fn samples_that_the_type_cannot_hold_are_rejected_counted_and_leave_the_last_good_value() {
    let domain = Domain::new();
    let node = configuration().replace("default = -1.0", "default = -1\ntype = \"INT\"");
    let node = domain.start_node("node.toml", &node, "--report node.json");
    let mut observer = Observer::of(&domain, "relay/out");
    let mut source = Source::open(&domain, "relay/in", &["x"]);
    let is_good = |frame: &Frame| (frame.values[0], frame.flags()) == (5.0, Flags::NONE);
    source.send(&[5.0]);
    observer.until("the good value", |_| {}, is_good);
    // A node reads the newest frame only: each is sent when the one before has been read.
    let keeps = |frame: &Frame| assert_eq!(frame.values, [5.0]);
    let is_rejected = |frame: &Frame| frame.flags() == Flags::REJECTED;
    for bad in [1.5, f64::NAN, 40_000.0, -32_769.0, f64::INFINITY] {
        source.send(&[bad]);
        observer.until("a rejection", keeps, is_rejected);
        source.send(&[5.0]);
        observer.until("the good value again", keeps, is_good);
    }
    drop(source);
    node.stop().expect_code(0);
    let rejects = domain.json("node.json")["tasks"][0]["input_rejects"].as_u64().unwrap();
    assert_eq!(rejects, 5);
}

#[test]
fn a_stale_input_holds_or_falls_back_as_configured() {
    for (on_stale, last) in [("hold", "x=9.0"), ("default", "x=-1.0")] {
        let domain = Domain::new();
        let stale = format!("default = -1.0\nmax_age = \"100ms\"\non_stale = \"{on_stale}\"");
        let text = configuration().replace("default = -1.0", &stale);
        let node = domain.start_node("node.toml", &text, "");
        let mut observer = observer(&domain);
        let publisher = publisher(&domain, "9");
        observer.wait_for("x=9.0");
        publisher.stop().expect_code(0);
        let frames = |stdout: &str| stdout.lines().count();
        let ended = std::cell::Cell::new(0);
        observer.wait_until("200 more frames", |stdout, _| {
            ended.set(if ended.get() == 0 { frames(stdout) } else { ended.get() });
            frames(stdout) > ended.get() + 200
        });
        node.stop().expect_code(0);
        let stdout = observer.stop().expect_code(0).stdout;
        let frame = stdout.lines().last().unwrap();
        let values = frame.split("  [").next().unwrap();
        assert!(values.ends_with(last), "{on_stale}: {frame}");
    }
}
