//! Processes that start while another is stopped in the midst of its own start.

use std::fs::File;
use std::io::Write as _;

use isochrone_testing::Domain;
use rustix::fs::{FlockOperation, flock};
use rustix::process::Signal;

/// Locks a domain as a process does that starts in it, and stays there.
fn lock(domain: &Domain) -> File {
    std::fs::create_dir_all(domain.path("iceoryx2")).unwrap();
    let prefix = domain.prefix();
    let path = domain.path("iceoryx2").join(format!("{prefix}isochrone.lock"));
    let mut file = File::create(path).unwrap();
    flock(&file, FlockOperation::LockExclusive).unwrap();
    writeln!(file, "{} isochrone/somebody", std::process::id()).unwrap();
    file
}

#[test]
fn who_waits_for_a_process_that_starts_says_for_which_and_goes_on_after_it() {
    let domain = Domain::new();
    let held = lock(&domain);
    let publisher = domain.start_until(
        "publish relay/in --value 1 --count 3",
        &format!("waiting for process {}", std::process::id()),
    );
    drop(held);
    publisher.finish().expect_code(0).prints(&["published 3 frames"]);
}

#[test]
fn who_waits_for_a_process_that_starts_can_be_ended() {
    let domain = Domain::new();
    let held = lock(&domain);
    let publisher = domain.start_until("publish relay/in --value 1", "waiting for process");
    publisher.signal(Signal::TERM);
    publisher.finish().expect_code(1).says(&["gave up waiting for process"]);
    drop(held);
}

#[test]
fn processes_that_run_are_not_held_up_by_one_that_starts() {
    let domain = Domain::new();
    let publisher = domain.publish("relay/in --value 1");
    let mut subscriber = domain.start("subscribe relay/in --every 100");
    let lines = |stdout: &str| stdout.lines().count();
    subscriber.wait_until("frames", |stdout, _| lines(stdout) > 0);
    let held = lock(&domain);
    let mut before = None;
    subscriber.wait_until("more frames", |stdout, _| {
        lines(stdout) > *before.get_or_insert(lines(stdout)) + 5
    });
    // They end, too: who leaves waits for a while only.
    subscriber.stop().expect_code(0);
    publisher.stop().expect_code(0);
    drop(held);
}
