//! A request that has been sent to its tasks, until all that are due soon have answered.

use isochrone_engine::operate::{Action, Done, Entry, Reading, Warning};
use isochrone_ipc::Flags;

use crate::control::{
    ByTask, Code, Failure, Finding, ForceResult, GetResult, Outcome, Part, ReadAt, Reply, Room,
    SetResult, Ticket, Values,
};

use super::applied::Applied;

/// A request under way.
pub(super) struct UnderWay {
    pub(super) ticket: Ticket,
    /// That the operator gave it.
    pub(super) number: u64,
    /// Tasks that are still to answer.
    pub(super) missing: usize,
    pub(super) work: Work,
    pub(super) failure: Option<Failure>,
}

pub(super) enum Work {
    Change(Change),
    Apply(Applied),
    Read(Read),
}

/// What a transaction has changed so far.
#[derive(Default)]
pub(super) struct Change {
    pub(super) names: Vec<String>,
    pub(super) tasks: ByTask<Part>,
    pub(super) before: Values,
    pub(super) after: Values,
    pub(super) warnings: Vec<Warning>,
    /// Of a force.
    pub(super) until: Option<ByTask<Option<u64>>>,
}

/// What has been read so far.
pub(super) struct Read {
    pub(super) names: Vec<String>,
    /// When cycle 0 of each task was due, and its period, in ns.
    pub(super) grids: Vec<(u64, u64)>,
    pub(super) total: u64,
    /// The task of each value, in the order of the request.
    pub(super) order: Vec<usize>,
    pub(super) readings: Vec<Reading>,
}

impl UnderWay {
    pub(super) fn is_about(&self, done: &Done) -> bool {
        self.number
            == match done {
                Done::Applied(entry) => entry.transaction,
                Done::TooLate { transaction } => *transaction,
                Done::Read(reading) => reading.number,
            }
    }

    pub(super) fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Takes in what one of its tasks did. One that was too far ahead to be waited for may come early.
    pub(super) fn take(&mut self, done: Done) {
        self.missing = self.missing.saturating_sub(1);
        match (done, &mut self.work) {
            (Done::Applied(entry), Work::Change(change)) => change.take(entry),
            (Done::Applied(entry), Work::Apply(applied)) => applied.take(&entry),
            (Done::Read(reading), Work::Read(read)) => read.readings.push(reading),
            (Done::TooLate { .. }, _) => {
                let message = "the cycle had begun before the request came to it; nothing happened";
                self.failure = Some(Failure::new(Code::TooLate, message));
            }
            _ => {}
        }
    }

    /// Its outcome; where tasks are missing, the node has ended.
    pub(super) fn end(self) -> (Ticket, Outcome) {
        let outcome = match (self.failure, self.missing) {
            (Some(failure), _) => Err(failure),
            (None, 0) => Ok(self.work.reply(self.number)),
            (None, _) => Err(Failure::new(Code::TooLate, "the node ended before it came to this")),
        };
        (self.ticket, outcome)
    }
}

impl Work {
    pub(super) fn reply(self, number: u64) -> Reply {
        match self {
            Self::Change(change) => change.reply(number),
            Self::Apply(applied) => applied.reply(number),
            Self::Read(read) => Reply::Get(read.result()),
        }
    }
}

impl Change {
    fn take(&mut self, entry: Entry) {
        let Entry { task, cycle, action, changes, .. } = entry;
        let Some(name) = self.names.get(task) else { return };
        self.tasks.insert(name.clone(), Part { cycle, pending: false });
        if let (Action::Force { until }, Some(all)) = (action, &mut self.until) {
            all.insert(name.clone(), until);
        }
        for change in changes {
            self.after.0.extend(change.after.map(|after| (change.name.clone(), after.into())));
            self.before.0.push((change.name, change.before.into()));
        }
    }

    fn reply(self, transaction: u64) -> Reply {
        let Self { tasks, before, after, warnings, until, .. } = self;
        let mut room = Room::of_answer();
        let values = before.0.len();
        let fits = |(name, value): &(String, _)| room.takes_entry(name, value);
        let before = Values(before.0.into_iter().take_while(fits).collect());
        let left_out = values - before.0.len();
        let fits = |(name, value): &(String, _)| room.takes_entry(name, value);
        let after = Values(after.0.into_iter().take_while(fits).collect());
        let long = (left_out > 0).then(|| {
            Finding::new("", format!("of {values} values before, {left_out} do not fit in here"))
                .with_help("the journal has them")
        });
        let words = |warning: Warning| Finding::new(warning.name(), warning.to_string());
        let warnings = long.into_iter().chain(warnings.into_iter().map(words));
        let warnings = warnings.take_while(|finding| room.takes(finding)).collect();
        match until {
            Some(until) => {
                Reply::Force(ForceResult { transaction, tasks, before, warnings, until })
            }
            None => Reply::Set(SetResult { transaction, tasks, before, after, warnings }),
        }
    }
}

impl Read {
    fn result(self) -> GetResult {
        let Self { names, grids, total, order, readings } = self;
        let read_at = |reading: &Reading| {
            let name = names.get(reading.task)?.clone();
            let (first_ns, period_ns) = grids.get(reading.task)?;
            let release_ns = first_ns.saturating_add(reading.cycle.saturating_mul(*period_ns));
            Some((name, ReadAt { cycle: reading.cycle, release_ns }))
        };
        let tasks = readings.iter().filter_map(read_at).collect();
        let is_known = readings.iter().all(|reading| reading.quality.is_some());
        let mut of_tasks: Vec<_> =
            names.iter().map(|_| Vec::new().into_iter().zip(Vec::new())).collect();
        for reading in readings {
            if let Some(values) = of_tasks.get_mut(reading.task) {
                let none = vec![Flags::NONE; reading.values.len()];
                *values = reading.values.into_iter().zip(reading.quality.unwrap_or(none));
            }
        }
        let mut room = Room::of_answer();
        let (mut values, mut quality) = (Vec::new(), ByTask::new());
        for task in order {
            let next = of_tasks.get_mut(task).and_then(Iterator::next);
            let Some(((name, value), flags)) = next else { continue };
            let value = value.into();
            let words: Vec<String> = flags.words().collect();
            let fits = room.takes_entry(&name, &value)
                && (words.is_empty() || room.takes_entry(&name, &words));
            if !fits {
                break;
            }
            if !words.is_empty() {
                quality.insert(name.clone(), words);
            }
            values.push((name, value));
        }
        GetResult { total, tasks, values: Values(values), quality: is_known.then_some(quality) }
    }
}
