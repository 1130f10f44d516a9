//! The process alarms of a node: what its cycles tell, what people acknowledge, and the events of both.

use std::collections::{HashMap, VecDeque};

use isochrone_control::desk::{Acknowledgement, AlarmRecord, TaskAlarms, unknown_alarm};
use isochrone_engine::{AlarmPlan, Plan};
use isochrone_model::{
    AlarmChange, AlarmEntry, AlarmSeverity, AlarmTotals, AskedBy, ProcessAlarm, Refusal,
};
use isochrone_timing::units::counted;

use crate::task::alarms::{AlarmReceiver, Told};
use crate::task::clocks::unix_ns;
use crate::task::limiter::{Allowed, Limiter};

/// How many events are kept. They have room of their own, so that no entry of an operator is lost for one.
const KEPT: usize = 4096;

/// The process alarms of all tasks, and their events.
#[derive(Default)]
pub(crate) struct ProcessAlarms {
    tasks: Vec<Lane>,
    events: VecDeque<AlarmEntry>,
    newest: u64,
    /// How often one came.
    came: u64,
    /// The number of the newest occurrence of alarms, also of those that a configuration has taken away.
    counts: HashMap<String, u64>,
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
            came: 0,
            counts: HashMap::new(),
            limiters: HashMap::new(),
        }
    }

    /// The definitions of the alarms that a task has once every configuration on its way has reached it.
    pub(crate) fn plans(&self, task: usize) -> Vec<AlarmPlan> {
        let Some(lane) = self.tasks.get(task) else { return Vec::new() };
        let now = || lane.alarms.plans().cloned().collect();
        lane.next.back().cloned().unwrap_or_else(now)
    }

    /// Adds the alarms of a configuration that is on its way to a task.
    pub(crate) fn expect(&mut self, task: usize, plans: Vec<AlarmPlan>) {
        if let Some(lane) = self.tasks.get_mut(task) {
            lane.next.push_back(plans);
        }
    }

    /// What is known of those that were ever active.
    pub(crate) fn records(&self) -> Vec<AlarmRecord> {
        self.tasks.iter().flat_map(|lane| lane.alarms.records().cloned()).collect()
    }

    /// Takes over what an earlier run knew of alarms of the same definition, by their names.
    pub(crate) fn restore(&mut self, records: &HashMap<&str, &AlarmRecord>) {
        self.tasks.iter_mut().for_each(|lane| lane.alarms.restore(records));
    }

    /// Those that stand, that nobody has acknowledged, or that cannot be evaluated, without the `first` ones.
    pub(crate) fn standing(&self, mut first: usize) -> impl Iterator<Item = ProcessAlarm> + '_ {
        self.tasks.iter().flat_map(move |lane| {
            let skipped = first.min(lane.alarms.count_standing());
            first -= skipped;
            lane.alarms.standing(skipped)
        })
    }

    /// How many these are.
    pub(crate) fn count_standing(&self) -> usize {
        self.tasks.iter().map(|lane| lane.alarms.count_standing()).sum()
    }

    /// What they did in this run, and what they are; `None`: there are none.
    pub(crate) fn totals(&self) -> Option<AlarmTotals> {
        let mut totals = AlarmTotals::default();
        (totals.came, totals.lost) = (self.came, self.lost());
        self.tasks.iter().for_each(|lane| lane.alarms.add_to(&mut totals));
        let are_there = self.tasks.iter().any(|lane| lane.alarms.plans().next().is_some());
        (are_there || self.came > 0).then_some(totals)
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

    /// Notes how often each alarm came, while a configuration is on its way that may have none of that name in a task.
    fn count(&mut self) {
        let Self { tasks, counts, .. } = self;
        if tasks.iter().any(|lane| !lane.next.is_empty()) {
            for record in tasks.iter().flat_map(|lane| lane.alarms.records()) {
                let count = counts.entry(record.name.clone()).or_default();
                *count = record.occurrence.max(*count);
            }
        }
    }

    /// What a configuration with these alarms of each task loses: occurrences that nobody has acknowledged.
    pub(crate) fn lost_with<'a>(
        &'a self,
        plans: impl Iterator<Item = &'a [AlarmPlan]> + 'a,
    ) -> Vec<String> {
        let lost = self.tasks.iter().zip(plans).flat_map(|(lane, plans)| lane.alarms.lost(plans));
        lost.map(|(name, count)| {
            format!("{name} ({})", counted(count, "unacknowledged occurrence"))
        })
        .collect()
    }

    /// Takes in what the cycles of a task told. `due` is when a cycle was due, in ns of UTC since 1970.
    pub(crate) fn take(
        &mut self,
        task: usize,
        receiver: &mut AlarmReceiver,
        due: impl Fn(u64) -> u64,
    ) {
        self.count();
        let Self { tasks, counts, .. } = self;
        let Some(lane) = tasks.get_mut(task) else { return };
        let mut entries = Vec::new();
        while let Some(told) = receiver.next() {
            match told {
                Told::Changed => {
                    if let Some(plans) = lane.next.pop_front() {
                        lane.alarms.change(&plans, counts);
                    }
                }
                Told::Event(event) => entries.extend(lane.alarms.note(&event, due(event.cycle))),
            }
        }
        lane.lost = receiver.lost();
        for entry in entries {
            self.came += u64::from(entry.change == AlarmChange::Came);
            self.tell(entry);
        }
        self.tell_held();
    }

    /// Acknowledges the occurrences of an alarm up to one, or all of them; returns its task with it. `lasts` are the last
    /// cycles of the tasks.
    pub(crate) fn acknowledge(
        &mut self,
        name: &str,
        occurrence: Option<u64>,
        lasts: &[u64],
        by: AskedBy,
    ) -> Result<(usize, Acknowledgement), Refusal> {
        let mut tasks = self.tasks.iter_mut().zip(lasts).enumerate();
        let done = tasks.find_map(|(task, (lane, cycle))| {
            let at = (*cycle, unix_ns());
            Some((task, lane.alarms.acknowledge(name, occurrence, at, by.clone())?))
        });
        let Some((task, acknowledged)) = done else {
            return Err(unknown_alarm(
                name,
                self.tasks.iter().flat_map(|lane| lane.alarms.plans()),
            ));
        };
        let acknowledged = acknowledged?;
        self.tell_at_once(acknowledged.entry.clone());
        Ok((task, acknowledged))
    }

    /// Passes an event on, or holds it if its alarm had one less than a second ago. That an alarm came is not left out for
    /// whether it can be evaluated.
    fn tell(&mut self, entry: AlarmEntry) {
        let limiter =
            self.limiters.entry(entry.alarm.clone()).or_insert_with(Limiter::one_a_second);
        let is_held = |held: &AlarmEntry| held.change == AlarmChange::Came;
        if entry.change.is_evaluation() && limiter.holding().is_some_and(is_held) {
            limiter.leave_out();
        } else if let Some(allowed) = limiter.pass(entry) {
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
        self.events.push_back(entry);
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
    let is_urgent = entry.change == AlarmChange::Came;
    match entry.severity {
        AlarmSeverity::Warning | AlarmSeverity::Critical if is_urgent => {
            tracing::warn!("{sentence}")
        }
        _ => tracing::info!("{sentence}"),
    }
}
