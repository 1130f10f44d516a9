//! Another configuration for a node in a program that runs.

use crate::happened::{applied, applied_as, take_until};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_model::{Action, AskedBy, Code, Entry, Hold};
use isochrone_runtime::{ApplyError, End, IfMissed, Node, PreparedApply, Running, SendError};
use isochrone_testing::plants::CLIMB;
use isochrone_testing::wait_until;

/// So many ramps that climb, the first of which another task reads.
fn ramps(count: usize) -> String {
    let ramps = format!("name = \"ramp\"\ncount = {count}");
    CLIMB.replace("name = \"ramp\"", &ramps).replace("ramp.delayedValue", "ramp.0.delayedValue")
}

/// With a block more.
fn grown(count: usize) -> String {
    let fresh = "[[block]]\nname = \"fresh\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\n\
                 in = { value = 5.0, setChangeRate = 1000 }\n[[output]]";
    ramps(count).replace("[[output]]", fresh)
}

fn start() -> Running {
    let plan = Plan::new(Source::new("test.toml", ramps(4)), &Rules::default()).unwrap();
    let node = Node::prepare_alone(&plan).unwrap().start();
    wait_until("it comes to that", || {
        node.value("late.delayedValue").is_some_and(|value| value > 0.0)
    });
    node
}

fn prepare(node: &Running, text: &str) -> Result<PreparedApply, ApplyError> {
    node.prepare_apply(text, AskedBy::default())
}

/// Runs another configuration, and waits until all tasks have it.
fn apply(node: &Running, text: &str) -> Vec<Entry> {
    let prepared = prepare(node, text).unwrap();
    let events = node.events();
    let sent = node.apply(prepared, IfMissed::Allow).unwrap();
    let mut entries = applied_as(&events, Action::Apply, 2);
    entries.sort_by(|a, b| a.task.cmp(&b.task));
    for (entry, cycle) in entries.iter().zip(sent.cycles) {
        assert_eq!(entry.transaction, sent.number);
        assert!(entry.cycle >= cycle, "{entries:?}");
    }
    entries
}

#[test]
fn blocks_come_and_go_while_the_others_run_on_and_no_cycle_allocates() {
    let node = start();
    let mut last = 0.0;
    for turn in 0..10 {
        apply(&node, &grown(4 + turn));
        wait_until("it comes to that", || node.value("fresh.delayedValue") == Some(5.0));
        let value = node.value("ramp.0.delayedValue").unwrap();
        assert!(value > last, "{value} after {last}");
        last = value;
        assert!(node.value(&format!("ramp.{}.delayedValue", 3 + turn)).is_some());
        assert!(node.signals().find(&format!("ramp.{}.value", 4 + turn)).is_err());
        apply(&node, &ramps(4));
        wait_until("it comes to that", || {
            node.value("late.delayedValue").is_some_and(|value| value > last)
        });
        assert_eq!(node.value("fresh.delayedValue"), None);
    }
    let journal: Vec<Entry> = node.journal(0).collect();
    assert_eq!(journal.len(), 40, "one for each task and change");
    assert!(journal[0].configuration.as_ref().is_some_and(|applied| applied.contains("fresh")));
    let outcome = node.finish().unwrap();
    assert_eq!(outcome.end, End::Asked);
    for task in &outcome.tasks {
        if task.cpu_fraction.is_some() {
            assert_eq!(task.allocations, Some(0));
        }
    }
}

#[test]
fn values_and_forces_stay_and_a_constant_that_differs_is_taken() {
    let node = start();
    let events = node.events();
    node.set([("ramp.1.value", 7.0), ("ramp.2.setChangeRate", 2000.0)]).unwrap();
    node.force([("ramp.3.delayedValue", 42.0)], Hold::UntilReleased).unwrap();
    // What has not come back yet would keep a change waiting.
    applied(&events, 2);
    wait_until("it is forced", || node.value("ramp.3.delayedValue") == Some(42.0));
    let text = ramps(4).replace("setChangeRate = 1000.0", "setChangeRate = 1500.0");
    let entries = apply(&node, &text);
    let changed: Vec<&str> = entries[0].changes.iter().map(|change| &*change.name).collect();
    let rates = [0, 1, 2, 3].map(|ramp| format!("ramp.{ramp}.setChangeRate"));
    assert_eq!(changed, rates);
    let saved = node.save(&text).unwrap();
    assert!(saved.contains("value = 7.0") && !saved.contains("2000"), "{saved}");
    assert_eq!(
        node.forces().map(|forced| forced.name).collect::<Vec<_>>(),
        ["ramp.3.delayedValue"]
    );
    wait_until("it comes to that", || {
        node.value("ramp.3.delayedValue") == Some(42.0)
            && node.value("ramp.1.delayedValue") == Some(7.0)
    });
}

#[test]
fn what_cannot_be_changed_is_refused_and_nothing_happens() {
    let node = start();
    let events = node.events();
    node.force([("ramp.3.delayedValue", 42.0)], Hold::UntilReleased).unwrap();
    applied(&events, 1);
    let broken = ramps(4).replace("LimRateOfChangeCI", "LimRateOfChangeC");
    let Err(ApplyError::Configuration(findings)) = prepare(&node, &broken) else { panic!() };
    assert_eq!(findings.all.len(), 2);
    let kind = |text: &str| match prepare(&node, text) {
        Err(ApplyError::Refused(refusals)) => refusals.code,
        other => panic!("{other:?}"),
    };
    assert_eq!(kind(&ramps(4).replace("\"20ms\"", "\"40ms\"")), Code::CannotChange);
    assert_eq!(kind(&ramps(3)), Code::CannotChange);
    let stale = prepare(&node, &grown(4)).unwrap();
    assert_eq!(stale.summary().added, ["fresh"]);
    node.set([("ramp.0.value", 3.0)]).unwrap();
    let refused = node.apply(stale, IfMissed::Allow);
    assert!(matches!(refused, Err(ApplyError::Refused(_))), "{refused:?}");
    applied(&events, 1);
    assert!(node.journal(0).all(|entry| entry.action != Action::Apply));
}

/// As [`start`], with a slow task of this period.
fn start_with_slow(period: &str) -> (Running, String) {
    let text = ramps(4).replace("\"20ms\"", &format!("\"{period}\""));
    let plan = Plan::new(Source::new("test.toml", &*text), &Rules::default()).unwrap();
    let node = Node::prepare_alone(&plan).unwrap().start();
    wait_until("it comes to that", || {
        node.value("ramp.0.delayedValue").is_some_and(|value| value > 0.0)
    });
    (node, text)
}

/// How many tasks have changed: an apply has an entry for each.
fn changed(node: &Running) -> usize {
    node.journal(0).filter(|entry| entry.action == Action::Apply).count()
}

#[test]
fn the_other_tasks_are_operated_and_watched_while_a_change_waits_for_a_slow_one() {
    let (node, text) = start_with_slow("3s");
    let events = node.events();
    node.force([("ramp.1.delayedValue", 42.0)], Hold::UntilReleased).unwrap();
    applied(&events, 1);
    let grown = text.replace("count = 4", "count = 5");
    let prepared = prepare(&node, &grown).unwrap();
    let number = node.apply(prepared, IfMissed::Allow).unwrap().number;
    // Before any task has changed.
    node.release(["ramp.1.delayedValue"]).unwrap();
    node.force([("ramp.2.delayedValue", 7.0)], Hold::UntilReleased).unwrap();
    wait_until("it comes to that", || changed(&node) > 0);
    // Where this thread stands still until the slow one has changed, too, there is nothing to see.
    let before = node.value("task.fast.cycle").unwrap();
    node.set([("ramp.4.setChangeRate", 2000.0), ("late.setChangeRate", 5.0)]).unwrap();
    let mut went_on = false;
    wait_until("it comes to that", || {
        let shows = node.value("ramp.4.delayedValue").is_some_and(|value| value > 0.0)
            && node.value("ramp.2.delayedValue") == Some(7.0)
            && node.value("task.fast.cycle").is_some_and(|cycle| cycle > before);
        went_on |= shows && changed(&node) == 1;
        node.journal(0).filter(|entry| entry.action == Action::Set).count() == 2
    });
    let entries: Vec<Entry> = node.journal(0).collect();
    let of = |task: &str| -> Vec<Action> {
        let of_task = entries.iter().filter(|entry| entry.task == task);
        of_task.map(|entry| entry.action).filter(|action| *action != Action::Apply).collect()
    };
    assert_eq!(of("slow"), [Action::Set]);
    let force = Action::Force;
    assert_eq!(of("fast"), [force, Action::Release, force, Action::Set]);
    let applied: Vec<_> = entries.iter().filter(|entry| entry.transaction == number).collect();
    assert!(went_on || applied[1].unix_ns - applied[0].unix_ns < 1_000_000_000, "{entries:?}");
    assert_eq!(node.forces().map(|f| f.name).collect::<Vec<_>>(), ["ramp.2.delayedValue"]);
}

#[test]
fn values_are_read_and_set_until_all_tasks_have_another_configuration() {
    let node = start();
    let prepared = prepare(&node, &grown(6)).unwrap();
    let events = node.events();
    let number = node.apply(prepared, IfMissed::Allow).unwrap().number;
    node.set([("ramp.0.value", 3.0)]).unwrap();
    let mut readings = 0;
    let mut changed = 0;
    take_until(&events, |batch| {
        readings += batch.readings.len();
        changed += batch.applied.iter().filter(|entry| entry.transaction == number).count();
        match node.get(["ramp.*.delayedValue", "late.value"]) {
            // A task that stands has only so much room.
            Ok(_) | Err(SendError::Busy { .. }) => {}
            refused => panic!("{refused:?}"),
        }
        changed == 2 && readings > 0
    });
    assert!(node.set([("ramp.5.value", 3.0)]).is_ok());
}
