//! Another configuration for a node that runs, as processes.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use crate::node::Node;
use isochrone_control::{
    Action, AlarmsParams, ApplyParams, ApplyResult, At, Client, ClientError, Code, DescribeParams,
    ForceParams, GetParams, Hold, JournalParams, ReleaseParams, SetParams, Value,
};
use isochrone_ipc::{Depth, FrameSubscriber, ipc};
use isochrone_testing::plants::CLIMB;
use isochrone_testing::{PATIENCE, wait_for_ok, wait_until};

fn configuration(text: &str) -> ApplyParams {
    ApplyParams { configuration: text.to_owned(), ..ApplyParams::default() }
}

/// Cycles may be missed: the machine is busy with other tests.
#[track_caller]
fn apply(node: &mut Node, text: &str) -> ApplyResult {
    let client = Some("anna".to_owned());
    node.call(&ApplyParams { allow_missed: Some(true), client, ..configuration(text) })
}

#[track_caller]
fn value(node: &mut Node, name: &str) -> Option<Value> {
    node.get(&[name]).get(name)
}

/// With more blocks.
fn with_blocks(count: usize) -> String {
    let mut text = CLIMB.to_owned();
    write!(
        text,
        "[[block]]\nname = \"more\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
         count = {count}\nin = {{ value = 5.0, setChangeRate = 1000.0 }}\n"
    )
    .unwrap();
    text
}

/// How much a ramp is ahead of what the cycles that ran make of it, in each frame of some time.
fn offsets(frames: &mut FrameSubscriber<ipc::Service>, seen: &mut Vec<f64>) {
    while let Some(frame) = frames.next(0) {
        let ran = frame.header().cycle - frame.header().missed;
        seen.push(frame.values()[0] - 2.0 * ran as f64);
    }
}

#[test]
fn a_ramp_goes_on_without_a_bump_while_a_thousand_blocks_come_and_go() {
    let mut node = Node::start(CLIMB);
    let mut frames = FrameSubscriber::open(&node.participant, "level/out", 1, Depth::All).unwrap();
    let mut seen = Vec::new();
    for turn in 0..6 {
        let result = match turn % 2 {
            0 => apply(&mut node, &with_blocks(1000)),
            _ => apply(&mut node, CLIMB),
        };
        let which = if turn % 2 == 0 { &result.added } else { &result.removed };
        assert_eq!(*which, ["more"]);
        assert_eq!(result.kept, ["late", "ramp"]);
        assert!(result.cost_ns > 0);
        assert_eq!(result.tasks.len(), 2, "{:?}", result.tasks);
        offsets(&mut frames, &mut seen);
    }
    wait_until("ten frames have come", || {
        offsets(&mut frames, &mut seen);
        seen.len() > 10
    });
    assert!(seen.iter().all(|offset| (offset - seen[0]).abs() < 1e-6), "{seen:?}");
    let description = node.call(&DescribeParams {});
    assert!(description.configuration.changed);
    let entries = node.call(&JournalParams::default()).entries;
    let applied: Vec<_> = entries.iter().filter(|entry| entry.action == Action::Apply).collect();
    assert_eq!(applied.len(), 12, "one for each task");
    assert!(applied.iter().all(|entry| entry.by.client.as_deref() == Some("anna")), "{applied:?}");
    assert_eq!(node.call(&AlarmsParams::default()).total, 0);
}

#[test]
fn a_dry_run_says_what_would_change_and_changes_nothing() {
    let mut node = Node::start(CLIMB);
    let dry_run = Some(true);
    let configuration = with_blocks(3).replace("value = 1e9", "value = 1e8");
    let result = node.call(&ApplyParams { configuration, dry_run, ..ApplyParams::default() });
    assert!(result.tasks.is_empty() && result.cost_ns > 0, "{result:?}");
    assert_eq!((result.added, result.changed), (vec!["more".into()], vec!["ramp.value".into()]));
    assert!(node.call(&JournalParams::default()).entries.is_empty());
    assert_eq!(value(&mut node, "ramp.value"), Some(Value::Number(1e9)));
}

#[test]
fn what_is_wrong_with_a_configuration_is_said_and_changes_nothing() {
    let mut node = Node::start(CLIMB);
    let failure = node.refused(&configuration("[node\nname = 3"));
    assert_eq!(failure.code, Code::Configuration);
    assert!(failure.findings[0].name.starts_with("1:"), "{failure:?}");
    let wrong = CLIMB
        .replace("value = 1e9", "valeu = 1e9")
        .replace("ramp.delayedValue\", set", "ramp.x\", set");
    let failure = node.refused(&configuration(&wrong));
    assert_eq!(failure.code, Code::Configuration);
    assert!(failure.findings.len() > 1, "{failure:?}");
    let other = CLIMB.replace("\"20ms\"", "\"40ms\"").replace("level/out", "level/other");
    let failure = node.refused(&configuration(&other));
    assert_eq!(failure.code, Code::CannotChange);
    let names: Vec<&str> = failure.findings.iter().map(|finding| &*finding.name).collect();
    assert_eq!(names, ["slow", "level/out", "level/other"]);
    let values = [("late.delayedValue", 3.0)].into_iter().collect();
    let seconds = Hold::UntilReleased;
    node.call(&ForceParams { values, seconds, ..ForceParams::default() });
    let failure = node.refused(&configuration(&CLIMB.replace("\"late\"", "\"later\"")));
    assert_eq!(
        (failure.code, &*failure.findings[0].name),
        (Code::CannotChange, "late.delayedValue")
    );
    node.call(&ReleaseParams { names: vec!["late.*".into()], client: None });
    let entries = node.call(&JournalParams::default()).entries;
    assert!(entries.iter().all(|entry| entry.action != Action::Apply));
    let result = apply(&mut node, &CLIMB.replace("\"late\"", "\"later\""));
    assert_eq!((result.added, result.removed), (vec!["later".into()], vec!["late".into()]));
}

#[test]
fn what_is_read_while_blocks_go_is_answered_whole_or_not_at_all() {
    let mut node = Node::start(CLIMB);
    let participant = node.domain.join("reader");
    let (whole, refused, is_over) = (AtomicU64::new(0), AtomicU64::new(0), AtomicBool::new(false));
    let read = || {
        let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
        while !is_over.load(Ordering::Relaxed) {
            let names = vec!["more.*.delayedValue".to_owned(), "late.value".to_owned()];
            match client.call(&GetParams { names, ..GetParams::default() }) {
                Ok(read) => {
                    assert_eq!(read.values.0.len() as u64, read.total, "{read:?}");
                    assert_eq!(read.total, 4);
                    whole.fetch_add(1, Ordering::Relaxed);
                }
                Err(ClientError::Refused(failure)) => {
                    let code = failure.code;
                    assert!([Code::UnknownName, Code::Busy].contains(&code), "{failure:?}");
                    refused.fetch_add(1, Ordering::Relaxed);
                }
                Err(error) => panic!("{error}"),
            }
        }
    };
    thread::scope(|scope| {
        let reader = scope.spawn(read);
        for _ in 0..8 {
            for (text, count) in [(with_blocks(3), &whole), (CLIMB.to_owned(), &refused)] {
                apply(&mut node, &text);
                let before = count.load(Ordering::Relaxed);
                wait_until("the reader has asked again", || {
                    reader.is_finished() || count.load(Ordering::Relaxed) > before
                });
            }
        }
        is_over.store(true, Ordering::Relaxed);
        reader.join().unwrap();
    });
}

#[test]
fn what_was_set_stays_and_what_differs_between_the_files_is_taken() {
    let mut node = Node::start(CLIMB);
    let values = [("ramp.value", 2e9), ("late.setChangeRate", 2e9)].into_iter().collect();
    node.call(&SetParams { values, ..SetParams::default() });
    let result = apply(&mut node, &CLIMB.replace("setChangeRate = 1e9", "setChangeRate = 3e9"));
    assert_eq!(result.changed, ["late.setChangeRate"]);
    assert_eq!(value(&mut node, "ramp.value"), Some(Value::Number(2e9)));
    assert_eq!(value(&mut node, "late.setChangeRate"), Some(Value::Number(3e9)));
    let entries = node.call(&JournalParams::default()).entries;
    let changes = entries.iter().filter(|e| e.action == Action::Apply).flat_map(|e| &e.changes);
    let befores: Vec<_> = changes.map(|change| (&*change.name, change.before)).collect();
    assert_eq!(befores, [("late.setChangeRate", Value::Number(2e9))]);
}

#[test]
fn a_configuration_that_nobody_waits_for_any_more_is_not_applied() {
    let mut node = Node::start(CLIMB);
    node.client.wait_for(Duration::from_millis(1));
    let params = |configuration: String, dry_run: bool| ApplyParams {
        configuration,
        dry_run: Some(dry_run),
        allow_missed: Some(true),
        ..ApplyParams::default()
    };
    let error = node.client.call(&params(with_blocks(20_000), false)).unwrap_err();
    assert!(matches!(error, ClientError::NoAnswer { .. }), "{error}");
    node.client.wait_for(PATIENCE);
    wait_for_ok("it has been checked", || {
        let tried = node.client.call(&params(CLIMB.to_owned(), true));
        if let Err(error) = &tried {
            let is_busy =
                matches!(error, ClientError::Refused(failure) if failure.code == Code::Busy);
            assert!(is_busy, "{error}");
        }
        tried
    });
    assert!(node.call(&JournalParams::default()).entries.is_empty());
}

#[test]
fn a_dry_run_says_that_a_task_has_no_time_for_the_change() {
    // Ten thousand blocks in 200 us are too much for any machine.
    let busy = with_blocks(10_000).replace("2ms", "200us");
    let mut node = Node::start(&busy);
    let refused = wait_for_ok("it has no time for the change", || {
        let configuration = busy.replace("value = 1e9", "value = 1e8");
        let params = ApplyParams { configuration, dry_run: Some(true), ..ApplyParams::default() };
        match node.call(&params).refused {
            Some(refused) if refused.contains("--allow-missed") => Ok(refused),
            other => Err(format!("{other:?}")),
        }
    });
    assert!(refused.contains("task \"fast\" has 0 ns left"), "{refused}");
    node.process.stop();
}

#[test]
fn telemetry_follows_to_the_names_of_the_new_configuration() {
    let mut node = Node::start(CLIMB);
    apply(&mut node, &with_blocks(2));
    wait_for_ok("telemetry has the new names", || {
        let subscribe = "subscribe isochrone/level/telemetry --csv seen.csv --count 3";
        node.domain.run(subscribe).expect_code(0);
        let seen = node.domain.read("seen.csv");
        if seen.contains("more.1.delayedValue") { Ok(()) } else { Err(seen) }
    });
}

#[test]
fn while_an_apply_waits_nothing_more_is_taken_for_later_cycles() {
    let mut node = Node::start(CLIMB);
    let set = |at: Option<At>| SetParams {
        values: [("ramp.setChangeRate", 2.0)].into_iter().collect(),
        at,
        ..SetParams::default()
    };
    let later = set(Some(At::In(2_500)));
    let first = node.call(&later).transaction;
    let text = CLIMB.replace("setChangeRate = 1e9", "setChangeRate = 3e9");
    let client = Some("anna".to_owned());
    let params = ApplyParams { allow_missed: Some(true), client, ..configuration(&text) };
    let waits = node.refused(&params);
    assert_eq!(waits.code, Code::Busy);
    assert!(waits.message.contains(&format!("transaction {first} is still to come")), "{waits}");
    let refused = wait_for_ok("the apply is in the way", || {
        node.refused(&params);
        match node.client.call(&later) {
            Err(ClientError::Refused(refused)) => Ok(refused),
            other => Err(format!("{other:?}")),
        }
    });
    assert_eq!(refused.code, Code::Busy);
    assert!(refused.message.contains("an apply of \"anna\" waits"), "{refused}");
    node.call(&set(None));
    let applied = wait_for_ok("it is applied", || match node.client.call(&params) {
        Err(ClientError::Refused(refused)) if refused.code == Code::Busy => Err("it waits"),
        other => Ok(other.unwrap()),
    });
    assert!(applied.transaction.is_some());
    node.call(&later);
}
