//! Traces: every cycle of chosen signals, out of a node that runs in a process of its own.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use crate::node::Node;
use crate::plant::Observer;
use isochrone_control::{
    ApplyParams, Client, ClientError, Code, Refusal, Trace, TraceParams, TraceRow, signals_by_task,
};
use isochrone_ipc::{Participant, ipc};
use isochrone_testing::plants::LEVEL;
use isochrone_testing::{Domain, PATIENCE, wait_for_some, wait_until};

/// Those that the node sends.
const SIGNALS: [&str; 3] = ["saw.value", "ramp.delayedValue", "lim.highLim"];

/// The level at 1 kHz, with more signals than a trace has.
fn level() -> String {
    LEVEL.replace("\"2ms\"", "\"1ms\"")
        + "[[block]]\nname = \"many\"\ncount = 70\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
           in = { value = 3.0, setChangeRate = 1.0 }\n"
}

type Shared = Rc<RefCell<Client<ipc::Service>>>;

fn connect(domain: &Domain) -> (Participant<ipc::Service>, Shared) {
    let participant = domain.join("tracer");
    let client = Client::connect(&participant, "level", PATIENCE).unwrap();
    (participant, Rc::new(RefCell::new(client)))
}

/// Takes rows until `is_enough`.
#[track_caller]
fn rows_until(trace: &mut Trace, mut is_enough: impl FnMut(&TraceRow<'_>) -> bool) {
    wait_until("enough rows have come", || {
        trace.renew().unwrap();
        trace.maintain();
        while let Some(row) = trace.next_row() {
            if is_enough(&row) {
                return true;
            }
        }
        false
    });
}

fn refused(error: ClientError) -> Refusal {
    let ClientError::Refused(failure) = error else { panic!("{error}") };
    failure
}

#[test]
fn every_cycle_comes_in_order_and_to_the_bit_as_in_the_frames_that_the_node_sends() {
    /// In a row, and without a loss.
    const ROWS: usize = 3000;
    let node = Node::start(&level());
    let (participant, client) = connect(&node.domain);
    let mut frames = Observer::of(&node.domain, "level/out");
    let mut trace = Trace::open(&participant, &client, SIGNALS).unwrap();
    assert_eq!((trace.task(), trace.period_ns()), ("fast", 1_000_000));
    assert_eq!(trace.timing()[0], "task.fast.cycle");
    let mut sent = BTreeMap::new();
    let (mut compared, mut unbroken) = (0, 0);
    let mut last: Option<(u64, u64, u64)> = None;
    rows_until(&mut trace, |row| {
        while let Some(frame) = frames.next() {
            sent.insert(frame.header.cycle, frame);
        }
        if let Some((cycle, missed, release_ns)) = last {
            assert_eq!(row.cycle, cycle + 1 + (row.missed - missed) + row.lost, "after {cycle}");
            assert_eq!(row.release_ns - release_ns, (row.cycle - cycle) * 1_000_000);
        }
        last = Some((row.cycle, row.missed, row.release_ns));
        assert_eq!(row.timing[0], row.cycle as f64);
        if let Some(frame) = sent.get(&row.cycle) {
            let bits = |values: &[f64]| Vec::from_iter(values.iter().map(|value| value.to_bits()));
            assert_eq!(bits(row.values), bits(&frame.values), "in cycle {}", row.cycle);
            compared += 1;
        }
        // A machine that is busy may keep the reader from its CPU: then it is counted, and it is another row.
        unbroken = if row.lost > 0 { 0 } else { unbroken + 1 };
        unbroken >= ROWS && compared >= ROWS
    });
    drop(trace);
}

#[test]
fn a_trace_goes_on_through_a_change_of_the_configuration_that_keeps_its_signals_and_ends_with_another()
 {
    let mut node = Node::start(&level());
    let (participant, client) = connect(&node.domain);
    let mut trace = Trace::open(&participant, &client, ["many.1.*", "saw.value"]).unwrap();
    let mut apply = |text: String| {
        let apply =
            ApplyParams { configuration: text, allow_missed: Some(true), ..Default::default() };
        node.call(&apply).tasks["fast"].cycle
    };
    // What stands before the signals in the image grows.
    let grown = "[[block]]\nname = \"fresh\"\ncount = 5\ntype = \"SawTooth\"\ntask = \"fast\"\n\
                 in = { incrementRange = 1, numberSteps = 10 }\n[[block]]\nname = \"saw\"";
    let grown = level().replacen("[[block]]\nname = \"saw\"", grown, 1);
    let changed = apply(grown.replace("value = 3.0", "value = 4.0"));
    let values = [0, 1, 2].map(|at| trace.signals()[at].name.clone());
    assert_eq!(values[0], "many.1.value", "{values:?}");
    rows_until(&mut trace, |row| {
        let value = if row.cycle < changed { 3.0 } else { 4.0 };
        assert_eq!(row.values[0], value, "in cycle {}", row.cycle);
        row.cycle > changed + 100
    });
    apply(level().replace("count = 70", "count = 1"));
    let failure = refused(wait_for_some("it is not renewed any more", || trace.renew().err()));
    assert_eq!(failure.code, Code::UnknownName);
    assert!(failure.message.contains("a change of the configuration took away"), "{failure}");
    while trace.next_row().is_some() {}
    wait_until("its service is closed", || trace.has_ended());
}

#[test]
fn a_task_has_four_traces_and_one_that_is_not_renewed_gives_its_place_back() {
    let node = Node::start(&level());
    let (participant, client) = connect(&node.domain);
    let open = || Trace::open(&participant, &client, SIGNALS);
    // As of a client that dies at once.
    let signals = Some(SIGNALS.map(str::to_owned).to_vec());
    let forgotten = TraceParams { signals, ..TraceParams::default() };
    // On a busy machine the place may be free again before the others are taken.
    let (forgotten, mut others, failure) = wait_for_some("four traces keep a fifth out", || {
        let forgotten = client.borrow_mut().call(&forgotten).ok()?;
        let others = [open().ok()?, open().ok()?, open().ok()?];
        Some((forgotten, others, refused(open().err()?)))
    });
    assert_eq!(failure.code, Code::Busy);
    let process = format!("traced 4 times already, by process {};", std::process::id());
    assert!(failure.message.contains(&process), "{failure}");
    let slow = Trace::open(&participant, &client, ["late.delayedValue"]).unwrap();
    assert_eq!(slow.task(), "slow", "each task has four");

    let [first, ..] = &mut others;
    rows_until(first, |_| true);
    drop(others);
    let mut others = [open().unwrap(), open().unwrap(), open().unwrap()];
    let mut fifth = wait_for_some("there is a place for another one", || {
        others.iter_mut().for_each(|other| other.renew().unwrap());
        let opened = open();
        if let Err(error) = &opened {
            let is_busy =
                matches!(error, ClientError::Refused(failure) if failure.code == Code::Busy);
            assert!(is_busy, "{error}");
        }
        opened.ok()
    });
    rows_until(&mut fifth, |_| true);
    let renewal = TraceParams { id: Some(forgotten.id), ..TraceParams::default() };
    let failure = refused(client.borrow_mut().call(&renewal).unwrap_err());
    assert!(failure.message.contains("it was not renewed for 5 s"), "{failure}");
    drop((others, fifth, slow));
}

#[test]
fn what_cannot_be_traced_is_refused_with_the_way_out() {
    let node = Node::start(&level());
    let (participant, client) = connect(&node.domain);
    let refusal = |names: &[&str]| {
        let names = names.iter().copied();
        refused(Trace::open(&participant, &client, names).unwrap_err()).to_string()
    };
    assert_eq!(
        refusal(&["ramp.delayedVale"]),
        "there is no signal \"ramp.delayedVale\"; did you mean \"ramp.delayedValue\"?"
    );
    assert_eq!(
        refusal(&["ramp.delayedValue", "late.value"]),
        "ramp.delayedValue is of task \"fast\" and late.value is of task \"slow\"; ask for a trace of each task"
    );
    assert_eq!(
        refusal(&["many.*.delayedValue"]),
        "these are 70 signals; a trace has at most 64: name fewer, or ask for several traces"
    );
    let ask = |params: &TraceParams| refused(client.borrow_mut().call(params).unwrap_err());
    assert_eq!(ask(&TraceParams::default()).code, Code::InvalidParams);
    let unknown = TraceParams { id: Some("7\u{1b}".into()), ..TraceParams::default() };
    let failure = ask(&unknown);
    assert_eq!(failure.code, Code::UnknownName);
    assert!(!failure.message.contains('\u{1b}'), "{failure}");

    let names = ["late.value", "ramp.delayedValue", "saw.value", "ramp.delayed*"];
    let tasks = signals_by_task(&mut client.borrow_mut(), &names).unwrap();
    let names = |at: usize| Vec::from_iter(tasks[at].1.iter().map(|signal| &*signal.name));
    assert_eq!((&*tasks[0].0, names(0)), ("slow", vec!["late.value"]));
    assert_eq!((&*tasks[1].0, names(1)), ("fast", vec!["ramp.delayedValue", "saw.value"]));
    let failure =
        refused(signals_by_task(&mut client.borrow_mut(), &["x", "saw.*", "y"]).unwrap_err());
    assert_eq!(failure.findings.len(), 2, "{failure}");
}

#[test]
fn the_last_cycles_of_a_node_that_ends_are_there_to_be_read() {
    // On a busy machine the node may have ended before the trace begins.
    assert!((0..10).any(|_| are_read_to_the_last()), "no trace of ten had a row");
}

/// Whether a trace of a node that ends had rows; if it had, the last is that of the last cycle.
fn are_read_to_the_last() -> bool {
    let domain = Domain::new();
    let process = domain.start_node("node.toml", &level(), "--cycles 1500 --report node.json");
    let (participant, client) = connect(&domain);
    let Ok(mut trace) = Trace::open(&participant, &client, SIGNALS) else { return false };
    let mut last = None;
    wait_until("the node has ended", || {
        // Cycles that a busy machine misses make the run longer than a trace is kept.
        let _ = trace.renew();
        while let Some(row) = trace.next_row() {
            last = Some(row.cycle);
        }
        trace.has_ended()
    });
    while let Some(row) = trace.next_row() {
        last = Some(row.cycle);
    }
    process.finish().expect_code(0);
    let Some(last) = last else { return false };
    let task = &domain.json("node.json")["tasks"][0];
    assert_eq!(last + 1, task["cycles"].as_u64().unwrap() + task["missed"].as_u64().unwrap());
    true
}
