//! A running node and the programs that ask it, as processes.

use std::time::{Duration, Instant};

use crate::node::Node;
use isochrone_control::{
    Action, AlarmsParams, ApplyParams, ClientError, Code, DescribeParams, ForceParams,
    ForcesParams, GetParams, Hold, JournalParams, ReleaseParams, Role, SetParams, UndoParams,
    Value, Values,
};
use isochrone_testing::{Plant, wait_for_ok, wait_until};

fn level() -> Plant {
    Plant::new("level")
        .with("control = \"force\"")
        .with("[[protect]]\nnames = [\"guarded.*\"]")
        .with("[limits]\n\"ramp.setChangeRate\" = [0.0, 50.0]")
        .task("fast", "1ms")
        .task("slow", "4ms")
        .on("fast")
        .ramp("ramp", "value = 25.0, setChangeRate = 10.0")
        .block(
            "scale",
            "ScaleLinear",
            "x = \"ramp.delayedValue\", x1 = 0.0, x2 = 10.0, y1 = 0.0, y2 = 100.0, \
             yMin = -1000.0, yMax = 1000.0",
        )
        .on("slow")
        .ramp("late", "value = 1.0, setChangeRate = 1.0")
        .ramp("guarded", "value = 1.0, setChangeRate = 1.0")
        .on("fast")
        .output("level/out", &["scale.y"])
}

#[test]
fn pages_of_a_large_node_are_whole() {
    const COUNT: usize = 4000;
    let many = format!("name = \"late\"\ncount = {COUNT}\n");
    let mut node = Node::start(&level().replace("name = \"late\"\n", &many));
    let names = |parts: &[&str]| parts.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let described = node.client.signals(Some("late.*.value")).unwrap();
    let described: Vec<_> = described.into_iter().map(|signal| signal.name).collect();
    let expected: Vec<_> = (0..COUNT).map(|index| format!("late.{index}.value")).collect();
    assert_eq!(described, expected);
    let all = node.client.signals(None).unwrap().len();
    assert!(all > 8 * COUNT, "{all}");
    let mut read = Vec::new();
    loop {
        let page = node.call(&GetParams {
            names: names(&["late.*7.value", "late.17.value", "ramp.value"]),
            offset: Some(read.len() as u64),
            limit: Some(150),
            types: None,
        });
        assert_eq!(page.total, 401, "17 is one of those that end with 7");
        read.extend(page.values.iter().map(|(name, _)| name.to_owned()));
        if read.len() as u64 >= page.total {
            break;
        }
    }
    let mut sevens: Vec<_> = (7..COUNT).step_by(10).map(|n| format!("late.{n}.value")).collect();
    sevens.push("ramp.value".into());
    assert_eq!(read, sevens);
    let unknown = GetParams { names: names(&["lat.*.value"]), ..GetParams::default() };
    assert_eq!(node.refused(&unknown).code, Code::UnknownName);
    let globs = GetParams { names: vec!["late.*7.*".into(); COUNT], ..GetParams::default() };
    let refused = node.refused(&globs);
    assert_eq!(refused.code, Code::InvalidParams);
    assert!(refused.message.contains("4000 names with *"), "{}", refused.message);
    let fewer = level().replace("name = \"late\"\n", "name = \"late\"\ncount = 1000\n");
    let fewer =
        ApplyParams { configuration: fewer, allow_missed: Some(true), ..Default::default() };
    node.call(&fewer);
    assert_eq!(node.client.signals(Some("late.*.value")).unwrap().len(), 1000);
    let sevens = GetParams { names: names(&["late.*7.value"]), ..GetParams::default() };
    assert_eq!(node.call(&sevens).total, 100);
}

fn set<const N: usize>(values: [(&str, f64); N]) -> SetParams {
    SetParams { values: values.into_iter().collect(), ..SetParams::default() }
}

fn force<const N: usize>(values: [(&str, f64); N], seconds: Hold) -> ForceParams {
    ForceParams { values: values.into_iter().collect(), seconds, ..ForceParams::default() }
}

fn number(value: f64) -> Option<Value> {
    Some(Value::Number(value))
}

#[test]
fn a_node_describes_itself_and_its_signals() {
    let mut node = Node::start(&level());
    let description = node.call(&DescribeParams {});
    assert_eq!((&*description.node, &*description.configuration.file), ("level", "tank.toml"));
    assert_eq!(description.version, env!("CARGO_PKG_VERSION"));
    assert_eq!(description.configuration.sha256.len(), 64);
    assert!(!description.configuration.changed);
    assert!(description.started_unix_ns > 1_700_000_000_000_000_000);
    let tasks: Vec<_> = description.tasks.iter().map(|t| (&*t.name, t.period_ns)).collect();
    assert_eq!(tasks, [("fast", 1_000_000), ("slow", 4_000_000)]);
    let signals = node.client.signals(None).unwrap();
    for task in &description.tasks {
        let parameters = signals
            .iter()
            .filter(|signal| signal.task == task.name && signal.role == Role::Parameter);
        assert_eq!(parameters.count() as u64, task.parameters, "{}", task.name);
    }
    let wired: Vec<_> =
        signals.iter().filter(|s| s.role == Role::Wired).map(|s| &*s.name).collect();
    assert_eq!(wired, ["scale.x"]);
    let some = node.client.signals(Some("*.delayedValue")).unwrap();
    assert_eq!(some.len(), 3);
    assert!(some.iter().all(|signal| signal.role == Role::Output && !signal.doc.is_empty()));
    let first = node.cycle("fast");
    node.wait_for_cycle("fast", first + 1);
}

#[test]
fn what_is_set_and_forced_is_acknowledged_read_undone_released_and_kept_in_the_journal() {
    let mut node = Node::start(&level());
    let comment = Some("slower".to_owned());
    let client = Some("anna".to_owned());
    let values = set([("ramp.setChangeRate", 5.0), ("late.value", 3.0)]);
    let done = node.call(&SetParams { comment, client, ..values });
    assert_eq!(done.tasks.keys().collect::<Vec<_>>(), ["fast", "slow"]);
    assert!(done.tasks.values().all(|part| !part.pending));
    assert_eq!(done.before.get("ramp.setChangeRate"), number(10.0));
    assert_eq!(done.before.get("late.value"), number(1.0));
    assert!(done.warnings.is_empty());
    let read = node.get(&["late.value", "ramp.setChangeRate"]);
    let names: Vec<_> = read.iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["late.value", "ramp.setChangeRate"], "in the order of the request");
    assert_eq!(read.get("ramp.setChangeRate"), number(5.0));
    assert!(node.call(&DescribeParams {}).configuration.changed);

    let (at, later) = node.set_ahead("fast", 900, &set([("ramp.value", 7.0)]));
    assert!(later.tasks["fast"].cycle >= at);

    let bert = Some("bert".to_owned());
    let undone = node.call(&UndoParams { transaction: done.transaction, client: bert.clone() });
    assert_eq!(undone.before.get("late.value"), number(3.0));
    assert_eq!(node.get(&["late.value"]).get("late.value"), number(1.0));

    let forced = node.call(&force([("scale.y", 42.0)], Hold::UntilReleased));
    assert_eq!(forced.until["fast"], None);
    assert_eq!(node.get(&["scale.y"]).get("scale.y"), number(42.0));
    let [known] = &node.call(&ForcesParams::default()).forces[..] else { panic!() };
    assert_eq!((&*known.name, known.since_cycle), ("scale.y", forced.tasks["fast"].cycle));
    assert!(node.client.signals(Some("scale.y")).unwrap()[0].forced);
    node.call(&ReleaseParams { names: vec!["*.*".to_owned()], client: bert });
    assert!(node.call(&ForcesParams::default()).forces.is_empty());
    let short = node.call(&force([("ramp.value", 9.0)], Hold::Seconds(0.05)));
    let until = short.until["fast"].unwrap();
    assert_eq!(until, short.tasks["fast"].cycle + 50);
    wait_until("the force has ended", || node.call(&ForcesParams::default()).forces.is_empty());

    let journal = node.call(&JournalParams::default());
    let actions: Vec<_> = journal.entries.iter().map(|entry| entry.action).collect();
    use Action::{Expiry, Force, Release, Set, Undo};
    assert_eq!(actions, [Set, Set, Set, Undo, Undo, Force, Release, Force, Expiry]);
    assert_eq!(journal.total, 9);
    let first = &journal.entries[0];
    assert_eq!(
        (first.by.client.as_deref(), first.by.comment.as_deref()),
        (Some("anna"), Some("slower"))
    );
    for entry in journal.entries.iter().filter(|one| matches!(one.action, Undo | Release)) {
        assert_eq!(entry.by.client.as_deref(), Some("bert"), "{entry:?}");
    }
    assert_eq!(first.by.process, Some(std::process::id()));
    let expiry = &journal.entries[8];
    assert!(expiry.cycle >= until && expiry.transaction == short.transaction);
    let rest = node.call(&JournalParams { since: Some(9), limit: Some(5) });
    assert_eq!(rest.entries, journal.entries[8..]);
}

#[test]
fn the_running_values_are_saved_in_pieces_and_the_rest_of_the_file_stays() {
    let text = level().to_string() + &"# \"né\"\\\n".repeat(100_000);
    let mut node = Node::start(&text);
    node.call(&set([("ramp.setChangeRate", 5.0)]));
    let saved = node.client.save().unwrap();
    assert!(saved == text.replace("setChangeRate = 10.0", "setChangeRate = 5.0"));
    node.domain.write("saved.toml", &saved);
}

#[test]
fn a_block_in_error_and_an_input_that_is_not_ok_are_alarms_until_they_are_well_again() {
    let text = level().to_string()
        + "[[input]]\nname = \"sensor\"\nservice = \"plant/sensor\"\ntask = \"fast\"\nmax_age = \"200ms\"\n";
    let mut node = Node::start(&text);
    let done = node.call(&set([("ramp.setChangeRate", 0.0), ("late.setChangeRate", -1.0)]));
    let [warning] = &done.warnings[..] else { panic!("{done:?}") };
    assert_eq!(warning.name, "late");
    let mut alarms = Vec::new();
    wait_until("both are alarms", || {
        alarms = node.call(&AlarmsParams::default()).alarms;
        alarms.len() >= 2
    });
    let [sensor, late] = &alarms[..] else { panic!("{alarms:?}") };
    assert_eq!((&*sensor.name, sensor.status, sensor.count), ("sensor", None, 1));
    assert!(sensor.meaning.contains("plant/sensor"), "{sensor:?}");
    assert_eq!((&*late.name, late.count), ("late", 1));
    assert!(warning.message.contains(&late.meaning), "{late:?} {warning:?}");
    assert_eq!(late.since_cycle, done.tasks["slow"].cycle);
    node.call(&set([("late.setChangeRate", 1.0)]));
    let sensor = node.domain.publish("plant/sensor --value 1 --rate 100");
    wait_until("all is well", || node.call(&AlarmsParams::default()).total == 0);
    sensor.kill();
    wait_until("the sensor is missed", || {
        alarms = node.call(&AlarmsParams::default()).alarms;
        !alarms.is_empty()
    });
    let [sensor] = &alarms[..] else { panic!("{alarms:?}") };
    assert!(sensor.count >= 2, "{sensor:?}");
}

#[test]
fn what_cannot_be_done_is_refused_with_its_code_and_all_findings_and_changes_nothing() {
    let mut node = Node::start(&level());
    let cycle = node.cycle("fast");
    let at = |at: u64| SetParams { at: Some(at.into()), ..set([("ramp.value", 1.0)]) };
    for (request, code, help) in [
        (set([("ramp.valu", 1.0), ("late.value", 2.0)]), Code::UnknownName, "did you mean"),
        (set([("scale.x", 1.0)]), Code::NotWritable, "ramp.delayedValue"),
        (set([("scale.y", 1.0)]), Code::NotWritable, "force it"),
        (set([("guarded.value", 1.0)]), Code::Forbidden, "[[protect]]"),
        (set([("ramp.setChangeRate", 50.5)]), Code::WrongValue, "[limits]"),
        (set([("ramp.value", f64::NAN)]), Code::WrongValue, "write a number"),
        (set([("ramp.value", 1.0), ("ramp.value", 2.0)]), Code::WrongValue, "name it once"),
        (set([]), Code::WrongValue, "name at least one"),
        (at(cycle), Code::TooLate, "a later cycle"),
        (at(cycle + 3_600_000), Code::TooLate, "when it is near"),
    ] {
        let failure = node.refused(&request);
        assert_eq!(failure.code, code, "{failure}");
        assert!(failure.to_string().contains(help), "{failure}");
    }
    let typed = SetParams { values: [("ramp.value", true)].into_iter().collect(), ..set([]) };
    assert_eq!(node.refused(&typed).code, Code::WrongValue);
    let all = node.refused(&set([("ramp.x", 1.0), ("guarded.value", 1.0), ("scale.y", 1.0)]));
    assert_eq!(all.findings.len(), 3, "{all:?}");
    let names: Vec<String> = (0..10_000).map(|n| format!("nothing.{n}")).collect();
    let values: Values<_> = names.iter().map(|name| (name.as_str(), 1.0)).collect();
    let failure = node.refused(&SetParams { values, ..set([]) });
    assert!(failure.to_string().contains("at most 4096"), "{failure}");
    let failure = node.refused(&GetParams { names, ..GetParams::default() });
    assert!(failure.to_string().contains("at most 4096"), "{failure}");
    let comment = Some("x".repeat(2000));
    let failure = node.refused(&SetParams { comment, ..set([("ramp.value", 1.0)]) });
    assert_eq!(failure.code, Code::InvalidParams);
    let failure = node.refused(&UndoParams { transaction: 17, client: None });
    assert_eq!(failure.code, Code::UnknownName);
    let long = Some("x".repeat(101));
    let failure = node.refused(&UndoParams { transaction: 17, client: long.clone() });
    assert_eq!(failure.code, Code::InvalidParams);
    let failure = node.refused(&ReleaseParams { names: vec!["*".to_owned()], client: long });
    assert_eq!(failure.code, Code::InvalidParams);
    let failure = node.refused(&force([("ramp.value", 1.0)], Hold::Seconds(0.0)));
    assert_eq!(failure.code, Code::WrongValue);
    assert!(node.call(&JournalParams::default()).entries.is_empty());
    assert!(!node.call(&DescribeParams {}).configuration.changed);
}

#[test]
fn what_is_far_ahead_is_answered_as_pending_and_happens_in_its_cycle() {
    let mut node = Node::start(&level());
    // On a busy machine it may be less than a second ahead by the time that the node is asked.
    let (at, done) = (0..20)
        .map(|_| node.set_ahead("fast", 3_000, &set([("ramp.value", 7.0)])))
        .find(|(_, done)| done.tasks["fast"].pending)
        .unwrap();
    assert_eq!(done.tasks["fast"].cycle, at);
    assert!(done.before.0.is_empty());
    let mut happened = None;
    wait_until("it has happened", || {
        let journal = node.call(&JournalParams::default()).entries;
        happened = journal.into_iter().find(|entry| entry.transaction == done.transaction);
        happened.is_some()
    });
    assert!(happened.unwrap().cycle >= at);
}

#[test]
fn who_has_as_many_transactions_to_come_as_one_may_is_told_so_and_keeps_nobody_from_a_release() {
    let mut node = Node::start(&level());
    node.call(&force([("scale.y", 3.0)], Hold::UntilReleased));
    let by = |name: &str| SetParams { client: Some(name.to_owned()), ..set([("ramp.value", 7.0)]) };
    // On a busy machine the first may have happened before the last were sent; then more may be.
    let (mut described, mut at) = (None::<Instant>, 0);
    let mut fill = |node: &mut Node, name: &str| {
        wait_for_ok("no more may be to come", || {
            if described.is_none_or(|described| described.elapsed() > Duration::from_millis(500)) {
                (at, described) = (node.cycle("fast") + 9_400, Some(Instant::now()));
            }
            match node.client.call(&SetParams { at: Some(at.into()), ..by(name) }) {
                Ok(_) => Err("it was accepted"),
                Err(ClientError::Refused(failure)) if failure.code == Code::TooLate => {
                    described = None;
                    Err("it was too late")
                }
                Err(ClientError::Refused(failure)) => Ok(failure),
                Err(error) => panic!("{error}"),
            }
        })
    };
    let busy = fill(&mut node, "anna");
    assert_eq!(busy.code, Code::Busy, "{busy}");
    assert!(busy.to_string().contains("32 of \"anna\""), "{busy}");
    let busy = fill(&mut node, "ben");
    assert!(busy.to_string().contains("of \"ben\""), "{busy}");
    let released = node.call(&ReleaseParams { names: vec!["scale.y".to_owned()], client: None });
    assert_eq!(released.before.0.len(), 1, "{released:?}");
    node.call(&by("anna"));
    drop(node.participant);
}
