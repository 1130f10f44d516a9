//! Snapshots of a node's signals and of the timing of its cycles: taken in the slack, and read in the
//! ordinary thread.
//!
//! Signals are inputs with their `ok` and `age`, variables, and outputs of blocks; the first [`MAX_SIGNALS`] of each
//! task. Each snapshot is a copy in the slack of a cycle, so it has to stay small.

use std::collections::{HashMap, VecDeque};
use std::ops::Range;

use isochrone_engine::{InputPart, Plan, TaskPlan};
use isochrone_ipc::{FrameLayout, SignalSpec};
use triple_buffer::{Input as Sender, Output as Receiver, TripleBuffer};

use crate::task::records::Cycle;
use crate::task::timing_channels;

/// The most signals of a task that snapshots have.
pub(crate) const MAX_SIGNALS: usize = 1024;
/// Snapshots are taken at most this often.
const INTERVAL_NS: u64 = 20_000_000;

/// The timing and the signals of a task, all of one cycle; NaN until it has run.
type Snapshot = Box<[f64]>;

/// The end in the cycle.
pub(crate) struct Tap {
    sender: Sender<Snapshot>,
    /// How many channels of timing there are.
    timing: usize,
    slots: Box<[usize]>,
    /// A snapshot is taken every so many cycles.
    every: u64,
    cycles: u64,
    lost: u64,
}

impl Tap {
    /// Takes a snapshot after a cycle if one is due; for the slack. A snapshot that the ordinary thread did not fetch
    /// in time is replaced and counted as lost.
    pub(crate) fn take(&mut self, image: &[f64], cycle: &Cycle) {
        self.cycles = self.cycles.wrapping_add(1);
        if !self.cycles.is_multiple_of(self.every) {
            return;
        }
        let snapshot = self.sender.input_buffer_mut();
        let (timing, signals) = snapshot.split_at_mut_checked(self.timing).unwrap_or_default();
        let values = timing_channels::values(cycle);
        timing.iter_mut().zip(values).for_each(|(channel, value)| *channel = value);
        for (value, slot) in signals.iter_mut().zip(&self.slots) {
            *value = image.get(*slot).copied().unwrap_or_default();
        }
        self.lost += u64::from(self.sender.publish());
    }

    /// Changes to the signals of another configuration, and leaves its own in its place.
    pub(crate) fn change(&mut self, new: &mut Self) {
        (new.cycles, new.lost) = (self.cycles, self.lost);
        std::mem::swap(self, new);
    }

    /// Snapshots that were lost.
    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }
}

/// The end in the ordinary thread.
pub(crate) struct Snapshots {
    layout: FrameLayout,
    values: Vec<f64>,
    /// Channels by name.
    channels: HashMap<String, usize>,
    sources: Vec<Source>,
    /// The signals of configurations that are on their way to the tasks.
    coming: VecDeque<Snapshots>,
}

struct Source {
    receiver: Receiver<Snapshot>,
    channels: Range<usize>,
    /// Whether a snapshot has come.
    has_run: bool,
}

impl Snapshots {
    /// Both ends for all tasks of a node; a tap for each task.
    pub(crate) fn of(plan: &Plan) -> (Self, Vec<Tap>) {
        let mut signals = Vec::new();
        let mut sources = Vec::new();
        let mut taps = Vec::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let first = signals.len();
            let schedule = task.settings.schedule();
            let timing = timing_channels::names(&task.name, &schedule);
            let timing_len = timing.len();
            signals.extend(timing.map(|name| SignalSpec::new(name, "LREAL")));
            signals.extend(watched(task).map(|(slot, value_type)| {
                SignalSpec::new(plan.slot_name(index, slot), value_type)
                    .in_unit(plan.slot_unit(index, slot))
            }));
            let channels = first..signals.len();
            let none: Snapshot = vec![f64::NAN; channels.len()].into();
            let (sender, receiver) = TripleBuffer::new(&none).split();
            sources.push(Source { receiver, channels, has_run: false });
            let slots = watched(task).map(|(slot, _)| slot).collect();
            let every = INTERVAL_NS.div_ceil(task.settings.period_ns).max(1);
            taps.push(Tap { sender, timing: timing_len, slots, every, cycles: 0, lost: 0 });
        }
        let names = signals.iter().enumerate();
        let channels = names.map(|(channel, signal)| (signal.name.clone(), channel)).collect();
        let values = vec![f64::NAN; signals.len()];
        let layout = FrameLayout { signals, period_ns: None };
        (Self { layout, values, channels, sources, coming: VecDeque::new() }, taps)
    }

    /// What the values are.
    pub(crate) fn layout(&self) -> &FrameLayout {
        &self.layout
    }

    /// The newest values; NaN for those of tasks that have not run.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// The newest value of a signal; `None` if it is not watched or its task has not run.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        let coming = self.coming.iter().rev().find_map(|coming| coming.value(name));
        coming.or_else(|| {
            let channel = *self.channels.get(name)?;
            let task = self.sources.iter().position(|of| of.channels.contains(&channel))?;
            // A signal that a changed task no longer has is gone.
            let is_gone = self.coming.iter().any(|coming| coming.has_run(task));
            let is_shown = self.has_run(task) && !is_gone;
            self.values.get(channel).copied().filter(|_| is_shown)
        })
    }

    fn has_run(&self, task: usize) -> bool {
        self.sources.get(task).is_some_and(|source| source.has_run)
    }

    /// Adds the signals of a configuration that is on its way to the tasks, each of which changes to it in its own
    /// cycle.
    pub(crate) fn expect(&mut self, coming: Self) {
        self.coming.push_back(coming);
    }

    /// Changes to the oldest of those configurations, which all tasks have now; whether it has the same signals.
    pub(crate) fn arrive(&mut self) -> bool {
        let Some(mut new) = self.coming.pop_front() else { return true };
        new.coming = std::mem::take(&mut self.coming);
        let is_same = new.layout == self.layout;
        *self = new;
        is_same
    }

    /// Takes in the newest snapshot of every task; whether one came since the last time.
    pub(crate) fn update(&mut self) -> bool {
        let mut is_fresh = self.update_own();
        for mut new in std::mem::take(&mut self.coming) {
            if new.update_own() {
                is_fresh = true;
                self.show(&new);
            }
            self.coming.push_back(new);
        }
        is_fresh
    }

    /// Copies the values of signals that both configurations have, for tasks that have changed; other signals become
    /// NaN.
    fn show(&mut self, new: &Self) {
        for (source, of_new) in self.sources.iter().zip(&new.sources).filter(|(_, new)| new.has_run)
        {
            let signals = self.layout.signals.iter().zip(&mut self.values);
            let of_task = signals.skip(source.channels.start).take(source.channels.len());
            for (signal, value) in of_task {
                let channel = new.channels.get(&signal.name);
                let channel = channel.filter(|channel| of_new.channels.contains(channel));
                *value = channel.and_then(|at| new.values.get(*at)).copied().unwrap_or(f64::NAN);
            }
        }
    }

    fn update_own(&mut self) -> bool {
        let mut is_fresh = false;
        for source in self.sources.iter_mut().filter(|source| source.receiver.updated()) {
            let channels = self.values.get_mut(source.channels.clone()).unwrap_or_default();
            channels.iter_mut().zip(source.receiver.read()).for_each(|(c, v)| *c = *v);
            (source.has_run, is_fresh) = (true, true);
        }
        is_fresh
    }
}

/// Those of a task's signals that are watched.
fn watched(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
    signals(task).take(MAX_SIGNALS)
}

/// Slots and types of a task's inputs with their `ok` and `age`, of its variables, and of the outputs of its blocks.
pub(crate) fn signals(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
    let inputs = task.inputs.iter().enumerate().flat_map(|(index, input)| {
        InputPart::ALL
            .map(|part| (task.input_slot(index, part), part.pin_type(input.value_type).as_str()))
    });
    let variables = task.variables.iter().enumerate();
    let variables = variables
        .map(|(index, variable)| (task.variable_slot(index), variable.value_type.as_str()));
    let outputs = task.banks.iter().flat_map(|bank| {
        let stride = bank.block_type.slots();
        (0..bank.instances.len()).flat_map(move |instance| {
            let first = bank.first_slot + instance * stride + bank.block_type.inputs.len();
            let pins = bank.block_type.outputs.iter().enumerate();
            pins.map(move |(pin, output)| (first + pin, output.pin_type.as_str()))
        })
    });
    inputs.chain(variables).chain(outputs)
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Rules, Source as Text};
    use isochrone_timing::CycleRecord;

    use super::*;

    const TWO_TASKS: &str = r#"
        [node]
        name = "n"
        [[task]]
        name = "fast"
        period = "4ms"
        [[task]]
        name = "slow"
        period = "1s"
        [[block]]
        name = "ramp"
        type = "LimRateOfChangeCI"
        task = "fast"
        in = { value = 25.0, setChangeRate = 10.0 }
        [[block]]
        name = "late"
        type = "LimRateOfChangeCI"
        task = "slow"
        in = { value = 25.0, setChangeRate = 10.0 }
    "#;

    fn both_ends() -> (Snapshots, Vec<Tap>, usize) {
        let plan = Plan::new(Text::new("n.toml", TWO_TASKS), &Rules::default()).unwrap();
        let (snapshots, taps) = Snapshots::of(&plan);
        (snapshots, taps, plan.tasks[0].image.len())
    }

    fn take(tap: &mut Tap, image: usize, cycle: u64) {
        let record = CycleRecord { cycle, ..CycleRecord::default() };
        tap.take(&vec![cycle as f64; image], &Cycle { record, follow: None });
    }

    #[test]
    fn the_newest_snapshot_replaces_those_that_nobody_fetched_which_are_counted() {
        let (mut snapshots, mut taps, image) = both_ends();
        (0..28).for_each(|cycle| take(&mut taps[0], image, cycle));
        assert!(snapshots.update());
        assert_eq!(taps[0].lost(), 4, "every fifth cycle is taken, and the last of them fetched");
        let value = |name| snapshots.value(name);
        assert_eq!(
            (value("task.fast.cycle"), value("ramp.delayedValue")),
            (Some(24.0), Some(24.0))
        );
        assert!(!snapshots.update(), "nothing came since");
    }

    #[test]
    fn what_a_task_that_has_not_run_would_show_is_nan_on_the_wire_and_none_in_the_program() {
        let (mut snapshots, mut taps, image) = both_ends();
        (0..5).for_each(|cycle| take(&mut taps[0], image, cycle));
        snapshots.update();
        for (signal, value) in snapshots.layout().signals.iter().zip(snapshots.values()) {
            let has_run = signal.name.starts_with("task.fast") || signal.name.starts_with("ramp");
            assert_eq!(value.is_nan(), !has_run, "{}", signal.name);
            assert_eq!(snapshots.value(&signal.name).is_some(), has_run, "{}", signal.name);
        }
    }
}
