//! The process alarms of a task, with what people have acknowledged, after ISA-18.2.

use std::collections::HashMap;

use isochrone_blocks::PinType;
use isochrone_engine::{AlarmEvent, AlarmPlan, nearest_name};
use isochrone_model::{
    Action, AlarmChange, AlarmEntry, AlarmMoment, AlarmState, AlarmTotals, AskedBy, Code, Entry,
    ProcessAlarm, Refusal, Value,
};
use serde::{Deserialize, Serialize};

use super::Operator;
use super::journal::{Changed, Record, SignalPlace};
use super::permissions::Intent;

/// What is known of an alarm beside its definition, and outlives a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct AlarmRecord {
    /// Its name.
    pub name: String,
    /// Whether it is active.
    pub active: bool,
    /// The number of its newest occurrence; 0: there was none.
    pub occurrence: u64,
    /// The number of the last occurrence that was acknowledged; 0: none was.
    pub acknowledged: u64,
    /// When it came, for the first time since it was last acknowledged.
    pub first: Option<AlarmMoment>,
    /// When its newest occurrence came.
    pub came: Option<AlarmMoment>,
    /// When it last came or went.
    pub last: Option<AlarmMoment>,
}

/// The process alarms of a task.
#[derive(Debug, Clone, Default)]
pub struct TaskAlarms {
    task: String,
    alarms: Vec<Alarm>,
}

/// An acknowledgement that was taken.
#[derive(Debug, Clone)]
pub struct Acknowledgement {
    /// The last occurrence that was acknowledged before.
    pub before: u64,
    /// The event; it has no number yet.
    pub entry: AlarmEntry,
    /// The alarm after it.
    pub alarm: ProcessAlarm,
}

#[derive(Debug, Clone)]
struct Alarm {
    plan: AlarmPlan,
    evaluated: bool,
    record: AlarmRecord,
}

impl TaskAlarms {
    /// The alarms of a task, none of which was ever active.
    pub fn new(task: &str, plans: &[AlarmPlan]) -> Self {
        let alarms = plans.iter().cloned().map(Alarm::new).collect();
        Self { task: task.to_owned(), alarms }
    }

    /// Their definitions.
    pub fn plans(&self) -> impl Iterator<Item = &AlarmPlan> {
        self.alarms.iter().map(|alarm| &alarm.plan)
    }

    /// What is known of those that were ever active, to be [restored](Self::restore).
    pub fn records(&self) -> impl Iterator<Item = &AlarmRecord> {
        let records = self.alarms.iter().map(|alarm| &alarm.record);
        records.filter(|record| record.occurrence > 0)
    }

    /// Takes over what was known of alarms, by their names.
    pub fn restore(&mut self, records: &HashMap<&str, &AlarmRecord>) {
        for alarm in &mut self.alarms {
            if let Some(record) = records.get(alarm.plan.name.as_str()) {
                alarm.record = (*record).clone();
            }
        }
    }

    /// Goes over to the alarms of another configuration. What is known of alarms of the same definition stays; one of
    /// another definition, or of another task, begins anew, but its occurrences are counted on: `counts` has the number of
    /// the newest one by name.
    pub fn change(&mut self, plans: &[AlarmPlan], counts: &HashMap<String, u64>) {
        let new = Self::new(&self.task, plans);
        let old = std::mem::replace(self, new).alarms;
        for alarm in &mut self.alarms {
            if let Some(old) = old.iter().find(|old| alarm.plan.has_definition_of(&old.plan)) {
                (alarm.evaluated, alarm.record) = (old.evaluated, old.record.clone());
            } else if let Some(count) = counts.get(&alarm.plan.name) {
                let record = &mut alarm.record;
                (record.occurrence, record.acknowledged) = (*count, *count);
            }
        }
    }

    /// Those with occurrences that nobody has acknowledged and that another configuration does not go on with, each with
    /// how many these are.
    pub fn lost(&self, plans: &[AlarmPlan]) -> impl Iterator<Item = (&str, u64)> {
        let is_lost = |alarm: &&Alarm| {
            alarm.record.is_unacknowledged()
                && !plans.iter().any(|now| now.has_definition_of(&alarm.plan))
        };
        let lost = self.alarms.iter().filter(is_lost);
        lost.map(|alarm| (alarm.plan.name.as_str(), alarm.record.unacknowledged()))
    }

    /// Notes what a cycle changed, which was due at an instant. Returns the events; they have no number yet.
    pub fn note(&mut self, event: &AlarmEvent, unix_ns: u64) -> Vec<AlarmEntry> {
        let task = self.task.clone();
        let Some(alarm) = self.alarms.get_mut(event.alarm) else { return Vec::new() };
        let at = AlarmMoment {
            cycle: event.cycle,
            unix_ns,
            value: Value::of(event.value, alarm.plan.value_type),
        };
        let mut entries = Vec::new();
        if std::mem::replace(&mut alarm.evaluated, event.ok) != event.ok {
            let change = if event.ok { AlarmChange::Evaluated } else { AlarmChange::NotEvaluated };
            entries.push(alarm.entry(&task, change, at));
        }
        // After a restart an alarm that goes on is told once more.
        if std::mem::replace(&mut alarm.record.active, event.active) != event.active {
            if event.active {
                alarm.come(at);
            }
            alarm.record.last = Some(at);
            let change = if event.active { AlarmChange::Came } else { AlarmChange::Went };
            entries.push(alarm.entry(&task, change, at));
        }
        entries
    }

    /// Acknowledges the occurrences of an alarm up to one, or all of them. `None`: it is no alarm of this task.
    ///
    /// # Errors
    /// There is nothing to acknowledge.
    pub fn acknowledge(
        &mut self,
        name: &str,
        occurrence: Option<u64>,
        (cycle, unix_ns): (u64, u64),
        by: AskedBy,
    ) -> Option<Result<Acknowledgement, Refusal>> {
        let task = self.task.clone();
        let alarm = self.alarms.iter_mut().find(|alarm| alarm.plan.name == name)?;
        let before = alarm.record.acknowledged;
        Some(alarm.acknowledge(occurrence).map(|occurrence| {
            let value = alarm.record.last.map_or(Value::Bool(false), |last| last.value);
            let at = AlarmMoment { cycle, unix_ns, value };
            let entry = alarm.entry(&task, AlarmChange::Acknowledged, at);
            let entry = AlarmEntry { occurrence, by, ..entry };
            Acknowledgement { before, entry, alarm: alarm.shown(&task) }
        }))
    }

    /// Those that stand, that nobody has acknowledged, or that cannot be evaluated, without the `first` ones.
    pub fn standing(&self, first: usize) -> impl Iterator<Item = ProcessAlarm> + '_ {
        let standing = self.alarms.iter().filter(|alarm| alarm.is_standing());
        // Skipped before they are shown, as there may be thousands on the pages before.
        standing.skip(first).map(|alarm| alarm.shown(&self.task))
    }

    /// Adds what they are now to those of other tasks.
    pub fn add_to(&self, totals: &mut AlarmTotals) {
        for alarm in &self.alarms {
            let state = alarm.state();
            totals.unacknowledged += u64::from(state.is_unacknowledged());
            if state.is_active() {
                totals.standing += 1;
                totals.names.push(alarm.plan.name.clone());
            }
        }
    }

    /// How many these are.
    pub fn count_standing(&self) -> usize {
        self.alarms.iter().filter(|alarm| alarm.is_standing()).count()
    }
}

impl Operator {
    /// Whether alarms may be acknowledged.
    ///
    /// # Errors
    /// `control` of the configuration forbids it.
    pub fn check_acknowledgement(&self) -> Result<(), Refusal> {
        self.permissions.check(Intent::Acknowledge)
    }

    /// Journals an acknowledgement, and gives it a number. `before` is the last occurrence that was acknowledged before.
    pub fn acknowledged(&mut self, task: usize, before: u64, entry: &AlarmEntry) -> Entry {
        let transaction = self.next;
        self.next += 1;
        let changed = Changed {
            place: SignalPlace::Gone(Box::new((entry.alarm.clone(), PinType::Int))),
            before: before as f64,
            after: Some(entry.occurrence as f64),
            versions: (0, 0),
        };
        let at = (task, entry.at.cycle);
        let record = Record::new(transaction, at, entry.at.unix_ns, Action::Ack, [changed].into());
        self.add(Record { by: entry.by.clone(), ..record })
    }
}

/// The refusal of a name that no alarm has.
pub fn unknown_alarm<'a>(name: &str, alarms: impl Iterator<Item = &'a AlarmPlan>) -> Refusal {
    let names: Vec<&str> = alarms.map(|alarm| alarm.name.as_str()).collect();
    let help = match nearest_name(name, names.iter().copied()) {
        Some(near) => format!("did you mean \"{near}\"?"),
        None if names.is_empty() => "the configuration has no [[alarm]]".to_owned(),
        None => isochrone_engine::listing(names.iter().copied(), names.len()),
    };
    Refusal::one(Code::UnknownName, name, format!("there is no alarm \"{name}\""), help)
}

impl Alarm {
    fn new(plan: AlarmPlan) -> Self {
        let record = AlarmRecord { name: plan.name.clone(), ..AlarmRecord::default() };
        Self { plan, evaluated: true, record }
    }

    fn come(&mut self, at: AlarmMoment) {
        let Self { plan, record, .. } = self;
        if !record.is_unacknowledged() {
            record.first = Some(at);
        }
        record.came = Some(at);
        record.occurrence += 1;
        if !plan.severity.needs_acknowledgement() {
            record.acknowledged = record.occurrence;
        }
    }

    /// Returns the last occurrence that is now acknowledged.
    fn acknowledge(&mut self, occurrence: Option<u64>) -> Result<u64, Refusal> {
        let Self { plan, record, .. } = self;
        let name = &plan.name;
        let newest = record.occurrence;
        let wanted = occurrence.unwrap_or(newest);
        if !plan.severity.needs_acknowledgement() {
            let message = format!("\"{name}\" is an event: its severity is info");
            let help = "nobody needs to acknowledge it";
            return Err(Refusal::one(Code::NotWritable, name, message, help));
        }
        if wanted > newest || wanted == 0 && occurrence.is_some() {
            let message = format!("\"{name}\" has no occurrence {wanted}");
            let help = match newest {
                0 => "it was never active".to_owned(),
                newest => format!("its newest one is {newest}"),
            };
            return Err(Refusal::one(Code::WrongValue, name, message, help));
        }
        if wanted <= record.acknowledged {
            let message = match newest {
                0 => format!("\"{name}\" was never active"),
                _ => format!("occurrence {wanted} of \"{name}\" is acknowledged already"),
            };
            return Err(Refusal::new(Code::Conflict, message));
        }
        // Of the occurrences before the newest one only the first is known.
        record.first = record.came;
        record.acknowledged = wanted;
        Ok(wanted)
    }

    fn entry(&self, task: &str, change: AlarmChange, at: AlarmMoment) -> AlarmEntry {
        AlarmEntry {
            sequence: 0,
            alarm: self.plan.name.clone(),
            task: task.to_owned(),
            severity: self.plan.severity,
            change,
            occurrence: self.record.occurrence,
            at,
            value_type: self.plan.value_type.to_string(),
            left_out: 0,
            by: AskedBy::default(),
        }
    }

    const fn state(&self) -> AlarmState {
        AlarmState::of(self.record.active, !self.record.is_unacknowledged())
    }

    fn is_standing(&self) -> bool {
        self.state() != AlarmState::Normal || !self.evaluated
    }

    fn shown(&self, task: &str) -> ProcessAlarm {
        let Self { plan, evaluated, record } = self;
        ProcessAlarm {
            name: plan.name.clone(),
            task: task.to_owned(),
            severity: plan.severity,
            text: plan.text.clone(),
            when: plan.when.clone(),
            state: self.state(),
            evaluated: *evaluated,
            signal: plan.signal.clone(),
            value_type: plan.value_type.to_string(),
            occurrence: record.occurrence,
            unacknowledged: record.unacknowledged(),
            first: record.first,
            last: record.last,
        }
    }
}

impl AlarmRecord {
    /// What is left of it when the alarm has another definition: its count, so that nobody acknowledges an occurrence that
    /// they never saw by the number of one that they did.
    pub fn of_another_definition(&self) -> Self {
        let Self { name, occurrence, .. } = self;
        let (occurrence, acknowledged) = (*occurrence, *occurrence);
        Self { name: name.clone(), occurrence, acknowledged, ..Self::default() }
    }

    /// How many occurrences nobody has acknowledged.
    pub const fn unacknowledged(&self) -> u64 {
        self.occurrence.saturating_sub(self.acknowledged)
    }

    const fn is_unacknowledged(&self) -> bool {
        self.occurrence > self.acknowledged
    }
}
