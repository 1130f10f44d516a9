//! All tasks of a run again: each cycle with what it read then, as soon as that is there.

mod finish;
mod meaning;
mod ready;

use std::collections::{BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

use isochrone_engine::{Flags, InputReading, Plan, TaskEngine};
use isochrone_processes::Stop;
use isochrone_recording::{Item, MAX_RECORD_BYTES, RecordedRow, RowHead, TaskLayout};
use isochrone_runtime::{Panic, TaskPanicked, catch_panic};
use isochrone_timing::units::counted;

use self::ready::{Ready, ready};
use super::comparison::{Comparison, Tolerance, When};
use super::missing::Missing;
use super::output::Output;
use super::recorded::{Lost, Recorded};
use super::task::{Row, Task};
use crate::base::failure::Failure;
use crate::base::mcap_file::{open, unreadable};
use crate::base::numbers;
use crate::base::rows::Rows;
use crate::replay::operations::{Operations, Tally};

/// Most bytes of rows that wait for values of other tasks.
const MOST_WAITING_BYTES: usize = MAX_RECORD_BYTES;

/// A run that is repeated.
pub(super) struct Rerun<'a> {
    recorded: &'a Recorded,
    /// Another configuration than the recorded one.
    is_other: bool,
    tasks: Vec<Task>,
    operations: Operations,
    comparison: Comparison,
    layouts: HashMap<u16, Arc<TaskLayout>>,
    /// Configurations that were applied, by transaction.
    applied: HashMap<u64, Arc<Plan>>,
    waiting_bytes: usize,
    /// Parts of the recording that the configuration lacks.
    missing: Missing,
    /// Whether that is allowed.
    may_miss: bool,
    /// What else is not as it was in the run.
    unlike: BTreeSet<String>,
    rejects: Tally,
    unfit: Tally,
    changes_left_out: u64,
    output: Option<Output>,
}

impl<'a> Rerun<'a> {
    pub(super) fn new(
        plan: Plan,
        recorded: &'a Recorded,
        is_other: bool,
        may_miss: bool,
        tolerance: Tolerance,
    ) -> Result<Self, Failure> {
        let (operations, unfit, changes_left_out) = if is_other {
            recorded.operations_for_other(&plan)
        } else {
            let operations = recorded.operations(&plan).map_err(Failure::usage)?;
            (operations, Tally::default(), 0)
        };
        let mut engines = TaskEngine::build(&plan).map_err(Failure::found)?;
        let state = recorded.state_before.as_ref();
        let warm = state.and_then(|state| state.warm_start(&plan, &mut engines, |_| Ok(())).ok());
        if let Some(state) = state {
            state.publish_set(&plan, &mut engines);
        }
        let first = warm.map_or_else(|| vec![0; engines.len()], |warm| warm.first_cycles());
        let plan = Arc::new(plan);
        let tasks = engines.into_iter().zip(first).enumerate();
        let tasks =
            tasks.map(|(task, (engine, first))| Task::new(plan.clone(), task, engine, first));
        Ok(Self {
            recorded,
            is_other,
            tasks: tasks.collect(),
            operations,
            comparison: Comparison::new(tolerance),
            layouts: HashMap::new(),
            applied: HashMap::new(),
            waiting_bytes: 0,
            missing: Missing::default(),
            may_miss,
            unlike: BTreeSet::new(),
            rejects: Tally::default(),
            unfit,
            changes_left_out,
            output: None,
        })
    }

    /// Repeats all cycles of a file.
    pub(super) fn run(
        &mut self,
        path: &Path,
        rows: Option<Rows>,
        stop: &Stop,
    ) -> Result<(), Failure> {
        self.output = rows.map(Output::new);
        let mut reader = open(path)?;
        while !stop.is_due() {
            match reader.next_item().map_err(|error| unreadable(path, &error))? {
                Some(Item::Row(row)) => {
                    self.take(&row);
                    self.advance(false)?;
                }
                Some(_) => {}
                None => break,
            }
        }
        let why = if stop.is_due() {
            "the replay was stopped".to_owned()
        } else {
            self.advance(true)?;
            "it reads values of other tasks that are not in the recording".to_owned()
        };
        for task in &mut self.tasks {
            if let Some(row) = task.rows.front() {
                task.break_off(row.head.cycle, why.clone());
            } else if let Some(Lost { count }) = self.recorded.lost_at_end(&task.name) {
                let why = format!("{} lost, as the recorder could not keep up", were(count));
                task.break_off(task.next_cycle(), why);
            } else if stop.is_due() {
                task.break_off(task.next_cycle(), why.clone());
            }
        }
        self.output.as_mut().map_or(Ok(()), |output| output.flush())
    }

    /// Puts a row in its line.
    fn take(&mut self, row: &RecordedRow<'_>) {
        let name = &row.layout.task;
        let Some(task) = self.tasks.iter_mut().find(|task| task.name == *name) else {
            self.missing.row(row);
            return;
        };
        if task.broken.is_some() {
            task.left += 1;
            return;
        }
        let layout =
            self.layouts.entry(row.channel).or_insert_with(|| Arc::new(row.layout.clone()));
        let (layout, channel, head) = (layout.clone(), row.channel, row.head);
        let row = Row { layout, channel, head, values: row.values.to_vec() };
        self.waiting_bytes += row.bytes();
        task.rows.push_back(row);
        if self.waiting_bytes > MOST_WAITING_BYTES {
            // The one that waits longest.
            let stuck = self.tasks.iter_mut().max_by_key(|task| task.rows.len());
            let cycle = stuck.as_ref().and_then(|task| Some(task.rows.front()?.head.cycle));
            if let (Some(task), Some(cycle)) = (stuck, cycle) {
                let most = MOST_WAITING_BYTES >> 20;
                let why = format!(
                    "it reads values of another task that do not come within {most} MiB of rows"
                );
                task.break_off(cycle, why);
            }
            let rows = self.tasks.iter().flat_map(|task| &task.rows);
            self.waiting_bytes = rows.map(Row::bytes).sum();
        }
    }

    /// Repeats every cycle that can be.
    fn advance(&mut self, is_end: bool) -> Result<(), Failure> {
        loop {
            let mut has_moved = false;
            for task in 0..self.tasks.len() {
                while self.step(task, is_end)? {
                    has_moved = true;
                }
            }
            if !has_moved {
                return Ok(());
            }
        }
    }

    /// Repeats the next cycle of a task, if that can be; whether it is done with.
    fn step(&mut self, index: usize, is_end: bool) -> Result<bool, Failure> {
        let Some(task) = self.tasks.get(index) else { return Ok(false) };
        let Some(row) = task.rows.front() else { return Ok(false) };
        let (cycle, channel) = (row.head.cycle, row.channel);
        if let Some(why) = gap(task.next_cycle(), task.last, row.head) {
            let next_cycle = task.next_cycle();
            return Ok(self.break_off(index, next_cycle, why));
        }
        let change = self.operations.change(index, cycle).filter(|_| !self.is_other);
        let changed =
            change.and_then(|(transaction, text)| self.plan_of(transaction, &text, index));
        let Some(places) = self.places(index, changed.as_ref()) else { return Ok(false) };
        let (tasks, operations) = (&mut self.tasks, &mut self.operations);
        let hands = match ready(tasks, operations, self.is_other, (index, &places), is_end) {
            Ready::Yes(hands) => hands,
            Ready::Soon => return Ok(true),
            Ready::NotYet => return Ok(false),
            Ready::Never(why) => return Ok(self.break_off(index, cycle, why)),
        };
        let parcels: Vec<_> = hands
            .into_iter()
            .filter_map(|(from, place, read)| {
                let past = self.tasks.get_mut(from)?.past.get_mut(&index)?;
                Some((from, past.take(place)?.clone(), read))
            })
            .collect();

        let Some(task) = self.tasks.get_mut(index) else { return Ok(false) };
        let Some(row) = task.rows.pop_front() else { return Ok(false) };
        self.waiting_bytes = self.waiting_bytes.saturating_sub(row.bytes());
        task.read.extend(parcels.iter().map(|(from, _, read)| (*from, *read)));
        // As in a node: what was done, with what the engine before had read, then the inputs.
        let (of_now, of_next): (Vec<_>, Vec<_>) = parcels
            .iter()
            .partition(|(_, parcel, _)| self.is_other || parcel.changes() <= task.changes);
        for (from, parcel, _) in of_now {
            task.wires.hand(*from, parcel);
        }
        if changed.is_some() && !task.is_handed_over() {
            task.hand_over(&mut self.operations, index);
        }
        self.operations.apply(index, cycle, &mut task.engine);
        if let Some(plan) = changed {
            task.change(plan, index);
            task.places.insert(channel, places.clone());
        }
        for (from, parcel, _) in of_next {
            task.wires.hand(*from, parcel);
        }
        for (input, place) in places.inputs.iter().enumerate() {
            let Some(place) = *place else { continue };
            let (source_ns, flags) = (row.head.release_ns, Flags::NONE);
            let (value, ok, age_s) =
                (row.value(place), row.value(place + 1) != 0.0, row.value(place + 2));
            let reading = InputReading { value, ok, age_s, source_ns, flags };
            if !task.engine.read_input(input, &reading) {
                let name = task.layout.inputs.get(input).map_or("", |input| &input.name);
                let value_type = task.input_type(index, input);
                self.rejects.add(|| {
                    let value = numbers::format(value);
                    let value_type = value_type.map_or(String::new(), |it| it.to_string());
                    format!("\"{name}\" is {value_type}, which cannot hold {value} (cycle {cycle})")
                });
            }
        }
        let engine = &mut task.engine;
        catch_panic(|| engine.step(cycle)).map_err(|Panic { message, place }| {
            let plan = task.plan.tasks.get(index);
            let bank = engine.stepping().and_then(|bank| plan?.banks.get(bank));
            let block = bank.map(|bank| bank.any_block());
            Failure::found(TaskPanicked { task: task.name.clone(), block, message, place })
        })?;
        task.engine.read_row(&mut task.repeated);
        let entries = |values: &[f64]| values.first().copied().unwrap_or_default();
        if !self.is_other && entries(&row.values) != entries(&task.repeated) {
            task.left += 1;
            let why = "what was done to it is not in the recorded journal".to_owned();
            return Ok(self.break_off(index, cycle, why));
        }
        let when = When { cycle, release_ns: row.head.release_ns };
        for &(signal, recorded, own) in &places.signals {
            let repeated = task.repeated.get(own).copied().unwrap_or(f64::NAN);
            self.comparison.compare(signal, when, row.value(recorded), repeated);
        }
        task.keep_given(row.head.end_ns);
        task.last = Some(row.head);
        task.cycles += 1;
        match &mut self.output {
            Some(output) => output.write(&self.tasks, index, row.head).map(|()| true),
            None => Ok(true),
        }
    }

    fn break_off(&mut self, task: usize, cycle: u64, why: String) -> bool {
        if let Some(task) = self.tasks.get_mut(task) {
            let rows = task.rows.iter().map(Row::bytes).sum();
            self.waiting_bytes = self.waiting_bytes.saturating_sub(rows);
            task.break_off(cycle, why);
        }
        true
    }
}

/// Why nothing is known of cycles before a row, if so.
fn gap(next: u64, last: Option<RowHead>, head: RowHead) -> Option<String> {
    let RowHead { cycle, missed, lost, .. } = head;
    if lost > 0 {
        let were = were(lost);
        return Some(format!(
            "{were} lost before cycle {cycle}, as the recorder could not keep up"
        ));
    }
    let before = last.map_or(0, |last| last.missed);
    let is_whole =
        cycle.checked_sub(next).is_some_and(|between| Some(between) == missed.checked_sub(before));
    (!is_whole).then(|| format!("cycles before cycle {cycle} are not in the recording"))
}

/// A number of rows, and the verb for it.
fn were(count: u64) -> String {
    format!("{} {}", counted(count, "row"), if count == 1 { "was" } else { "were" })
}
