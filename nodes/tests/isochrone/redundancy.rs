//! Two processes of one node: the second one takes over from the first, whatever becomes of that.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::served::Served;
use crate::tmux::Tmux;
use isochrone_ipc::{Depth, FrameSubscriber};
use isochrone_testing::{Domain, Plant, Process, is_full_volume, wait_for_some, wait_until};
use rustix::process::Signal;
use serde_json::{Value, json};

/// How far the ramp moves in a cycle of 10 ms.
pub(crate) const STEP: f64 = 1.0;

/// A ramp in a fast task, and one in a slow one.
pub(crate) fn ramps() -> Plant {
    Plant::new("level")
        .with("control = \"force\"")
        .task("fast", "10ms")
        .task("slow", "50ms")
        .on("fast")
        .ramp("ramp", "value = 1e6, setChangeRate = 100.0")
        .output("level/fast", &["ramp.delayedValue"])
        .on("slow")
        .ramp("late", "value = 1e6, setChangeRate = 20.0")
        .output("level/slow", &["late.delayedValue"])
}

pub(crate) fn domain() -> Domain {
    Domain::with(&[("level.toml", &ramps())])
}

/// The standby waits longer than a busy machine keeps the holder from its cycles.
pub(crate) const RUN: &str = "run level.toml --redundant --after 100";

/// The process that holds the node from its start.
pub(crate) fn holder(domain: &Domain) -> Process {
    domain.start_until(RUN, "waits for a standby")
}

/// A process that can take over.
pub(crate) fn standby(domain: &Domain) -> Process {
    domain.start_until(RUN, "can be taken over")
}

/// A frame as a reader got it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Got {
    sequence: u64,
    cycle: u64,
    term: u64,
    value: f64,
}

/// Reads all frames of a service, until it is asked for them.
pub(crate) struct Reader {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(Vec<Got>, [u64; 3])>,
}

impl Reader {
    pub(crate) fn of(domain: &Domain, service: &'static str) -> Self {
        let stop = Arc::<AtomicBool>::default();
        let (stopped, participant) = (Arc::clone(&stop), domain.join_variant("reader"));
        let (tell, reads) = channel();
        let thread = thread::spawn(move || {
            let mut frames = FrameSubscriber::<isochrone_ipc::ipc_threadsafe::Service>::open(
                &participant,
                service,
                1,
                Depth::All,
            )
            .unwrap();
            let mut got = Vec::new();
            while !stopped.load(Ordering::Relaxed) {
                frames.maintain();
                participant.tend();
                while let Some(frame) = frames.next(now_ns()) {
                    let (header, value) = (*frame.header(), frame.values()[0]);
                    let isochrone_ipc::FrameHeader { sequence, cycle, term, .. } = header;
                    got.push(Got { sequence, cycle, term, value });
                    let _ = tell.send(());
                }
                thread::sleep(Duration::from_millis(1));
            }
            let counters = frames.counters();
            (got, [counters.restarts, counters.other_writers, counters.lost])
        });
        reads.recv().unwrap();
        Self { stop, thread }
    }

    /// The frames, and how many restarts, frames of other writers and losses were counted.
    pub(crate) fn end(self) -> (Vec<Got>, [u64; 3]) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

fn now_ns() -> u64 {
    use isochrone_cyclic::Clock;
    isochrone_cyclic::Monotonic.now_ns()
}

/// Nothing goes back or repeats, and no output moves further than its rate allows for the time that passed.
#[track_caller]
pub(crate) fn assert_goes_on(got: &[Got], step: f64) {
    for pair in got.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        assert!(after.cycle > before.cycle, "{before:?} {after:?}");
        assert!(after.sequence > before.sequence, "{before:?} {after:?}");
        assert!(after.term >= before.term, "{before:?} {after:?}");
        let passed = (after.cycle - before.cycle) as f64;
        let moved = after.value - before.value;
        assert!((0.0..=passed * step).contains(&moved), "{before:?} {after:?}");
    }
}

/// How many times the node changed hands.
pub(crate) fn takeovers(got: &[Got]) -> usize {
    got.windows(2).filter(|pair| pair[0].term != pair[1].term).count()
}

#[test]
fn a_holder_that_is_killed_at_any_moment_is_taken_over_without_a_bump() {
    let domain = domain();
    let mut holds = holder(&domain);
    let fast = Reader::of(&domain, "level/fast");
    let slow = Reader::of(&domain, "level/slow");
    let kills = if is_full_volume() { 500 } else { 12 };
    let mut seed = 11_u64;
    for _ in 0..kills {
        let mut stands_by = standby(&domain);
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        thread::sleep(Duration::from_millis((seed >> 33) % 40));
        holds.kill();
        stands_by.wait_for("is taken over by this process");
        holds = stands_by;
    }
    thread::sleep(Duration::from_millis(100));
    let (frames, [restarts, others, _]) = fast.end();
    assert_goes_on(&frames, STEP);
    assert!(takeovers(&frames) >= kills, "{}", takeovers(&frames));
    assert_eq!((restarts, others), (0, 0), "both processes are one writer");
    let (frames, [restarts, others, _]) = slow.end();
    assert_goes_on(&frames, STEP);
    assert_eq!((restarts, others), (0, 0));
}

#[test]
fn the_frames_of_the_first_holder_have_the_term_of_the_node() {
    let domain = domain();
    let _holds = holder(&domain);
    let readers = ["level/fast", "level/slow"].map(|service| Reader::of(&domain, service));
    let [fast, slow] = readers.map(|reader| reader.end().0[0].term);
    assert_eq!(fast, slow, "each port has another one of its own");
}

/// What `list` says of the two processes.
pub(crate) fn redundancy(domain: &Domain) -> Value {
    domain.answer("list --json")["control_nodes"][0]["redundancy"].clone()
}

#[test]
fn a_holder_that_was_stopped_stands_by_when_it_goes_on_and_no_reader_sees_its_term() {
    let domain = domain();
    let mut holds = holder(&domain);
    let mut stands_by = standby(&domain);
    let fast = Reader::of(&domain, "level/fast");
    let slow = Reader::of(&domain, "level/slow");
    let stops = if is_full_volume() { 200 } else { 8 };
    for _ in 0..stops {
        let was_taken =
            |process: &Process| process.printed().matches("is taken over by this process").count();
        let before = was_taken(&stands_by);
        holds.signal(Signal::STOP);
        // A busy machine may keep the standby from its reports for so long that it counts as gone.
        let is_gone = || stands_by.printed().trim_end().ends_with("has not heard it for 100 ms");
        wait_until("the standby takes over", || {
            if is_gone() {
                holds.signal(Signal::CONT);
                wait_until("the holder hears the standby", || !is_gone());
                holds.signal(Signal::STOP);
            }
            was_taken(&stands_by) > before
        });
        let joined = holds.printed().matches("can be taken over").count();
        holds.signal(Signal::CONT);
        let is_back = || holds.printed().matches("can be taken over").count() > joined;
        wait_until("the one that was stopped can take over again", is_back);
        std::mem::swap(&mut holds, &mut stands_by);
    }
    let (frames, [restarts, others, _]) = fast.end();
    assert_goes_on(&frames, STEP);
    assert!(takeovers(&frames) >= stops, "{}", takeovers(&frames));
    assert_eq!((restarts, others), (0, 0));
    assert_goes_on(&slow.end().0, STEP);
}

/// The same, when a standby can take over.
fn complete(domain: &Domain) -> Value {
    wait_for_some("a standby that can take over", || {
        Some(redundancy(domain)).filter(|twins| twins["is_complete"] == json!(true))
    })
}

#[test]
fn a_switch_loses_no_cycle() {
    let domain = domain();
    // Nobody takes over by himself, however long a busy machine stops the other one.
    let run = "run level.toml --redundant --after 1000";
    let _first = domain.start_until(run, "waits for a standby");
    let _second = domain.start_until(run, "can be taken over");
    let fast = Reader::of(&domain, "level/fast");
    let slow = Reader::of(&domain, "level/slow");
    for _ in 0..6 {
        let before = complete(&domain);
        // A busy machine may keep the standby from its reports for so long that it counts as gone.
        let switched = wait_for_some("a standby that can be asked", || {
            let ended = domain.run("switch level");
            let is_gone = ["no standby follows", "has no state of each task yet"];
            (!is_gone.iter().any(|gone| ended.stderr.contains(gone))).then_some(ended)
        });
        switched.expect_code(0).prints(&["stands by"]);
        let after = complete(&domain);
        assert_eq!((&after["holder"], &after["standby"]), (&before["standby"], &before["holder"]));
        assert_eq!(after["last_takeover"]["was_asked"], json!(true));
    }
    for (reader, step) in [(fast, STEP), (slow, STEP)] {
        let (frames, [restarts, others, lost]) = reader.end();
        assert_goes_on(&frames, step);
        assert_eq!((restarts, others), (0, 0));
        let missed: u64 = frames.windows(2).map(|pair| pair[1].cycle - pair[0].cycle - 1).sum();
        // What a busy machine kept the holder from is no loss of the switch.
        assert!(lost <= missed, "{lost} frames lost, {missed} cycles missed");
    }
}

#[test]
fn screens_go_on_over_a_takeover_and_show_who_holds_the_node() {
    let domain = domain();
    let first = holder(&domain);
    let mut second = standby(&domain);
    let (holds, follows) = (first.id(), second.id());
    let served = Served::start(&domain, "level");
    let mut page = served.events();
    let top = Tmux::start(&domain, "", "top level");
    let shows = |text: &str| top.iter().for_each(|top| top.wait_for(text));
    shows("2 Tasks");
    top.iter().for_each(|top| top.press(&["2"]));
    let pair = format!("held by pid {holds}, pid {follows} stands by");
    shows(&pair);
    page.until("state", |state| state["twins"] == json!([pair]));
    first.kill();
    second.wait_for("is taken over by this process");
    let alone = format!("held by pid {follows}, no standby");
    shows(&alone);
    shows("1 takeover, the last ");
    let state = page.until("state", |state| state["twins"][0] == json!(alone));
    assert!(state["twins"][1].as_str().unwrap().contains("the holder was silent"), "{state}");
    let runs = |state: &Value| state["state"] == json!("runs");
    if !runs(&state) {
        page.until("state", runs);
    }
}

#[test]
fn what_was_set_and_forced_survives_the_holder() {
    let domain = domain();
    let first = holder(&domain);
    let mut second = standby(&domain);
    for value in 1..=3 {
        domain.run(&format!("set level late.setChangeRate={value}")).expect_code(0);
    }
    domain.run("force level ramp.delayedValue=3 --hold").expect_code(0);
    first.kill();
    second.wait_for("is taken over by this process");
    let values = domain.answer("get level late.setChangeRate ramp.delayedValue --json");
    assert_eq!(values["values"], json!({"late.setChangeRate": 3.0, "ramp.delayedValue": 3.0}));
    let forces = domain.answer("forces level --json");
    assert!(forces.to_string().contains("ramp.delayedValue"), "{forces}");
    domain.run("release level ramp.delayedValue").expect_code(0);
    let ended = second.stop().expect_code(0);
    assert!(ended.stderr.contains("1 value was set and not saved"), "{}", ended.stderr);
}

#[test]
fn a_standby_of_another_configuration_and_a_third_process_are_refused() {
    let domain = domain();
    domain.write("other.toml", ramps().replace("100.0", "90.0"));
    let _first = holder(&domain);
    domain.expect("run other.toml --redundant", 1, &["runs another configuration", "sha256"]);
    let _second = standby(&domain);
    domain.expect(RUN, 1, &["two redundant processes already"]);
    domain.expect("run level.toml", 1, &["runs already"]);
    domain.expect(
        "apply level other.toml --allow-missed",
        1,
        &["stands by", "start it with the new file"],
    );
    domain.run("apply level other.toml --dry-run --allow-missed").expect_code(0);
    assert_eq!(redundancy(&domain)["is_complete"], json!(true), "nothing has changed");
}

#[test]
fn a_standby_that_is_gone_is_an_alarm_and_delays_no_answer() {
    let domain = domain();
    let _first = holder(&domain);
    domain.expect("switch level", 1, &["no standby follows"]);
    let second = standby(&domain);
    assert_eq!(redundancy(&domain)["is_complete"], json!(true));
    second.signal(Signal::STOP);
    domain.run("set level ramp.setChangeRate=50").expect_code(0);
    let alarms = domain.answer("alarms level --json");
    assert!(alarms.to_string().contains("the standby is gone"), "{alarms}");
    second.signal(Signal::CONT);
    let is_back = || redundancy(&domain)["is_complete"] == json!(true);
    wait_until("the standby is back", is_back);
    let alarms = domain.answer("alarms level --json");
    assert!(!alarms.to_string().contains("the standby is gone"), "{alarms}");
}

#[test]
fn a_holder_that_dies_before_it_could_be_followed_is_started_anew() {
    let domain = Domain::with(&[("level.toml", &ramps().replace("50ms", "3s"))]);
    let first = holder(&domain);
    let mut second = domain.start_until(RUN, "stands by for process");
    first.kill();
    second.wait_for("starts the node anew");
    second.wait_for("waits for a standby");
    let _third = domain.start_until(RUN, "stands by for process");
}

#[test]
fn two_processes_that_end_in_order_leave_nothing_in_the_domain() {
    let domain = domain();
    let first = holder(&domain);
    standby(&domain).stop().expect_code(0);
    first.stop().expect_code(0);
    domain.expect_no_leftovers();
}

#[test]
fn journal_and_state_belong_to_whoever_holds_the_node() {
    let retains = ramps().replace("control = \"force\"", "control = \"force\"\nretain = true");
    let domain = Domain::with(&[("level.toml", &retains)]);
    let run = format!("{RUN} --journal level.jsonl --state level.state");
    let first = domain.start_until(&run, "waits for a standby");
    let mut second = domain.start_until(&run, "can be taken over");
    domain.run("set level late.setChangeRate=2").expect_code(0);
    first.kill();
    second.wait_for("is taken over by this process");
    domain.run("set level late.setChangeRate=3").expect_code(0);
    second.stop().expect_code(0);
    let journal = domain.read("level.jsonl");
    let count = |what: &str| journal.lines().filter(|line| line.starts_with(what)).count();
    assert_eq!(["{\"run\"", "{\"entry\"", "{\"end\""].map(count), [2, 2, 1], "{journal}");
    let state = domain.answer("state level.state --json");
    assert_eq!(state["set"], json!({"late.setChangeRate": 3.0}));
}

#[test]
fn a_process_that_takes_over_and_cannot_open_the_journal_takes_no_changes() {
    let domain = domain();
    let run = format!("{RUN} --journal level.jsonl");
    let first = domain.start_until(&run, "waits for a standby");
    let mut second = domain.start_until(&run, "can be taken over");
    std::fs::remove_file(domain.path("level.jsonl")).unwrap();
    std::fs::create_dir(domain.path("level.jsonl")).unwrap();
    first.kill();
    second.wait_for("the journal level.jsonl cannot be opened (Is a directory (os error 21)); changes are refused");
    domain.expect("set level late.setChangeRate=3", 1, &["Is a directory"]);
    assert_eq!(domain.stdout("get level late.setChangeRate"), "20\n");
    domain.run("alarms level").expect_code(0).prints(&["Is a directory"]);
    second.stop().expect_code(1).says(&["the journal level.jsonl cannot be opened"]);
}
