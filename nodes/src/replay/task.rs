//! A task that is repeated: its engine, the rows that wait for it, and what it gave to others.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::Arc;

use isochrone_blocks::PinType;
use isochrone_engine::{Parcel, Plan, TaskEngine, Wires};
use isochrone_recording::{RowHead, TaskLayout};
use isochrone_runtime::task_layouts;

use super::comparison::Comparison;
use super::missing::Missing;
use super::operations::Operations;

/// A row that waits to be repeated.
pub(super) struct Row {
    pub(super) layout: Arc<TaskLayout>,
    /// Equal numbers have equal layouts.
    pub(super) channel: u16,
    pub(super) head: RowHead,
    pub(super) values: Vec<f64>,
}

impl Row {
    /// How many bytes it takes.
    pub(super) fn bytes(&self) -> usize {
        size_of::<Self>() + self.values.len() * size_of::<f64>()
    }

    pub(super) fn value(&self, place: usize) -> f64 {
        self.values.get(place).copied().unwrap_or(f64::NAN)
    }
}

/// Values that a task sent to another one.
pub(super) struct SentParcel {
    pub(super) parcel: Parcel,
    /// When its cycle had ended in the run.
    pub(super) end_ns: u64,
}

/// The values from one task to another that the reader may still need.
#[derive(Default)]
pub(super) struct Past {
    given: VecDeque<SentParcel>,
    /// Cycle and changes of the newest parcel so far.
    newest: Option<(Option<u64>, u64)>,
    bytes: usize,
}

/// The result of looking for values that a cycle has read.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum ParcelSearch {
    /// They are at this index.
    Here(usize),
    /// Their task has not computed them yet.
    Later,
    /// Their task has computed later ones, and they are not among those kept.
    Never,
}

impl Past {
    /// The most bytes that wait for a reader.
    const MOST_BYTES: usize = 32 << 20;

    pub(super) fn push(&mut self, given: SentParcel) {
        self.newest = Some((given.parcel.cycle(), given.parcel.changes()));
        self.bytes += given.parcel.bytes();
        self.given.push_back(given);
        while self.bytes > Self::MOST_BYTES && self.given.len() > 1 {
            self.forget(1);
        }
    }

    /// Looks for the values of a cycle; `changes`: of which configuration, if that matters.
    pub(super) fn find(&self, cycle: u64, changes: Option<u64>) -> ParcelSearch {
        let matches = |given: &SentParcel| {
            given.parcel.cycle() == Some(cycle)
                && changes.is_none_or(|changes| given.parcel.changes() == changes)
        };
        if let Some(place) = self.given.iter().rposition(matches) {
            return ParcelSearch::Here(place);
        }
        let wanted = (changes, Some(cycle));
        let newest = self.newest.map(|(cycle, of)| (changes.map(|_| of), cycle));
        if newest.is_some_and(|newest| newest >= wanted) {
            ParcelSearch::Never
        } else {
            ParcelSearch::Later
        }
    }

    /// The newest values that were there at an instant of the run.
    pub(super) fn find_at(&self, ns: u64) -> Option<usize> {
        self.given.iter().rposition(|given| given.end_ns <= ns)
    }

    /// The values at an index; earlier ones are dropped, as no cycle reads them any more.
    pub(super) fn take(&mut self, place: usize) -> Option<&Parcel> {
        self.forget(place);
        self.given.front().map(|given| &given.parcel)
    }

    fn forget(&mut self, count: usize) {
        let forgotten = self.given.drain(..count.min(self.given.len()));
        self.bytes -= forgotten.map(|given| given.parcel.bytes()).sum::<usize>();
    }
}

/// Why the rest of a task cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Broken {
    /// The first cycle that cannot be.
    pub(super) cycle: u64,
    pub(super) why: String,
}

/// A task of the run.
pub(super) struct Task {
    pub(super) name: String,
    pub(super) engine: TaskEngine,
    pub(super) wires: Wires,
    /// Those of the engine that it was handed over to, ahead of the cycle that has it.
    next_wires: Option<Wires>,
    pub(super) plan: Arc<Plan>,
    pub(super) layout: TaskLayout,
    /// How many online changes it has had.
    pub(super) changes: u64,
    pub(super) rows: VecDeque<Row>,
    /// Where what is in the rows of a channel belongs, in the plan that it has now.
    pub(super) places: HashMap<u16, Arc<Places>>,
    /// The values that it sent to other tasks, by their index.
    pub(super) past: HashMap<usize, Past>,
    /// The values that it read last from other tasks, by their index: cycle and changes.
    pub(super) read: HashMap<usize, (u64, u64)>,
    first_cycle: u64,
    pub(super) last: Option<RowHead>,
    pub(super) cycles: u64,
    /// Rows that were not repeated.
    pub(super) left: u64,
    pub(super) broken: Option<Broken>,
    /// Room for the values of a cycle.
    pub(super) repeated: Vec<f64>,
}

/// Where the values of recorded rows belong.
pub(super) struct Places {
    /// For each input of the plan, the index of its value in the row.
    pub(super) inputs: Vec<Option<usize>>,
    /// For each task with wires to this one, by index, the index of its cycle in the row.
    pub(super) wires: Vec<(usize, Option<usize>)>,
    /// Of each signal that is compared its number, and where it stands in the recorded row and in the
    /// repeated one.
    pub(super) signals: Vec<(usize, usize, usize)>,
    /// Signals of the plan that were not recorded.
    pub(super) added: BTreeSet<String>,
}

impl Task {
    pub(super) fn new(
        plan: Arc<Plan>,
        task: usize,
        mut engine: TaskEngine,
        first_cycle: u64,
    ) -> Self {
        let wires = engine.loosen();
        let layout = task_layouts(&plan).into_iter().nth(task).unwrap_or_default();
        let repeated = vec![0.0; engine.row_len()];
        let mut new = Self {
            name: layout.task.clone(),
            engine,
            wires,
            next_wires: None,
            plan,
            layout,
            changes: 0,
            rows: VecDeque::new(),
            places: HashMap::new(),
            past: HashMap::new(),
            read: HashMap::new(),
            first_cycle,
            last: None,
            cycles: 0,
            left: 0,
            broken: None,
            repeated,
        };
        // Others read the values of its last cycle, if it goes on from an earlier run.
        new.keep_given(0);
        new
    }

    /// Hands it over to the engine of its next configuration, if it gets one; `index` is its own.
    pub(super) fn hand_over(&mut self, operations: &mut Operations, index: usize) {
        let (cycle, ns) = self.last.map_or((None, 0), |last| (Some(last.cycle), last.end_ns));
        if let Some(mut wires) = operations.hand_over(index, cycle, &mut self.engine) {
            keep(&mut self.past, &mut wires, ns);
            self.next_wires = Some(wires);
        }
    }

    /// Whether it was handed over to its next configuration.
    pub(super) fn is_handed_over(&self) -> bool {
        self.next_wires.is_some()
    }

    /// Has another configuration, which its engine got.
    pub(super) fn change(&mut self, plan: Arc<Plan>, task: usize) {
        if let Some(wires) = self.next_wires.take() {
            self.wires = wires;
        }
        self.layout = task_layouts(&plan).into_iter().nth(task).unwrap_or_default();
        self.repeated = vec![0.0; self.engine.row_len()];
        self.plan = plan;
        self.changes += 1;
        self.places.clear();
    }

    /// Keeps what the engine gave to other tasks.
    pub(super) fn keep_given(&mut self, end_ns: u64) {
        keep(&mut self.past, &mut self.wires, end_ns);
    }

    /// The first cycle that may come next.
    pub(super) fn next_cycle(&self) -> u64 {
        self.last.map_or(self.first_cycle, |last| last.cycle.saturating_add(1))
    }

    /// The rest of it cannot be compared.
    pub(super) fn break_off(&mut self, cycle: u64, why: String) {
        self.left += self.rows.len() as u64;
        self.rows.clear();
        self.broken.get_or_insert(Broken { cycle, why });
    }

    /// The type of an input.
    pub(super) fn input_type(&self, task: usize, input: usize) -> Option<PinType> {
        Some(self.plan.tasks.get(task)?.inputs.get(input)?.value_type)
    }
}

/// Keeps what a task gave to others.
fn keep(past: &mut HashMap<usize, Past>, wires: &mut Wires, end_ns: u64) {
    for (to, parcel) in wires.given() {
        past.entry(to).or_default().push(SentParcel { parcel: parcel.clone(), end_ns });
    }
}

impl Places {
    /// Where the values of rows of a layout belong in those of another one.
    pub(super) fn new(
        recorded: &TaskLayout,
        own: &TaskLayout,
        plan: &Plan,
        comparison: &mut Comparison,
        missing: &mut Missing,
    ) -> Self {
        let input = |name: &str| recorded.inputs.iter().position(|input| input.name == name);
        let inputs = own.inputs.iter().map(|it| Some(recorded.input(input(&it.name)?))).collect();
        let wire = |name: &String| {
            let place = recorded.wires.iter().position(|wire| wire == name);
            Some((plan.task_index(name)?, place.map(|place| recorded.wire(place))))
        };
        let wires = own.wires.iter().filter_map(wire).collect();
        let mut there = HashMap::new();
        for (of, places) in own.placed_outputs() {
            for (signal, place) in of.signals.iter().zip(places) {
                there.insert((of.service.as_str(), signal.name.as_str()), place);
            }
        }
        let mut signals = Vec::new();
        for (of, places) in recorded.placed_outputs() {
            for (signal, place) in of.signals.iter().zip(places) {
                match there.remove(&(of.service.as_str(), signal.name.as_str())) {
                    Some(own) => {
                        let number = comparison.signal(&recorded.task, &of.service, &signal.name);
                        signals.push((number, place, own));
                    }
                    None => missing.signal(&recorded.task, &of.service, &signal.name),
                }
            }
        }
        for input in &recorded.inputs {
            if !own.inputs.iter().any(|own| own.name == input.name) {
                missing.input(&recorded.task, &input.name);
            }
        }
        let added = there.keys().map(|(service, name)| format!("{service}.{name}")).collect();
        Self { inputs, wires, signals, added }
    }
}
