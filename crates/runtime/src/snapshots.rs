//! Snapshots of a node's signals and of the timing of its cycles: taken in the slack, and read in the
//! ordinary thread.
//!
//! Signals are inputs and outputs of blocks, the first [`MAX_SIGNALS`] of each task. Each snapshot is a
//! copy in the slack of a cycle, and shall stay small.

use std::collections::HashMap;

use isochrone_engine::{Plan, TaskPlan};
use isochrone_ipc::{FrameLayout, SignalSpec};
use isochrone_timing::CycleRecord;
use rtrb::{Consumer, Producer, RingBuffer};

/// Most signals of a task that are watched.
pub(crate) const MAX_SIGNALS: usize = 1024;
/// Snapshots are taken at most this often.
const INTERVAL_NS: u64 = 20_000_000;
/// Snapshots that fit into the ring.
const SNAPSHOTS: usize = 4;

/// The timing channels of a task, which stand before its signals.
const TIMING: [&str; 6] =
    ["cycle", "release_jitter_ns", "execution_ns", "response_ns", "missed", "overruns"];

/// The end in the cycle.
pub(crate) struct Tap {
    ring: Producer<f64>,
    slots: Box<[usize]>,
    /// A snapshot is taken every so many cycles.
    every: u64,
    cycles: u64,
    lost: u64,
}

impl Tap {
    /// Takes a snapshot if one is due; for the slack. Where the ring is full, because the ordinary
    /// thread got no time to empty it, the snapshot is lost.
    pub(crate) fn take(&mut self, image: &[f64]) {
        self.cycles = self.cycles.wrapping_add(1);
        if !self.cycles.is_multiple_of(self.every) {
            return;
        }
        let Ok(mut chunk) = self.ring.write_chunk(self.slots.len()) else {
            self.lost += 1;
            return;
        };
        let (first, second) = chunk.as_mut_slices();
        for (value, slot) in first.iter_mut().chain(second).zip(&self.slots) {
            *value = image.get(*slot).copied().unwrap_or_default();
        }
        chunk.commit_all();
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
    is_fresh: bool,
}

struct Source {
    ring: Consumer<f64>,
    /// Channels of the task's signals.
    signals: std::ops::Range<usize>,
}

impl Snapshots {
    /// Both ends for all tasks of a node; a tap for each task.
    pub(crate) fn of(plan: &Plan) -> (Self, Vec<Tap>) {
        let mut signals = Vec::new();
        let mut values = Vec::new();
        let mut sources = Vec::new();
        let mut taps = Vec::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let timing = TIMING.iter().map(|name| format!("task.{}.{name}", task.name));
            signals.extend(timing.map(|name| SignalSpec::new(name, "LREAL")));
            values.extend([0.0; TIMING.len()]);
            let first = signals.len();
            let slots: Box<[usize]> = watched(task).map(|(slot, _)| slot).collect();
            signals.extend(watched(task).map(|(slot, value_type)| {
                SignalSpec::new(plan.slot_name(index, slot), value_type)
            }));
            values.extend(slots.iter().map(|slot| task.image.get(*slot).copied().unwrap_or(0.0)));
            let (producer, consumer) = RingBuffer::new((slots.len() * SNAPSHOTS).max(1));
            sources.push(Source { ring: consumer, signals: first..signals.len() });
            let every = INTERVAL_NS.div_ceil(task.schedule.period_ns).max(1);
            taps.push(Tap { ring: producer, slots, every, cycles: 0, lost: 0 });
        }
        let names = signals.iter().enumerate();
        let channels = names.map(|(channel, signal)| (signal.name.clone(), channel)).collect();
        let layout = FrameLayout { signals, period_ns: None };
        (Self { layout, values, channels, sources, is_fresh: false }, taps)
    }

    /// What the values are.
    pub(crate) fn layout(&self) -> &FrameLayout {
        &self.layout
    }

    /// The newest values.
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// The newest value of a signal; `None` if it is not watched.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.values.get(*self.channels.get(name)?).copied()
    }

    /// Notes a cycle of a task; the newest is shown.
    pub(crate) fn note(&mut self, task: usize, record: &CycleRecord) {
        let first = self.sources.get(task).map_or(0, |source| source.signals.start);
        let timing = [
            record.cycle,
            record.start_ns.saturating_sub(record.release_ns),
            record.end_ns.saturating_sub(record.start_ns),
            record.end_ns.saturating_sub(record.release_ns),
            record.missed,
            record.overruns,
        ];
        let channels = self.values.iter_mut().skip(first.saturating_sub(TIMING.len()));
        channels.zip(timing).for_each(|(channel, value)| *channel = value as f64);
        self.is_fresh = true;
    }

    /// Takes in the newest snapshot of every task; whether a cycle was noted since the last time.
    pub(crate) fn update(&mut self) -> bool {
        for source in &mut self.sources {
            let channels = self.values.get_mut(source.signals.clone()).unwrap_or_default();
            while !channels.is_empty()
                && let Ok(chunk) = source.ring.read_chunk(channels.len())
            {
                let (first, second) = chunk.as_slices();
                channels.iter_mut().zip(first.iter().chain(second)).for_each(|(c, v)| *c = *v);
                chunk.commit_all();
            }
        }
        std::mem::take(&mut self.is_fresh)
    }
}

/// Those of a task's signals that are watched.
fn watched(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
    signals(task).take(MAX_SIGNALS)
}

/// Slots and types of a task's inputs and of the outputs of its blocks.
pub(crate) fn signals(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
    let inputs =
        task.inputs.iter().enumerate().map(|(slot, input)| (slot, input.value_type.as_str()));
    let outputs = task.banks.iter().flat_map(|bank| {
        let stride = bank.block_type.slots();
        (0..bank.instances.len()).flat_map(move |instance| {
            let first = bank.first_slot + instance * stride + bank.block_type.inputs.len();
            let pins = bank.block_type.outputs.iter().enumerate();
            pins.map(move |(pin, output)| (first + pin, output.pin_type.as_str()))
        })
    });
    inputs.chain(outputs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_snapshot_that_finds_no_room_is_lost_and_counted() {
        let (ring, mut reader) = RingBuffer::new(2 * SNAPSHOTS);
        let mut tap = Tap { ring, slots: [3, 1].into(), every: 5, cycles: 0, lost: 0 };
        let image = [0.0, 1.0, 2.0, 3.0];
        (0..5 * (SNAPSHOTS + 2)).for_each(|_| tap.take(&image));
        assert_eq!(tap.lost(), 2);
        assert_eq!(reader.slots(), 2 * SNAPSHOTS);
        assert_eq!((reader.pop(), reader.pop()), (Ok(3.0), Ok(1.0)));
        (0..5).for_each(|_| tap.take(&image));
        assert_eq!(tap.lost(), 2, "there is room again");
    }
}
