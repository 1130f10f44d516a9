//! What a program is told of a node that runs in it: alarms, outcome, report, errors.

use std::error::Error;

use isochrone_control::{ActiveAlarm, AlarmsParams, Client, ProcessAlarm};
use isochrone_engine::{Plan, Rules, Source};
use isochrone_ipc::{IsolatedDomain, Participant};
use isochrone_runtime::{Alarm, Node, Running};
use isochrone_testing::{PATIENCE, wait_until};
use isochrone_timing::WarningCode;

/// A scale whose lower limit is above its upper one.
const BROKEN: &str = r#"
[node]
name = "broken"
[[task]]
name = "fast"
period = "1ms"
[[block]]
name = "scale"
type = "ScaleLinear"
in = { x = 1.0, x1 = 0.0, y1 = 0.0, x2 = 5.0, y2 = 1.0, yMin = 10.0, yMax = -10.0 }
"#;

fn plan(text: &str) -> Plan {
    Plan::new(Source::new("broken.toml", text), &Rules::default()).unwrap()
}

fn alarm_of(node: &Running) -> ActiveAlarm {
    let mut alarms = Vec::new();
    wait_until("there is an alarm", || {
        alarms = node.active_alarms();
        !alarms.is_empty()
    });
    let [alarm] = &alarms[..] else { panic!("{alarms:?}") };
    alarm.clone()
}

#[test]
fn the_alarms_of_a_node_that_nobody_can_operate_are_told_to_its_program() {
    let off = BROKEN.replace("name = \"broken\"", "name = \"broken\"\ncontrol = \"off\"");
    for text in [BROKEN, &off] {
        let node = Node::prepare_alone(&plan(text)).unwrap().start();
        let alarm = alarm_of(&node);
        assert_eq!((&*alarm.name, &*alarm.task, alarm.status), ("scale", "fast", Some(0x8200)));
        assert_eq!(alarm.count, 1, "it lasts from the first cycle that ran");
        assert!(alarm.since_unix_ns.is_some() && !alarm.meaning.is_empty(), "{alarm:?}");
    }
}

#[test]
fn the_alarms_of_a_program_are_the_rows_of_the_method() {
    let domain = IsolatedDomain::new("alarms").unwrap();
    let participant = Participant::join("broken", &domain).unwrap();
    let node = Node::prepare(&plan(BROKEN), participant).unwrap().start();
    let own = alarm_of(&node);
    let operator = Participant::join("operator", &domain).unwrap();
    let mut client = Client::connect(&operator, "broken", PATIENCE).unwrap();
    let asked = client.call(&AlarmsParams::default()).unwrap();
    assert_eq!(asked.total, 1);
    // The two instants are of two readings of the clocks.
    let without_time = |alarm: &ActiveAlarm| ActiveAlarm { since_unix_ns: None, ..alarm.clone() };
    assert_eq!(without_time(&asked.alarms[0]), without_time(&own));
}

#[test]
fn a_program_sets_a_variable_and_reads_it_as_it_reads_an_output() {
    let text = BROKEN.replace("x = 1.0", "x = \"goal\"").replace(
        "[[block]]",
        "[[variable]]\nname = \"goal\"\ninitial = 20.0\nrange = [0.0, 50.0]\n[[block]]",
    );
    let node = Node::prepare_alone(&plan(&text)).unwrap().start();
    wait_until("a cycle was shown", || node.value("goal") == Some(20.0));
    node.set([("goal", 35.5)]).unwrap();
    wait_until("it has the value", || node.value("goal") == Some(35.5));
    let refused = node.set([("goal", 50.5)]).unwrap_err().to_string();
    assert!(refused.contains("50.5 is outside the limits of \"goal\", 0.0 to 50.0"), "{refused}");
    assert!(node.save(&text).unwrap().contains("initial = 35.5"));
}

#[test]
fn block_errors_are_an_alarm_of_the_outcome_and_a_number_of_its_report() {
    let plan = plan(BROKEN);
    let node = Node::prepare_alone(&plan).unwrap().with_cycles(Some(20)).start();
    node.wait();
    let outcome = node.finish().unwrap();
    let steps = outcome.alarms.iter().find_map(|alarm| match alarm {
        Alarm::BlockErrors { task, steps } if task == "fast" => Some(*steps),
        _ => None,
    });
    assert_eq!(steps, Some(20), "{:?}", outcome.alarms);
    let missed = outcome.alarms.iter().any(|it| matches!(it, Alarm::MissedReleases { .. }));
    assert_eq!(missed, outcome.tasks[0].missed > 0);

    let report = outcome.report();
    let [task] = &report.tasks[..] else { panic!("{:?}", report.tasks) };
    assert_eq!((&*task.task.name, task.task.cycles), ("fast", 20));
    assert_eq!(task.task.block_errors, Some(20));
    let codes: Vec<_> = report.warnings.iter().map(|warning| &warning.code).collect();
    assert!(!codes.contains(&&WarningCode::BlockErrors), "{codes:?}");
    assert_eq!(codes.len(), outcome.refusals.len());
    assert!(!report.started.is_empty() && report.environment.kernel.is_some());
}

#[test]
fn an_outcome_says_what_the_process_alarms_did_and_which_of_them_stand() {
    let alarms = "[[variable]]\nname = \"level\"\ninitial = 1.0\n\
        [[alarm]]\nname = \"high\"\nwhen = \"level > 1.6\"\n\
        [[alarm]]\nname = \"low\"\nwhen = \"level < 0.5\"\n";
    let node = Node::prepare_alone(&plan(&format!("{BROKEN}{alarms}"))).unwrap().start();
    for (level, alarm) in [(2.0, "high"), (0.0, "low")] {
        node.set([("level", level)]).unwrap();
        let is_new = |it: &ProcessAlarm| it.name == alarm && it.state.is_active();
        wait_until("it came", || node.process_alarms().iter().any(is_new));
    }
    node.acknowledge("low", None).unwrap();
    let outcome = node.finish().unwrap();
    let totals = outcome.process_alarms.clone().unwrap();
    let counts = (totals.came, totals.standing, totals.unacknowledged, totals.lost);
    assert_eq!((counts, &*totals.names), ((2, 1, 1, 0), &["low".to_owned()][..]));
    assert_eq!(outcome.report().process_alarms, Some(totals));
    let without = Node::prepare_alone(&plan(BROKEN)).unwrap().start().finish().unwrap();
    assert_eq!(without.process_alarms, None);
}

#[test]
fn an_error_that_a_main_returns_is_shown_as_its_sentence() {
    let text = BROKEN.replace("ScaleLinear", "ScaleLinea").replace("1ms", "1 ms?");
    let findings = Plan::new(Source::new("broken.toml", text), &Rules::default()).unwrap_err();
    let error: Box<dyn Error> = Box::new(findings);
    let shown = format!("{error:?}");
    assert_eq!(shown, error.to_string());
    let lines: Vec<&str> = shown.lines().collect();
    assert_eq!((lines.len(), lines[0]), (3, "broken.toml: 2 errors"), "{shown}");
    assert!(lines[2].starts_with("broken.toml:9:8: "), "{shown}");
    assert!(lines[2].contains("ScaleLinear"), "the remedy: {shown}");

    let missing = Plan::read("/nonexistent/level.toml", &Rules::default()).unwrap_err();
    assert!(format!("{missing:?}").starts_with("cannot read /nonexistent/level.toml: "));
}
