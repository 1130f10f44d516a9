//! The process alarms of a node: what its cycles tell, what people acknowledge, and the events of both.

use std::collections::{HashMap, VecDeque};

use isochrone_control::desk::{TaskAlarms, unknown_alarm};
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{AlarmPlan, Plan};
use isochrone_model::{AlarmChange, AlarmEntry, AskedBy, ProcessAlarm, Refusal, Severity};

use crate::node::operating::Operating;
use crate::node::running::Running;
use crate::task::alarms::{AlarmReceiver, Told};
use crate::task::clocks::unix_ns;
use crate::task::limiter::{Allowed, Limiter};

/// How many events are kept. They have room of their own, so that no entry of an operator is lost for one.
const KEPT: usize = 4096;

/// The process alarms of all tasks, and their events.
pub(crate) struct ProcessAlarms {
    tasks: Vec<Lane>,
    events: VecDeque<AlarmEntry>,
    newest: u64,
    /// The newest of them, for the journal.
    told: Vec<AlarmEntry>,
    /// Of the alarms whose events come faster than one a second.
    limiters: HashMap<String, Limiter<AlarmEntry>>,
}

struct Lane {
    alarms: TaskAlarms,
    /// The alarms of configurations that are on their way to the task.
    next: VecDeque<Vec<AlarmPlan>>,
    lost: u64,
}

impl ProcessAlarms {
    pub(crate) fn of(plan: &Plan) -> Self {
        let lane = |task: &isochrone_engine::TaskPlan| Lane {
            alarms: TaskAlarms::new(&task.name, &task.alarms),
            next: VecDeque::new(),
            lost: 0,
        };
        Self {
            tasks: plan.tasks.iter().map(lane).collect(),
            events: VecDeque::new(),
            newest: 0,
            told: Vec::new(),
            limiters: HashMap::new(),
        }
    }

    /// The definitions of a task's alarms.
    pub(crate) fn plans(&self, task: usize) -> Vec<AlarmPlan> {
        self.tasks.get(task).map_or_else(Vec::new, |lane| lane.alarms.plans().cloned().collect())
    }

    /// Adds the alarms of a configuration that is on its way to a task.
    pub(crate) fn expect(&mut self, task: usize, plans: Vec<AlarmPlan>) {
        if let Some(lane) = self.tasks.get_mut(task) {
            lane.next.push_back(plans);
        }
    }

    /// Those that stand, that nobody has acknowledged, or that cannot be evaluated.
    pub(crate) fn standing(&self) -> impl Iterator<Item = ProcessAlarm> + '_ {
        self.tasks.iter().flat_map(|lane| lane.alarms.standing())
    }

    /// How many these are.
    pub(crate) fn count_standing(&self) -> usize {
        self.tasks.iter().map(|lane| lane.alarms.count_standing()).sum()
    }

    /// The events that are kept, from a number on.
    pub(crate) fn events_since(&self, sequence: u64) -> impl Iterator<Item = &AlarmEntry> {
        self.events.iter().skip_while(move |event| event.sequence < sequence)
    }

    /// The number of the newest event; 0: there was none.
    pub(crate) const fn newest_event(&self) -> u64 {
        self.newest
    }

    /// How many changes cycles found no room to tell of.
    pub(crate) fn lost(&self) -> u64 {
        self.tasks.iter().map(|lane| lane.lost).sum()
    }

    /// The events since the last call.
    pub(crate) fn told(&mut self) -> Vec<AlarmEntry> {
        std::mem::take(&mut self.told)
    }

    /// Passes an event on, or holds it if its alarm had one less than a second ago.
    fn tell(&mut self, entry: AlarmEntry) {
        let limiter =
            self.limiters.entry(entry.alarm.clone()).or_insert_with(Limiter::one_a_second);
        if let Some(allowed) = limiter.pass(entry) {
            self.keep(allowed);
        }
    }

    /// Passes on what a person did, after what is held of the alarm.
    fn tell_at_once(&mut self, entry: AlarmEntry) {
        let held = self.limiters.get_mut(&entry.alarm).and_then(Limiter::take_held);
        held.into_iter().for_each(|held| self.keep(held));
        self.keep(Allowed { message: entry, left_out: 0 });
    }

    /// Passes on everything that is held: the node ends.
    pub(crate) fn finish(&mut self) {
        let held: Vec<_> = self.limiters.values_mut().filter_map(Limiter::take_held).collect();
        held.into_iter().for_each(|allowed| self.keep(allowed));
    }

    /// Passes on what was held long enough.
    fn tell_held(&mut self) {
        let held: Vec<_> = self.limiters.values_mut().filter_map(Limiter::held).collect();
        held.into_iter().for_each(|allowed| self.keep(allowed));
    }

    fn keep(&mut self, Allowed { message, left_out }: Allowed<AlarmEntry>) {
        self.newest += 1;
        let entry = AlarmEntry { sequence: self.newest, left_out, ..message };
        log(&entry);
        if self.events.len() == KEPT {
            self.events.pop_front();
        }
        self.told.push(entry.clone());
        self.events.push_back(entry);
    }
}

impl Running {
    /// The process alarms that stand, that nobody has acknowledged, or that cannot be evaluated. The method `alarms`
    /// answers with these rows; the program has them with `control = "off"` too.
    ///
    /// They are some milliseconds old.
    pub fn process_alarms(&self) -> Vec<ProcessAlarm> {
        self.shared.lock().process_alarms.standing().collect()
    }

    /// Acknowledges the occurrences of a process alarm up to one, or all of them.
    ///
    /// # Errors
    /// There is no such alarm, or nothing to acknowledge.
    pub fn acknowledge(
        &self,
        alarm: &str,
        occurrence: Option<u64>,
    ) -> Result<ProcessAlarm, Refusal> {
        self.shared.lock().acknowledge(alarm, occurrence, AskedBy::default())
    }
}

impl Operating {
    /// Takes in what the cycles of a task told.
    pub(crate) fn take_alarms(&mut self, task: usize, receiver: &mut AlarmReceiver) {
        while let Some(told) = receiver.next() {
            match told {
                Told::Changed => {
                    if let Some(lane) = self.process_alarms.tasks.get_mut(task)
                        && let Some(plans) = lane.next.pop_front()
                    {
                        lane.alarms.change(&plans);
                    }
                }
                Told::Event(event) => {
                    let due_unix_ns = self.unix_ns_of(task, event.cycle);
                    let Some(lane) = self.process_alarms.tasks.get_mut(task) else { continue };
                    for entry in lane.alarms.note(&event, due_unix_ns) {
                        self.process_alarms.tell(entry);
                    }
                }
            }
        }
        if let Some(lane) = self.process_alarms.tasks.get_mut(task) {
            lane.lost = receiver.lost();
        }
        self.process_alarms.tell_held();
    }

    /// Acknowledges the occurrences of a process alarm up to one, or all of them.
    pub(crate) fn acknowledge(
        &mut self,
        name: &str,
        occurrence: Option<u64>,
        by: AskedBy,
    ) -> Result<ProcessAlarm, Refusal> {
        let lasts: Vec<u64> =
            self.lanes.iter().map(|lane| lane.last.map_or(0, |last| last.cycle)).collect();
        let lanes = self.process_alarms.tasks.iter_mut().zip(lasts);
        let mut done = lanes.filter_map(|(lane, cycle)| {
            lane.alarms.acknowledge(name, occurrence, (cycle, unix_ns()), by.clone())
        });
        let Some(acknowledged) = done.next() else {
            drop(done);
            let plans = self.process_alarms.tasks.iter().flat_map(|lane| lane.alarms.plans());
            return Err(unknown_alarm(name, plans));
        };
        drop(done);
        let (entry, alarm) = acknowledged?;
        self.process_alarms.tell_at_once(entry);
        Ok(alarm)
    }

    /// When a cycle of a task was due, in ns of UTC since 1970.
    fn unix_ns_of(&self, task: usize, cycle: u64) -> u64 {
        let ago_ns = Monotonic.now_ns().saturating_sub(self.release_ns(task, cycle));
        unix_ns().saturating_sub(ago_ns)
    }
}

/// The log line of an event.
fn log(entry: &AlarmEntry) {
    let AlarmEntry { alarm, task, at, left_out, .. } = entry;
    let change = entry.change.words();
    let others = match left_out {
        0 => String::new(),
        count => format!(" ({count} changes before that are left out)"),
    };
    let sentence =
        format!("alarm \"{alarm}\" {change} in cycle {} of task \"{task}\"{others}", at.cycle);
    let is_urgent = matches!(entry.change, AlarmChange::Came | AlarmChange::NotEvaluated);
    match entry.severity {
        Severity::Warning | Severity::Critical if is_urgent => tracing::warn!("{sentence}"),
        _ => tracing::info!("{sentence}"),
    }
}
