//! The state of the node, serialized once for all pages.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use isochrone_control::{DescribeResult, Force, Role, SignalDescription, TaskDescription, Value};
use isochrone_cyclic::Wake;
use isochrone_timing::units::duration;
use serde::Serialize;
use serde_json::json;

use super::pages::MAX_VALUES;
use super::response;
use crate::base::numbers::{Digits, shown_value, type_of};
use crate::base::session::{Absence, News, Readings, Target};
use crate::base::twins::twins;
use crate::operate::{age_of, ok_of};

/// A text of JSON, and which one it is.
#[derive(Clone, Default)]
pub(super) struct Text {
    pub(super) version: u64,
    pub(super) json: Arc<str>,
}

impl Text {
    pub(super) fn set(&mut self, value: &impl Serialize) {
        let json = response::json(value);
        if *json != *self.json {
            *self = Self { version: self.version + 1, json: json.into() };
        }
    }
}

/// The node.
#[derive(Default)]
pub(super) struct Plant {
    node: Option<DescribeResult>,
    lost: Option<(Absence, String)>,
    /// Why nothing is heard of it, though no request has been in vain yet.
    silent: Option<String>,
    signals: Vec<SignalDescription>,
    places: HashMap<String, usize>,
    readings: Readings,
    forces: Vec<Force>,
    /// Lines of the pages for whose values there is no room.
    left_out: BTreeSet<String>,
    /// The node and its tasks, and whether it answers.
    pub(super) state: Text,
    /// Its signals.
    pub(super) list: Text,
    pub(super) alarms: Text,
    pub(super) process: Text,
    pub(super) forced: Text,
    /// Of values.
    pub(super) readings_version: u64,
}

/// A line of the table.
#[derive(Clone, PartialEq, Serialize)]
pub(super) struct Line {
    /// `None`: it is not known.
    value: Option<String>,
    /// `F`, `f`, `!`, `?`.
    marks: String,
    /// The flags of its value.
    flags: Vec<String>,
    /// Of an input: how old it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    age: Option<String>,
    /// Why it has no value, where that is not because of the node.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<String>,
}

impl Plant {
    /// Nothing is known yet.
    pub(super) fn new() -> Self {
        let mut plant = Self::default();
        plant.list.set(&plant.signals);
        plant
    }

    /// Whether the node has been heard of.
    pub(super) fn is_known(&self) -> bool {
        self.node.is_some() || self.lost.is_some()
    }

    /// Takes news in; whether the node has been started again.
    pub(super) fn take(&mut self, news: News) -> bool {
        let mut has_restarted = false;
        match news {
            News::Joined { node, signals } => {
                self.lost = None;
                self.list.set(&signals);
                self.places = signals
                    .iter()
                    .enumerate()
                    .map(|(place, signal)| (signal.name.clone(), place))
                    .collect();
                self.signals = signals;
                self.readings.forget();
                // Says which list it is.
                has_restarted = self.describe(node);
            }
            News::Described(node) => has_restarted = self.describe(node),
            News::Values(read) => self.readings.take(read),
            News::Alarms(alarms) => {
                self.alarms.set(&alarms);
                self.readings.set_alarmed(alarms.into_iter().map(|alarm| alarm.name));
            }
            News::ProcessAlarms(alarms) => self.process.set(&alarms),
            News::Forces(forces) => {
                self.readings.set_forced(&forces);
                self.forces = forces;
                self.write_forces();
            }
            News::Lost { absence, why } => {
                self.lost = Some((absence, why));
                self.readings.forget();
                if absence == Absence::Ended {
                    self.take(News::Alarms(Vec::new()));
                    self.take(News::ProcessAlarms(Vec::new()));
                    self.take(News::Forces(Vec::new()));
                }
                self.write_state();
            }
            News::Journal(_) | News::Timing(_) | News::Done(_) | News::Refused { .. } => {}
        }
        self.readings_version += 1;
        has_restarted
    }

    fn describe(&mut self, node: DescribeResult) -> bool {
        let known = self.node.replace(node);
        self.write_state();
        self.write_forces();
        let started = |node: &DescribeResult| node.started_unix_ns;
        known.as_ref().map(started) != self.node.as_ref().map(started)
    }

    /// Whether nothing is heard of the node.
    pub(super) fn is_silent(&self) -> bool {
        self.silent.is_some()
    }

    /// Sets or clears the state that the node is silent, in which its last values no longer hold.
    pub(super) fn set_silent(&mut self, why: Option<String>) {
        self.silent = why;
        self.readings.forget();
        self.readings_version += 1;
        self.write_state();
    }

    /// How long an answer may take: a task that never sleeps is read when it has run another cycle, ns.
    pub(super) fn longest_wait_ns(&self) -> u64 {
        let tasks = self.node.iter().flat_map(|node| &node.tasks);
        let never_sleeps = |task: &&TaskDescription| {
            task.placement.as_ref().is_none_or(|placement| placement.wake == Wake::Spin.as_str())
        };
        tasks.filter(never_sleeps).map(|task| task.period_ns).max().unwrap_or_default()
    }

    /// The node is not asked for the values of these lines.
    pub(super) fn set_left_out(&mut self, left_out: BTreeSet<String>) {
        if self.left_out != left_out {
            self.left_out = left_out;
            self.readings_version += 1;
        }
    }

    fn write_state(&mut self) {
        let (state, why) = match (&self.lost, &self.silent) {
            (None, None) => ("runs", None),
            (Some((Absence::Ended, why)), _) => ("ended", Some(why)),
            (Some((Absence::Silent, why)), _) | (None, Some(why)) => ("silent", Some(why)),
        };
        self.state.set(&json!({
            "state": state,
            "why": why,
            "node": self.node,
            "twins": self.node.as_ref().and_then(|node| node.redundancy.as_deref()).map(twins),
            "list": self.list.version,
        }));
    }

    fn write_forces(&mut self) {
        let forces: Vec<_> = self.forces.iter().map(|force| self.force(force)).collect();
        self.forced.set(&forces);
    }

    /// A force as the page shows it.
    fn force(&self, force: &Force) -> serde_json::Value {
        let signal = self.signal(&force.name);
        let value = match signal {
            Some(signal) => Target::new(signal).shown(force.value),
            None => force.value.to_string(),
        };
        let tasks = self.node.iter().flat_map(|node| &node.tasks);
        let task = signal.and_then(|signal| tasks.into_iter().find(|it| it.name == signal.task));
        // By the cycle that is due, in whole seconds: digits that change faster say nothing.
        let left_s = task.zip(force.until_cycle).map(|(task, until)| {
            let cycles = until.saturating_sub(task.cycle);
            (cycles as f64 * task.period_ns as f64 / 1e9).ceil()
        });
        json!({
            "name": force.name,
            "value": value,
            "held": force.until_cycle.is_none(),
            "left_s": left_s,
            "client": force.client,
        })
    }

    /// The signal of a name.
    pub(super) fn signal(&self, name: &str) -> Option<&SignalDescription> {
        self.signals.get(*self.places.get(name)?)
    }

    /// Whether the node answers.
    pub(super) fn is_there(&self) -> bool {
        self.node.is_some() && self.lost.is_none()
    }

    /// The values that a line of the table needs. None of a task that has not run yet: the node would answer
    /// after its first cycle, for all of them.
    pub(super) fn needed(&self, name: &str) -> Vec<String> {
        let Some(signal) = self.signal(name) else { return Vec::new() };
        match signal.role {
            _ if self.has_not_run(&signal.task) => Vec::new(),
            Role::Input => vec![name.to_owned(), ok_of(name), age_of(name)],
            _ => vec![name.to_owned()],
        }
    }

    fn has_not_run(&self, task: &str) -> bool {
        let mut tasks = self.node.iter().flat_map(|node| &node.tasks);
        tasks.any(|it| it.name == task && it.last_cycle.is_none())
    }

    /// Why a signal has no value, as long as the node answers.
    fn why_none(&self, signal: &SignalDescription) -> Option<String> {
        if self.left_out.contains(&signal.name) {
            return Some(format!(
                "not read: the open pages show more than {MAX_VALUES} values; close one"
            ));
        }
        self.has_not_run(&signal.task).then(|| format!("task \"{}\" has not run yet", signal.task))
    }

    /// A line of the table; `None` if there is no such signal.
    pub(super) fn line(&self, name: &str) -> Option<Line> {
        let signal = self.signal(name)?;
        let value = self.readings.value(name);
        let is_heard = self.lost.is_none() && self.silent.is_none();
        let age = match (signal.role, self.readings.value(&age_of(name))) {
            (Role::Input, Some(Value::Number(age))) => Some(age_in_words(age)),
            _ => None,
        };
        Some(Line {
            value: value.map(|value| self.in_words(signal, value)),
            marks: if is_heard { self.marks(signal) } else { String::new() },
            flags: self.readings.flags(name).to_vec(),
            age,
            why: (is_heard && value.is_none()).then(|| self.why_none(signal)).flatten(),
        })
    }

    /// Marks of a signal besides its value, as letters.
    fn marks(&self, signal: &SignalDescription) -> String {
        self.readings.marks(signal).letters().into_iter().filter(|letter| *letter != ' ').collect()
    }

    fn in_words(&self, signal: &SignalDescription, value: Value) -> String {
        match (signal.role, value) {
            (Role::Age, Value::Number(age)) => age_in_words(age),
            _ => shown_value(value, type_of(&signal.value_type), Digits::Six),
        }
    }

    /// A signal of each task that has one.
    pub(super) fn one_signal_by_task(&self) -> BTreeMap<String, String> {
        let newest = self.signals.iter().rev();
        newest.map(|signal| (signal.task.clone(), signal.name.clone())).collect()
    }
}

fn age_in_words(seconds: f64) -> String {
    if seconds.is_finite() { duration(seconds * 1e9) } else { "none came".into() }
}
