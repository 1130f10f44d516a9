//! How a process ends on signals: in order on the first, whatever comes along with it; at once on
//! another when it hangs.

use std::io::PipeReader;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use isochrone_testing::plants::RELAY;
use isochrone_testing::{
    Domain, Process, afresh, not_tested, shared_memory, volume, wait_for_some, wait_until,
};
use rustix::process::{Pid, Signal, kill_process};

/// A publisher, a node and a subscriber are ended at the same time, each with these signals: the
/// pause follows the first.
fn end_all_in_order(signals: &[Signal], pause: impl Fn(u64) -> Duration) {
    let domain = Domain::new();
    for round in 0..volume(100) as u64 {
        let node = domain.start_node("relay.toml", RELAY, "");
        let mut publisher = domain.start("publish relay/in --value 1");
        let subscriber = domain.start_until("subscribe relay/out", "x=");
        publisher.wait_for("publishing");
        let processes = [subscriber, node, publisher];
        for signal in signals {
            processes.iter().for_each(|process| process.signal(*signal));
            thread::sleep(pause(round));
        }
        for (process, summary) in
            processes.into_iter().zip([" lost", "release jitter", "published"])
        {
            let ended = process.finish().expect_code(0);
            assert!((ended.stdout + &ended.stderr).contains(summary), "{signals:?}: {summary}");
        }
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new(), "{signals:?} in round {round}");
    }
}

#[test]
fn one_sigint_ends_in_order() {
    end_all_in_order(&[Signal::INT], |_| Duration::ZERO);
}

#[test]
fn one_sigterm_ends_in_order() {
    end_all_in_order(&[Signal::TERM], |_| Duration::ZERO);
}

#[test]
fn two_sigints_in_quick_succession_are_one_request() {
    end_all_in_order(&[Signal::INT; 2], |round| Duration::from_micros(round % 10 * 800));
}

#[test]
fn a_sigterm_and_a_sigint_at_the_same_instant_are_one_request() {
    end_all_in_order(&[Signal::TERM, Signal::INT], |_| Duration::ZERO);
}

#[test]
fn a_signal_when_the_time_is_up_already_does_not_end_a_process_at_once() {
    let domain = Domain::new();
    for after_ms in (190..230).step_by(40 / volume(40)) {
        let publisher = domain.publish("relay/in --value 1 --seconds 0.2");
        thread::sleep(Duration::from_millis(after_ms));
        // Unless it has ended: it is not waited for yet, so its id is nobody else's.
        publisher.signal(Signal::TERM);
        publisher.finish().expect_code(0);
        domain.expect_no_leftovers();
    }
}

#[test]
fn signals_that_a_process_was_started_to_ignore_do_not_end_it() {
    let domain = Domain::with(&[("relay.toml", RELAY)]);
    for (signal, name) in [(Signal::HUP, "HUP"), (Signal::INT, "INT")] {
        let ignoring = format!("trap '' {name}; exec \"$0\" \"$@\"");
        let by = ["sh", "-c", ignoring.as_str()];
        let mut node = domain.start_by(&by, "run relay.toml --cycles 500 --json");
        node.wait_for("is running");
        node.signal(signal);
        let ended = node.finish().expect_code(0);
        let report = ended.json();
        assert_eq!(report["tasks"][0]["cycles"], 500, "{name}");
    }
}

#[test]
fn a_sigterm_that_was_blocked_by_the_parent_ends_in_order() {
    let by = ["env", "--block-signal=TERM"];
    if !Command::new(by[0]).args([by[1], "true"]).output().is_ok_and(|env| env.status.success()) {
        return not_tested("a blocked SIGTERM", "env has no --block-signal");
    }
    let domain = Domain::with(&[("relay.toml", RELAY)]);
    let mut node = domain.start_by(&by, "run relay.toml");
    node.wait_for("is running");
    node.stop().expect_code(0).prints(&["release jitter"]);
    domain.expect_no_leftovers();
}

#[test]
fn a_list_that_is_ended_early_prints_what_it_has_and_leaves_nothing() {
    let domain = Domain::new();
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let node = domain.start_node("relay.toml", RELAY, "");
        // It counts the frames of telemetry for half a second. On a busy machine that may be over before
        // this test looks; then again.
        let ended = (0..20).find_map(|_| {
            let mut list = domain.start("list");
            while !list.handles_signals() {
                if list.is_over() {
                    return None;
                }
                thread::sleep(Duration::from_millis(1));
            }
            list.signal(signal);
            Some(list.finish().expect_code(0))
        });
        let ended = ended.unwrap();
        assert!(ended.stdout.contains("relay/out"), "{signal:?}: {}", ended.stdout);
        node.stop().expect_code(0);
        assert_eq!(domain.leftovers(), Vec::<PathBuf>::new(), "{signal:?}");
    }
}

/// Whether a process waits because nobody reads the pipe that it writes to: nothing is added, and the process
/// sleeps at every look. One that has no CPU is ready to run, and does not sleep.
fn waits_to_write(pid: Pid, reader: &PipeReader) -> bool {
    let bytes = rustix::io::ioctl_fionread(reader).unwrap();
    let looks = (0..50).all(|_| {
        thread::sleep(Duration::from_millis(2));
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
        stat.contains(") S ") && rustix::io::ioctl_fionread(reader).unwrap() == bytes
    });
    bytes > 60_000 && looks
}

/// A subscriber that hangs because nobody reads what it prints, and its process id.
fn hang(domain: &Domain) -> (std::process::Child, Pid) {
    let mut command = domain.command(&["subscribe", "relay/in"]);
    let (reader, writer) = std::io::pipe().unwrap();
    command.stdin(Stdio::null()).stdout(writer.try_clone().unwrap()).stderr(writer);
    let child = afresh(&mut command).spawn().unwrap();
    let pid = Pid::from_child(&child);
    wait_until("nobody reads what it prints", || waits_to_write(pid, &reader));
    // Kept open, unread, until the test ends.
    std::mem::forget(reader);
    (child, pid)
}

#[test]
fn another_signal_ends_a_process_that_hangs_with_exit_status_1() {
    let domain = Domain::new();
    let _publisher = domain.publish("relay/in --value 1 --rate 20000");
    let (mut hanging, pid) = hang(&domain);
    kill_process(pid, Signal::TERM).unwrap();
    thread::sleep(Duration::from_millis(600));
    assert_eq!(hanging.try_wait().unwrap(), None, "it hangs");
    // Where the machine is busy, the process may take two signals for one request: it sees them late.
    let ended = wait_for_some("it has ended", || {
        kill_process(pid, Signal::INT).unwrap();
        thread::sleep(Duration::from_millis(600));
        hanging.try_wait().unwrap()
    });
    assert_eq!(ended.code(), Some(1));
}

/// A demo at work, and its processes.
fn demo(folder: &tempfile::TempDir) -> (Process, Vec<i32>) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    command.args(["demo", "--seconds", "600"]).env("TMPDIR", folder.path());
    let mut demo = Process::start(command);
    demo.wait_for("level.y=");
    let children = children(demo.id());
    assert_eq!(children.len(), 3);
    (demo, children)
}

/// Waits until processes have ended. Nobody may be there who waits for an orphan.
fn await_end(processes: &[i32]) {
    let runs = |pid: &i32| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"));
        stat.is_ok_and(|stat| !stat.contains(") Z "))
    };
    wait_until("they have ended", || !processes.iter().any(runs));
}

#[test]
fn the_processes_of_a_demo_that_is_killed_end_in_order_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let (demo, children) = demo(&folder);
    let prefix = format!("isodemo{}_", demo.id());
    demo.kill();
    await_end(&children);
    assert_eq!(shared_memory(&prefix), Vec::<PathBuf>::new());
}

#[test]
fn a_demo_that_is_ended_at_once_ends_its_processes_too() {
    let folder = tempfile::tempdir().unwrap();
    let (mut demo, children) = demo(&folder);
    let demo_id = demo.id();
    // A node that is stopped keeps the demo from ending in order.
    let node = Pid::from_raw(children[0]).unwrap();
    kill_process(node, Signal::STOP).unwrap();
    // Where the machine is busy, the demo may take two signals for one request: it sees them late.
    wait_until("it has ended", || {
        demo.signal(Signal::INT);
        thread::sleep(Duration::from_millis(600));
        demo.is_over()
    });
    demo.finish().expect_code(1).says(&["ended at once"]);
    kill_process(node, Signal::CONT).unwrap();
    await_end(&children);
    let left = shared_memory(&format!("isodemo{}_", demo_id));
    assert_eq!(left, Vec::<PathBuf>::new());
}

/// Process ids of a process's children.
fn children(parent: u32) -> Vec<i32> {
    let list = std::fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).unwrap();
    list.split_whitespace().map(|pid| pid.parse().unwrap()).collect()
}

#[test]
fn seconds_end_a_publisher_that_waits_for_a_long_period() {
    let domain = Domain::new();
    domain
        .run("publish relay/in --value 1 --rate 0.001 --seconds 1")
        .expect_code(0)
        .prints(&["published 1 frame "]);
}
