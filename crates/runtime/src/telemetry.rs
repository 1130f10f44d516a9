//! Telemetry: all signals of a node and the timing of its cycles, for whoever wants to watch.
//!
//! The cycle writes snapshots into a wait-free ring; an ordinary thread reads them and publishes
//! one frame service of its own, `isochrone/<node>/telemetry`. Watching therefore costs the cycle
//! the same with eight observers as with none.
//!
//! The frame has, for each task, its timing and then its signals: inputs and outputs of blocks, the
//! first [`MAX_SIGNALS`] of them. Each snapshot is a copy in the slack of a cycle, and the frames of
//! all observers stand in shared memory; both shall stay small. A node with more is told at its start.

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Plan, TaskPlan};
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, OpenError, Participant, Repair, SignalSpec,
    Stamp, give_up_file_override, ipc,
};
use isochrone_timing::{CycleRecord, Warning, WarningCode};
use rtrb::{Consumer, Producer, RingBuffer};

/// Most signals of a task that are watched.
const MAX_SIGNALS: usize = 1024;
/// Snapshots are taken at most this often.
const INTERVAL_NS: u64 = 20_000_000;
/// Snapshots that fit into the ring.
const SNAPSHOTS: usize = 4;

/// The timing channels of a task, which stand before its signals.
const TIMING: [&str; 6] =
    ["cycle", "release_jitter_ns", "execution_ns", "response_ns", "missed", "overruns"];

/// The end in the cycle.
pub struct Tap {
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
    pub fn take(&mut self, image: &[f64]) {
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
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// The end in the ordinary thread.
pub struct Telemetry {
    publisher: FramePublisher<ipc::Service>,
    announcer: LayoutAnnouncer<ipc::Service>,
    repair: Repair,
    values: Vec<f64>,
    sources: Vec<Source>,
    frames: u64,
    fresh: bool,
}

struct Source {
    ring: Consumer<f64>,
    /// Channels of the task's signals.
    signals: std::ops::Range<usize>,
}

impl Telemetry {
    /// Name of a node's telemetry service.
    pub fn service(node: &str) -> String {
        format!("isochrone/{node}/telemetry")
    }

    /// Says of each task with more signals than are watched how many those are.
    pub fn warnings(plan: &Plan) -> impl Iterator<Item = Warning> {
        let counted = plan.tasks.iter().map(|task| (task, signals(task).count()));
        counted.filter(|(_, signals)| *signals > MAX_SIGNALS).map(|(task, signals)| Warning {
            code: WarningCode::TelemetryCut,
            message: format!(
                "task \"{}\" has {signals} signals, and {} shows the first {MAX_SIGNALS} of them",
                task.name,
                Self::service(&plan.node)
            ),
            remedy: "publish what else is to be seen with an [[output]], or run a part of the blocks in \
                     another task"
                .into(),
        })
    }

    /// Opens the service; returns a tap for each task.
    pub fn open(
        participant: &Participant<ipc::Service>,
        plan: &Plan,
    ) -> Result<(Self, Vec<Tap>), OpenError> {
        let mut signals = Vec::new();
        let mut sources = Vec::new();
        let mut taps = Vec::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let timing = TIMING.iter().map(|name| format!("task.{}.{name}", task.name));
            signals.extend(timing.map(|name| SignalSpec::new(name, "LREAL")));
            let first = signals.len();
            let slots: Box<[usize]> = watched(task).map(|(slot, _)| slot).collect();
            signals.extend(watched(task).map(|(slot, value_type)| {
                SignalSpec::new(plan.slot_name(index, slot), value_type)
            }));
            let (producer, consumer) = RingBuffer::new((slots.len() * SNAPSHOTS).max(1));
            sources.push(Source { ring: consumer, signals: first..signals.len() });
            let every = INTERVAL_NS.div_ceil(task.schedule.period_ns).max(1);
            taps.push(Tap { ring: producer, slots, every, cycles: 0, lost: 0 });
        }
        let values = vec![0.0; signals.len()];
        let layout = FrameLayout { signals, period_ns: None };
        let service = Self::service(&plan.node);
        let publisher = FramePublisher::open(participant, &service, &layout)?;
        let announcer = LayoutAnnouncer::open(participant, &service, &plan.node, &layout)?;
        let repair = publisher.repair();
        let telemetry =
            Self { publisher, announcer, repair, values, sources, frames: 0, fresh: false };
        Ok((telemetry, taps))
    }

    /// Notes a cycle of a task; the newest before [`publish`](Self::publish) is shown.
    pub fn note(&mut self, task: usize, record: &CycleRecord) {
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
        self.fresh = true;
    }

    /// Publishes the newest snapshot of every task, if there is anything new.
    pub fn publish(&mut self, participant: &Participant<ipc::Service>) {
        self.repair.tend(participant);
        self.announcer.tend(participant);
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
        if !std::mem::take(&mut self.fresh) {
            return;
        }
        if let Some(values) = self.publisher.values_mut() {
            values.copy_from_slice(&self.values);
        }
        let now_ns = Monotonic.now_ns();
        let stamp = Stamp { cycle: self.frames, release_ns: now_ns, source_ns: 0, missed: 0 };
        self.frames += 1;
        // The thread that publishes also ends the node: a half-made observer must not hold it up.
        let _given_up = give_up_file_override();
        // Whoever watches sees a frame that is missing by its sequence.
        self.publisher.send(stamp, || now_ns);
        self.publisher.prepare();
    }
}

/// Those of a task's signals that are watched.
fn watched(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
    signals(task).take(MAX_SIGNALS)
}

/// Slots and types of a task's inputs and of the outputs of its blocks.
fn signals(task: &TaskPlan) -> impl Iterator<Item = (usize, &'static str)> {
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
