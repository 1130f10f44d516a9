//! Nothing in the way of the cycle: no allocation, no page fault, no lock, no system call but the
//! wait.
//!
//! `ISOCHRONE_TEST_CYCLES=1000000` makes these runs as long as one wants.

use std::cell::RefCell;
use std::collections::HashMap;
use std::process::Command;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_control::{Client, ClientError, SetParams, Trace};
use isochrone_ipc::{LayoutWatcher, Participant, ipc};
use isochrone_testing::{Domain, PATIENCE, Plant, Process, not_tested};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// Each of these is two hundred and fifty blocks: a thousand in all.
const CHAINS: usize = 250;
const WARM_UP_CYCLES: u64 = 100;
/// How long before its margin a wait is awake when it is early.
const EARLY_NS: u64 = 400_000;

/// Leaves others time on a machine that takes a third of it for a cycle.
const PERIOD: Duration = Duration::from_millis(1);

fn cycles() -> u32 {
    std::env::var("ISOCHRONE_TEST_CYCLES").map_or(8_000, |cycles| cycles.parse().unwrap())
}

/// A node with inputs, outputs and a thousand blocks, in a task that would have real time.
fn node() -> String {
    let advanced = "autoValue = \"ramp.{i}.delayedValue\", setPosUpRateLim = 3.0, setPosDownRateLim = 3.0, \
        setNegUpRateLim = 3.0, setNegDownRateLim = 3.0, setHighLim = 50.0, setLowLim = -50.0";
    let count = format!("count = {CHAINS}");
    let node = Plant::new("busy")
        .with("retain = true\nretain_every = \"100ms\"")
        .task("t", &format!("{}ms", PERIOD.as_millis()))
        .with("ob = 35\npriority = 80\nwake = \"hybrid\"")
        .input("x", "busy/in", "channel = 0")
        .input("y", "busy/in", "channel = 1")
        .saw("saw", "incrementRange = 3, numberSteps = 1000")
        .with(&count)
        .block(
            "scale",
            "ScaleLinear",
            "x = \"saw.{i}.value\", x1 = 0, y1 = 0, x2 = 100, y2 = 7, yMin = -inf, yMax = inf",
        )
        .with(&count)
        .ramp("ramp", "value = \"scale.{i}.y\", setChangeRate = 5")
        .with(&count)
        .block("advanced", "LimRateOfChangeAdvancedCI", advanced)
        .with(&count)
        .with("[[block]]\nname = \"expr\"\ntype = \"Expr\"\ncount = 50")
        .with("out = { sum = '\"expr.{i}.sum@prev\" + x', root = 'SQRT(ABS(x))', on = '\"ramp.{i}.delayedValue\" > 1.0' }")
        .output("busy/out", &["x", "y", "advanced.0.outputValue", "advanced.249.outputValue"])
        .output("busy/more", &["ramp.7.delayedValue"]);
    node.to_string()
}

/// A domain in which the node's peers are there already: connecting is another test's matter.
fn company(rate_hz: u32) -> (Domain, [Process; 3]) {
    let domain = Domain::with(&[("node.toml", &node())]);
    let publish = format!("publish busy/in --wave sine,step --rate {rate_hz}");
    let publisher = domain.start_until(&publish, "publishing");
    let observers = ["subscribe busy/out --stats", "subscribe busy/more --stats"];
    let [out, more] = observers.map(|observer| domain.start(observer));
    (domain, [publisher, out, more])
}

fn number(task: &Value, key: &str) -> u64 {
    task[key].as_u64().unwrap_or_else(|| panic!("{key}: {task}"))
}

/// Clients that operate and trace the node until it ends.
struct Clients {
    /// The cycle of the last change.
    changed: Arc<AtomicU64>,
    /// How many rows of traces have come.
    rows: Arc<AtomicU64>,
    threads: [JoinHandle<()>; 2],
}

impl Clients {
    fn start(domain: &Domain) -> Self {
        let (changed, rows) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
        let (writing, tracing) = (changed.clone(), rows.clone());
        let [operator, tracer] = ["operator", "tracer"].map(|name| domain.join(name));
        let threads = [
            thread::spawn(move || write_values(&operator, &writing)),
            thread::spawn(move || trace(&tracer, &tracing)),
        ];
        Self { changed, rows, threads }
    }

    /// Whether the node has been traced, and was changed in this cycle or a later one.
    fn have_been_served(&self, cycle: u64) -> bool {
        self.rows.load(Relaxed) > 0 && self.changed.load(Relaxed) >= cycle
    }

    /// Waits until they have seen the node end.
    fn leave(self) {
        self.threads.into_iter().for_each(|client| client.join().unwrap());
    }
}

/// Changes parameters of the node a hundred times a second.
fn write_values(participant: &Participant<ipc::Service>, changed: &AtomicU64) {
    let mut client = Client::connect(participant, "busy", PATIENCE).unwrap();
    for written in 0.. {
        let rate = (written % 10) as f64;
        let parameters = (0..CHAINS).map(|n| (format!("ramp.{n}.setChangeRate"), rate));
        let set = SetParams { values: parameters.collect(), ..SetParams::default() };
        match client.call(&set) {
            Ok(set) => changed.store(set.tasks["t"].cycle, Relaxed),
            // What was under way when the node ended.
            Err(ClientError::Ended { .. } | ClientError::Refused(_)) => return,
            Err(error) => panic!("{error}"),
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Traces as many signals of the node as one may.
fn trace(participant: &Participant<ipc::Service>, rows: &AtomicU64) {
    let client = Client::connect(participant, "busy", PATIENCE).unwrap();
    let client = Rc::new(RefCell::new(client));
    let names = |first: usize| (first..first + 64).map(|n| format!("ramp.{n}.delayedValue"));
    let open = |first| Trace::open(participant, &client, names(first)).unwrap();
    let mut traces: Vec<_> = [0, 60, 120, 180].map(open).into();
    while !traces.is_empty() {
        for trace in &mut traces {
            while trace.next_row().is_some() {
                rows.fetch_add(1, Relaxed);
            }
        }
        traces.retain_mut(|trace| trace.renew().is_ok() && !trace.has_ended());
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn a_thousand_blocks_with_inputs_and_outputs_run_without_allocation_fault_or_lock_while_operated_traced_recorded_and_retained()
 {
    let (domain, peers) = company(1000);
    // Readers that wait for the node's layouts are no matter of the cycle.
    let readers = domain.join("readers");
    let wait = |index: usize| LayoutWatcher::open(&readers, ["busy/out", "busy/more"][index % 2]);
    let mut waiting: Vec<_> = (0..8).map(|index| wait(index).unwrap()).collect();
    let run = "run node.toml --report node.json --record node.mcap --state busy.state";
    let mut node = domain.start_until(run, "is running");
    let clients = Clients::start(&domain);
    thread::sleep(PERIOD * cycles());
    // They come when a busy machine lets them.
    node.wait_until_it("is operated, traced and read for as many cycles", |_| {
        for watcher in &mut waiting {
            watcher.look(&readers);
        }
        let have_learned = waiting.iter().all(|watcher| watcher.newest().is_some());
        have_learned && clients.have_been_served(cycles().into())
    });
    let ended = node.stop();
    clients.leave();
    for peer in peers {
        peer.stop().expect_code(0);
    }
    let report = domain.json("node.json");
    // What a busy machine kept from the recording is said, and no matter of the cycle.
    ended.expect_code(i32::from(number(&report["recording"], "lost") > 0));
    let task = &report["tasks"][0];
    let measured = number(task, "cycles") - WARM_UP_CYCLES;
    assert!(number(task, "cycles") + number(task, "missed") > cycles().into(), "{task}");
    assert_eq!(number(task, "block_errors"), 0);
    let recording = &report["recording"];
    assert_eq!(number(recording, "cycles") + number(recording, "lost"), number(task, "cycles"));
    assert!(number(&report["links"][0], "frames") > 0, "{report}");

    assert_eq!(number(task, "allocations"), 0);
    assert_eq!(number(task, "ipc_allocations"), 2 * measured, "one for the loan of each frame");
    // A lock that is waited for gives up the CPU. The wait for the release does so once at most, and
    // twice while peers come and go, if the period leaves the time for an early wake-up.
    let sleeps = if number(task, "period_ns") > EARLY_NS { 2 } else { 1 };
    assert!(number(task, "voluntary_switches") <= sleeps * measured + 1, "{task}");
    assert_eq!(number(task, "major_faults"), 0);
    // Memory that is not locked is the kernel's to take away.
    if !report["warnings"].as_array().unwrap().iter().any(|w| w["code"] == "lock_denied") {
        assert_eq!(number(task, "minor_faults"), 0, "{task}");
    }
}

#[test]
fn the_real_time_thread_makes_no_system_call_but_the_wait() {
    only_the_wait_is_a_system_call(&node(), 1000);
}

#[test]
fn a_task_that_follows_its_data_makes_none_while_it_watches_for_it() {
    // More cycles than frames: some begin with one, the others when the time is up.
    let follow = "wake = \"hybrid\"\nfollow = { service = \"busy/in\", within = \"1ms\" }";
    only_the_wait_is_a_system_call(&node().replace("wake = \"hybrid\"", follow), 100);
}

#[track_caller]
fn only_the_wait_is_a_system_call(node: &str, rate_hz: u32) {
    if Command::new("strace").arg("--version").output().is_err() {
        return not_tested("the system calls of the cycle", "strace is not installed");
    }
    let (domain, peers) = company(rate_hz);
    // strace stops the thread at each call for longer than a period of the other test.
    domain.write("node.toml", node.replace("period = \"1ms\"", "period = \"4ms\""));
    let calls = domain.path("calls");
    let strace = ["strace", "-f", "-o", calls.to_str().unwrap()];
    let mut node = domain.start_by(&strace, "run node.toml --record node.mcap --state busy.state");
    node.wait_for("is running");
    let clients = Clients::start(&domain);
    // Not so many cycles: on a busy machine most are missed.
    node.wait_until_it("waits often while it is operated and traced", |_| {
        clients.have_been_served(1) && steady_calls(&domain.read("calls")).len() > 800
    });
    // The first to be traced is the node's main thread.
    let pid = domain.read("calls").split_once(' ').unwrap().0.parse().unwrap();
    kill_process(Pid::from_raw(pid).unwrap(), Signal::TERM).unwrap();
    node.finish().expect_code(0);
    clients.leave();
    for peer in peers {
        peer.stop().expect_code(0);
    }
    let calls = domain.read("calls");
    let others: Vec<_> = steady_calls(&calls).into_iter().filter(|call| !is_wait(call)).collect();
    assert!(others.is_empty(), "{others:?}");
}

/// Only the cycle waits for an instant; the others wait for a time.
fn is_wait(call: &str) -> bool {
    call.starts_with("clock_nanosleep") && call.contains("TIMER_ABSTIME")
}

/// The system calls of the cycle, from the end of its warm-up to its last wait.
fn steady_calls(calls: &str) -> Vec<&str> {
    let mut threads: HashMap<&str, Vec<&str>> = HashMap::new();
    for (thread, call) in calls.lines().filter_map(|line| line.split_once(' ')) {
        // A call that another thread's interrupted stands on two lines; the second says no more.
        if !call.trim_start().starts_with("<...") {
            threads.entry(thread).or_default().push(call.trim_start());
        }
    }
    let waits = |calls: &Vec<&str>| calls.iter().filter(|call| is_wait(call)).count();
    let Some(mut cycle) = threads.into_values().max_by_key(waits) else { return Vec::new() };
    cycle.truncate(cycle.iter().rposition(|call| is_wait(call)).map_or(0, |last| last + 1));
    // When the warm-up ends, the counters of the report are read once.
    match cycle.iter().rposition(|call| call.starts_with("getrusage")) {
        Some(counted) => cycle.split_off(counted + 1),
        None => Vec::new(),
    }
}
