//! A request that was sent to its tasks, until all parts that are due soon have come back.

use isochrone_blocks::PinType;
use isochrone_control::desk::{OrderOutcome, Reading, Unwritten, ValueWarning};
use isochrone_ipc::Flags;

use isochrone_control::{
    Action, ByTask, CallResult, Code, Entry, Finding, ForceResult, GetResult, Part, ReadAt,
    Refusal, Reply, Room, SetResult, Ticket, Types, Values,
};

use super::applied::Applied;
use crate::node::operating::RequestOutcome;

/// A request under way.
pub(super) struct UnderWay {
    pub(super) ticket: Ticket,
    /// The number that the operator gave it.
    pub(super) number: u64,
    /// How many tasks have not answered yet.
    pub(super) missing: usize,
    pub(super) work: Work,
    /// Warnings in addition to those that the operator gave beforehand.
    pub(super) notes: Vec<Finding>,
    pub(super) failure: Option<Refusal>,
}

pub(super) enum Work {
    Change(Change),
    Apply(Applied),
    Read(Read),
}

/// The changes of a transaction so far.
#[derive(Default)]
pub(super) struct Change {
    pub(super) tasks: ByTask<Part>,
    pub(super) before: Values,
    pub(super) after: Values,
    pub(super) types: Types,
    pub(super) warnings: Vec<ValueWarning>,
    /// Of a force.
    pub(super) until: Option<ByTask<Option<u64>>>,
}

/// The values that were read so far.
pub(super) struct Read {
    pub(super) names: Vec<String>,
    /// When cycle 0 of each task was due, or would have been, and its period, in ns; modulo 2^64.
    pub(super) grids: Vec<(u64, u64)>,
    pub(super) total: u64,
    /// The task of each value, in the order of the request.
    pub(super) order: Vec<usize>,
    /// The type of each value, if types are wanted.
    pub(super) types: Option<Vec<PinType>>,
    pub(super) readings: Vec<Reading>,
}

impl UnderWay {
    pub(super) fn new(ticket: Ticket, number: u64, missing: usize, work: Work) -> Self {
        Self { ticket, number, missing, work, notes: Vec::new(), failure: None }
    }

    pub(super) fn is_about(&self, done: &OrderOutcome) -> bool {
        self.number
            == match done {
                // A force may end in one task before another task has begun it.
                OrderOutcome::Applied(Entry { action: Action::Expiry, .. }) => return false,
                OrderOutcome::Applied(entry) => entry.transaction,
                OrderOutcome::TooLate { transaction } | OrderOutcome::Released { transaction } => {
                    *transaction
                }
                OrderOutcome::Read(reading) => reading.number,
            }
    }

    pub(super) fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Takes in the outcome of one of its tasks. A part that was due too late to be waited for may come back early.
    pub(super) fn take(&mut self, outcome: RequestOutcome) {
        self.missing = self.missing.saturating_sub(1);
        if let (OrderOutcome::Applied(entry), Some(why)) = (&outcome.done, &outcome.unwritten) {
            self.notes.push(unwritten(entry, why));
        }
        match (outcome.done, &mut self.work) {
            (OrderOutcome::Applied(entry), Work::Change(change)) => change.take(entry),
            (OrderOutcome::Applied(entry), Work::Apply(applied)) => applied.take(&entry),
            (OrderOutcome::Read(reading), Work::Read(_)) if reading.lost > 0 => {
                self.failure = Some(changed_meanwhile());
            }
            (OrderOutcome::Read(reading), Work::Read(read)) => read.readings.push(reading),
            (OrderOutcome::TooLate { .. }, _) => {
                let message = "the cycle had begun before the request came to it; nothing happened";
                self.failure = Some(Refusal::new(Code::TooLate, message));
            }
            (OrderOutcome::Released { .. }, _) => {
                let message = "this was released before its cycle; nothing happened";
                self.failure = Some(Refusal::new(Code::Conflict, message));
            }
            _ => {}
        }
    }

    /// Its result; if tasks are missing, the node has ended.
    pub(super) fn end(self) -> (Ticket, CallResult) {
        let Self { ticket, number, missing, work, mut notes, failure } = self;
        let outcome = match failure {
            Some(failure) => Err(failure),
            None if missing == 0 => Ok(work.reply(number, notes)),
            None if work.is_partly_done() => {
                let message =
                    "the node ended before all tasks had come to this; `tasks` has those that had";
                notes.push(Finding::new("", message));
                Ok(work.reply(number, notes))
            }
            None => Err(Refusal::new(Code::TooLate, "the node ended before it came to this")),
        };
        (ticket, outcome)
    }
}

/// The refusal if a signal was gone by the time that it was read.
fn changed_meanwhile() -> Refusal {
    let message = "the configuration is being changed, and not all signals that were asked for are there; ask again";
    Refusal::new(Code::Busy, message)
}

/// A warning that an entry is not in the journal's file.
fn unwritten(entry: &Entry, why: &Unwritten) -> Finding {
    let (Entry { cycle, task, .. }, reason) = (entry, why.reason());
    let (yet, help) = match why {
        Unwritten::ForNow(_) => (" yet", "it is written as soon as that is possible"),
        Unwritten::ForGood(_) => ("", "nothing more is written until the node is started again"),
    };
    let message = format!(
        "this was made at cycle {cycle} of task \"{task}\" and is not in the journal{yet}: {reason}"
    );
    Finding::new("journal", message).with_help(help)
}

impl Work {
    pub(super) fn reply(self, number: u64, notes: Vec<Finding>) -> Reply {
        match self {
            Self::Change(change) => change.reply(number, notes),
            Self::Apply(applied) => applied.reply(number, notes),
            Self::Read(read) => Reply::Get(read.result()),
        }
    }

    /// Whether a task has carried it out.
    fn is_partly_done(&self) -> bool {
        match self {
            Self::Change(Change { tasks, .. }) | Self::Apply(Applied { tasks, .. }) => {
                tasks.values().any(|part| !part.pending)
            }
            Self::Read(_) => false,
        }
    }
}

impl Change {
    fn take(&mut self, entry: Entry) {
        let Entry { task, cycle, until_cycle, changes, .. } = entry;
        self.tasks.insert(task.clone(), Part { cycle, pending: false });
        if let Some(until) = &mut self.until {
            until.insert(task, until_cycle);
        }
        for change in changes {
            self.types.extend(change.value_type.map(|it| (change.name.clone(), it)));
            self.after.0.extend(change.after.map(|after| (change.name.clone(), after)));
            self.before.0.push((change.name, change.before));
        }
    }

    fn reply(self, transaction: u64, notes: Vec<Finding>) -> Reply {
        let Self { tasks, before, after, types, warnings, until } = self;
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
        let notes = notes.into_iter().chain(long);
        let warnings = ValueWarning::sentences(&warnings).into_iter();
        let warnings = notes.chain(warnings.map(|(name, sentence)| Finding::new(name, sentence)));
        let warnings = warnings.take_while(|finding| room.takes(finding)).collect();
        let fits = |(name, it): &(String, String)| room.takes_entry(name, it);
        let types = types.into_iter().take_while(fits).collect();
        match until {
            Some(until) => {
                let result =
                    ForceResult { transaction, tasks, before, after, types, warnings, until };
                Reply::Force(result)
            }
            None => Reply::Set(SetResult { transaction, tasks, before, after, types, warnings }),
        }
    }
}

impl Read {
    fn result(self) -> GetResult {
        let Self { names, grids, total, order, types, readings } = self;
        let read_at = |reading: &Reading| {
            let name = names.get(reading.task)?.clone();
            let (first_ns, period_ns) = grids.get(reading.task)?;
            let release_ns = first_ns.wrapping_add(reading.cycle.wrapping_mul(*period_ns));
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
        let (is_typed, mut types) = (types.is_some(), types.into_iter().flatten());
        let mut named = Types::new();
        for task in order {
            let value_type = types.next().map(|value_type| value_type.to_string());
            let next = of_tasks.get_mut(task).and_then(Iterator::next);
            let Some(((name, value), flags)) = next else { continue };
            let words: Vec<String> = flags.words().collect();
            let fits = room.takes_entry(&name, &value)
                && (words.is_empty() || room.takes_entry(&name, &words))
                && value_type.as_ref().is_none_or(|it| room.takes_entry(&name, it));
            if !fits {
                break;
            }
            if !words.is_empty() {
                quality.insert(name.clone(), words);
            }
            named.extend(value_type.map(|it| (name.clone(), it)));
            values.push((name, value));
        }
        let (quality, types) = (is_known.then_some(quality), is_typed.then_some(named));
        GetResult { total, tasks, values: Values(values), quality, types }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_model::AskedBy;

    use super::*;

    fn entry(task: &str, action: Action) -> Entry {
        Entry {
            sequence: 1,
            transaction: 7,
            action,
            task: task.to_owned(),
            cycle: 12,
            unix_ns: 0,
            until_cycle: None,
            undone: None,
            changes: Vec::new(),
            left_out: 0,
            by: AskedBy::default(),
            configuration: None,
            applied: None,
        }
    }

    /// A change of two tasks, of which the first has come to it, unless `done` is empty.
    fn ended(done: &[usize]) -> CallResult {
        let mut request = UnderWay::new(Ticket(1), 7, 2, Work::Change(Change::default()));
        for &task in done {
            let entry = entry(["fast", "slow"][task], Action::Set);
            let reason = Unwritten::ForNow("the journal j cannot be written (disk full)".into());
            request.take(RequestOutcome {
                done: OrderOutcome::Applied(entry),
                unwritten: Some(reason),
            });
        }
        request.end().1
    }

    #[test]
    fn values_of_which_a_change_of_the_configuration_took_some_are_not_answered() {
        let names = vec!["fast".to_owned(), "slow".to_owned()];
        let (grids, order) = (vec![(0, 1); 2], vec![0, 1, 1]);
        let read = Read { names, grids, total: 3, order, types: None, readings: Vec::new() };
        let mut request = UnderWay::new(Ticket(1), 7, 2, Work::Read(read));
        let reading = |task, lost| {
            let values = vec![("a.out".to_owned(), 1.0.into())];
            let done = OrderOutcome::Read(Reading {
                number: 7,
                task,
                cycle: 3,
                values,
                lost,
                quality: None,
            });
            RequestOutcome { done, unwritten: None }
        };
        request.take(reading(1, 1));
        request.take(reading(0, 0));
        assert!(request.is_complete());
        let Err(failure) = request.end().1 else { panic!() };
        assert_eq!(failure.code, Code::Busy);
    }

    #[test]
    fn a_force_that_ends_in_a_task_before_another_has_come_to_it_does_not_answer_its_request() {
        let request = UnderWay::new(Ticket(1), 7, 2, Work::Change(Change::default()));
        assert!(request.is_about(&OrderOutcome::Applied(entry("fast", Action::Force))));
        assert!(!request.is_about(&OrderOutcome::Applied(entry("fast", Action::Expiry))));
    }

    #[test]
    fn what_was_done_when_the_node_ended_is_answered_as_done_and_nothing_else_is() {
        let Err(failure) = ended(&[]) else { panic!() };
        assert_eq!(failure.code, Code::TooLate);
        let Ok(Reply::Set(partly)) = ended(&[0]) else { panic!() };
        assert_eq!(partly.tasks.keys().collect::<Vec<_>>(), ["fast"]);
        let told: Vec<_> = partly.warnings.iter().map(|warning| &warning.message).collect();
        assert_eq!(
            told,
            [
                "this was made at cycle 12 of task \"fast\" and is not in the journal yet: the journal j \
                 cannot be written (disk full)",
                "the node ended before all tasks had come to this; `tasks` has those that had",
            ]
        );
        let Ok(Reply::Set(whole)) = ended(&[0, 1]) else { panic!() };
        assert_eq!((whole.tasks.len(), whole.warnings.len()), (2, 2));
    }
}
