//! The states of process alarms, and acknowledgements.

use std::collections::HashMap;

use isochrone_control::desk::{AlarmRecord, TaskAlarms};
use isochrone_engine::{AlarmEvent, AlarmWatch, Plan, Rules, Source, TaskEngine};
use isochrone_model::*;

/// An alarm of each severity on one level.
const NODE: &str = r#"
[node]
name = "tank"
[[task]]
name = "fast"
period = "100ms"
[[variable]]
name = "level"
initial = 0.0
[[alarm]]
name = "high"
when = "level > 1"
[[alarm]]
name = "event"
when = "level > 2"
severity = "info"
"#;

/// A task with its alarms.
struct Tank {
    engine: TaskEngine,
    watch: AlarmWatch,
    alarms: TaskAlarms,
    cycle: u64,
}

impl Tank {
    fn new() -> Self {
        let plan = plan(NODE);
        let task = &plan.tasks[0];
        Self {
            engine: TaskEngine::build(&plan).unwrap().remove(0),
            watch: AlarmWatch::of(task),
            alarms: TaskAlarms::new(&task.name, &task.alarms),
            cycle: 0,
        }
    }

    /// Runs a cycle with a level; returns what changed.
    fn level(&mut self, level: f64) -> Vec<(AlarmChange, u64)> {
        self.engine.give_variable(0, level);
        self.engine.step(self.cycle);
        let mut events: Vec<AlarmEvent> = Vec::new();
        self.watch.look(self.engine.image(), self.cycle, |event| {
            events.push(event);
            true
        });
        self.cycle += 1;
        let cycle = self.cycle;
        let entries = events.iter().flat_map(|event| self.alarms.note(event, cycle * 100));
        entries.map(|entry| (entry.change, entry.occurrence)).collect()
    }

    fn ack(&mut self, name: &str, occurrence: Option<u64>) -> Result<ProcessAlarm, Refusal> {
        let at = (self.cycle, self.cycle * 100);
        let done = self.alarms.acknowledge(name, occurrence, at, AskedBy::default());
        done.expect("there is the alarm").map(|acknowledged| acknowledged.alarm)
    }

    fn state(&self) -> Option<(AlarmState, u64, u64)> {
        let mut standing = self.alarms.standing(0).filter(|alarm| alarm.name == "high");
        standing.next().map(|alarm| (alarm.state, alarm.occurrence, alarm.unacknowledged))
    }
}

/// That `high` came once.
fn counts() -> HashMap<String, u64> {
    [("high".to_owned(), 1)].into()
}

fn plan(text: &str) -> Plan {
    Plan::new(Source::new("tank.toml", text), &Rules::default()).unwrap()
}

#[test]
fn an_alarm_goes_through_the_states_of_isa_18_2() {
    let mut tank = Tank::new();
    assert_eq!(tank.state(), None, "normal");
    assert_eq!(tank.level(1.5), [(AlarmChange::Came, 1)]);
    assert_eq!(tank.state(), Some((AlarmState::ActiveUnacknowledged, 1, 1)));
    assert_eq!(tank.ack("high", None).unwrap().state, AlarmState::ActiveAcknowledged);
    assert_eq!(tank.state(), Some((AlarmState::ActiveAcknowledged, 1, 0)));
    assert_eq!(tank.level(0.5), [(AlarmChange::Went, 1)]);
    assert_eq!(tank.state(), None, "normal again");
    tank.level(1.5);
    tank.level(0.5);
    assert_eq!(tank.state(), Some((AlarmState::ReturnedUnacknowledged, 2, 1)));
    tank.level(1.5);
    assert_eq!(tank.state(), Some((AlarmState::ActiveUnacknowledged, 3, 2)));
    tank.level(0.5);
    assert_eq!(tank.ack("high", None).unwrap().state, AlarmState::Normal);
    assert_eq!(tank.state(), None);
}

#[test]
fn an_acknowledged_occurrence_leaves_the_ones_behind_it() {
    let mut tank = Tank::new();
    for level in [1.5, 0.5, 1.5, 0.5, 1.5] {
        tank.level(level);
    }
    let alarm = tank.alarms.standing(0).next().unwrap();
    let cycles = |alarm: &ProcessAlarm| [alarm.first, alarm.last].map(|at| at.unwrap().cycle);
    assert_eq!(cycles(&alarm), [0, 4]);
    let alarm = tank.ack("high", Some(2)).unwrap();
    assert_eq!((alarm.state, alarm.unacknowledged), (AlarmState::ActiveUnacknowledged, 1));
    assert_eq!(cycles(&alarm), [4, 4]);
    let why = tank.ack("high", Some(2)).unwrap_err();
    assert_eq!(why.code, Code::Conflict);
    assert!(why.message.contains("occurrence 2 of \"high\" is acknowledged already"), "{why}");
    let why = tank.ack("high", Some(4)).unwrap_err();
    assert!(why.message.contains("has no occurrence 4; its newest one is 3"), "{why}");
    assert!(tank.ack("high", Some(0)).unwrap_err().message.contains("no occurrence 0"));
    tank.ack("high", Some(3)).unwrap();
    assert!(tank.alarms.acknowledge("hgh", None, (0, 0), AskedBy::default()).is_none());
}

#[test]
fn an_event_needs_no_acknowledgement() {
    let mut tank = Tank::new();
    assert!(tank.ack("high", None).unwrap_err().message.contains("\"high\" was never active"));
    tank.level(3.0);
    let event = tank.alarms.standing(0).find(|alarm| alarm.name == "event").unwrap();
    assert_eq!((event.state, event.unacknowledged), (AlarmState::ActiveAcknowledged, 0));
    assert_eq!(event.last.unwrap().value, Value::Number(3.0));
    assert!(tank.ack("event", None).unwrap_err().message.contains("its severity is info"));
    tank.level(0.0);
    assert!(tank.alarms.standing(0).all(|alarm| alarm.name != "event"));
}

#[test]
fn an_alarm_that_cannot_be_evaluated_is_listed_and_keeps_its_state() {
    let mut tank = Tank::new();
    tank.level(1.5);
    tank.ack("high", None).unwrap();
    let told = tank.level(f64::NAN);
    assert_eq!(told, [(AlarmChange::NotEvaluated, 1), (AlarmChange::NotEvaluated, 0)]);
    let evaluated: Vec<_> = tank.alarms.standing(0).map(|it| (it.state, it.evaluated)).collect();
    let expected = [(AlarmState::ActiveAcknowledged, false), (AlarmState::Normal, false)];
    assert_eq!(evaluated, expected);
    assert_eq!(tank.alarms.count_standing(), 2);
    let next_page: Vec<_> = tank.alarms.standing(1).map(|it| it.state).collect();
    assert_eq!(next_page, [AlarmState::Normal]);
    let told = tank.level(0.0);
    assert_eq!(
        told,
        [(AlarmChange::Evaluated, 1), (AlarmChange::Went, 1), (AlarmChange::Evaluated, 0)]
    );
}

#[test]
fn a_new_configuration_keeps_what_is_known_of_an_alarm_of_the_same_definition() {
    let mut tank = Tank::new();
    tank.level(1.5);
    let words = NODE.replace("when = \"level > 1\"", "when = \"level > 1\"\ntext = \"Tank\"");
    tank.alarms.change(&plan(&words).tasks[0].alarms, &counts());
    assert_eq!(tank.state(), Some((AlarmState::ActiveUnacknowledged, 1, 1)));
    assert_eq!(tank.alarms.standing(0).next().unwrap().text, "Tank");
    let other = NODE.replace("level > 1\"", "level > 1.1\"");
    assert_eq!(tank.alarms.lost(&plan(&other).tasks[0].alarms).collect::<Vec<_>>(), [("high", 1)]);
    tank.alarms.change(&plan(&other).tasks[0].alarms, &counts());
    assert_eq!(tank.state(), None);
}

#[test]
fn occurrences_of_an_alarm_are_counted_on_when_its_condition_is_edited() {
    let mut tank = Tank::new();
    tank.level(1.5);
    let other = plan(&NODE.replace("level > 1\"", "level > 1.1\""));
    tank.alarms.change(&other.tasks[0].alarms, &counts());
    let refused = tank.ack("high", Some(1)).unwrap_err();
    assert_eq!(refused.message, "occurrence 1 of \"high\" is acknowledged already");
    // The cycle tells that it went, then that it comes as another alarm.
    let mut later = TaskAlarms::new("fast", &other.tasks[0].alarms);
    let records: Vec<_> = tank.alarms.records().map(AlarmRecord::of_another_definition).collect();
    later.restore(&records.iter().map(|it| (it.name.as_str(), it)).collect());
    tank.alarms = later;
    tank.level(0.0);
    assert_eq!(tank.level(1.5), [(AlarmChange::Came, 2)]);
}

#[test]
fn what_is_known_of_an_alarm_goes_through_json_into_another_run() {
    let mut tank = Tank::new();
    tank.level(1.5);
    tank.ack("high", None).unwrap();
    let records: Vec<_> = tank.alarms.records().cloned().collect();
    let json = serde_json::to_string(&records).unwrap();
    let records: Vec<AlarmRecord> = serde_json::from_str(&json).unwrap();
    let mut later = Tank::new();
    later.alarms.restore(&records.iter().map(|it| (it.name.as_str(), it)).collect());
    assert_eq!(later.state(), Some((AlarmState::ActiveAcknowledged, 1, 0)));
    // The engine went on with an active alarm, and tells of it once more.
    assert_eq!(later.level(1.5), []);
    assert_eq!(later.level(0.5), [(AlarmChange::Went, 1)]);
    assert_eq!(later.level(1.5), [(AlarmChange::Came, 2)]);
}
