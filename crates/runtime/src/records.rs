//! The records of a task's cycles, from the cycle to the ordinary thread.

use isochrone_model::Schedule;
use isochrone_timing::{CycleRecord, FollowRecord, TaskTiming};
use rtrb::{Consumer, Producer, RingBuffer};

/// The time that a ring holds, so that nothing is lost if the ordinary thread gets no CPU for a while; at the
/// shortest periods, as much of it as fits into the ring's memory.
const RING_NS: u64 = 1_000_000_000;
const RING_BYTES: usize = 8 << 20;

/// The record of a cycle.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cycle {
    pub(crate) record: CycleRecord,
    /// For a task that follows its data.
    pub(crate) follow: Option<FollowRecord>,
}

/// The records of a task that follows nothing stay as short as they are.
enum Ends<Plain, Following> {
    Plain(Plain),
    Following(Following),
}

type FollowingCycle = (CycleRecord, FollowRecord);

/// The cycle's end.
pub(crate) struct RecordSender(Ends<Producer<CycleRecord>, Producer<FollowingCycle>>);

/// The ordinary thread's end.
pub(crate) struct RecordReceiver(Ends<Consumer<CycleRecord>, Consumer<FollowingCycle>>);

/// Both ends for a task, which follows its data or does not.
pub(crate) fn ends(schedule: &Schedule) -> (RecordSender, RecordReceiver) {
    if schedule.follow_within_ns.is_some() {
        let (sender, receiver) = ring(schedule.period_ns);
        return (RecordSender(Ends::Following(sender)), RecordReceiver(Ends::Following(receiver)));
    }
    let (sender, receiver) = ring(schedule.period_ns);
    (RecordSender(Ends::Plain(sender)), RecordReceiver(Ends::Plain(receiver)))
}

/// A ring whose memory has been touched, so that no cycle causes a page fault there.
fn ring<T: Copy + Default>(period_ns: u64) -> (Producer<T>, Consumer<T>) {
    let (mut sender, mut receiver) =
        RingBuffer::new(cycles_within(RING_NS, period_ns, size_of::<T>(), RING_BYTES));
    while sender.push(T::default()).is_ok() {}
    while receiver.pop().is_ok() {}
    (sender, receiver)
}

/// How many cycles cover this time, or fill the memory that a ring may have, if that is less.
pub(crate) fn cycles_within(ns: u64, period_ns: u64, bytes: usize, most_bytes: usize) -> usize {
    /// At least this many, however slow the cycle or large the row.
    const FEWEST: usize = 16;
    let in_time = usize::try_from(ns / period_ns.max(1)).unwrap_or(usize::MAX);
    in_time.min(most_bytes / bytes).max(FEWEST)
}

impl RecordSender {
    /// Sends a record. A full ring drops it, and the reader sees the gap.
    pub(crate) fn push(&mut self, cycle: &Cycle) {
        match &mut self.0 {
            Ends::Plain(sender) => {
                let _ = sender.push(cycle.record);
            }
            Ends::Following(sender) => {
                let _ = sender.push((cycle.record, cycle.follow.unwrap_or_default()));
            }
        }
    }
}

impl RecordReceiver {
    /// The next record.
    pub(crate) fn pop(&mut self) -> Option<Cycle> {
        match &mut self.0 {
            Ends::Plain(receiver) => {
                receiver.pop().ok().map(|record| Cycle { record, follow: None })
            }
            Ends::Following(receiver) => {
                let (record, follow) = receiver.pop().ok()?;
                Some(Cycle { record, follow: Some(follow) })
            }
        }
    }
}

impl Cycle {
    /// Adds the cycle to its task's timing.
    pub(crate) fn add_to(&self, timing: &mut TaskTiming) {
        match &self.follow {
            Some(follow) => timing.record_following(&self.record, follow),
            None => timing.record(&self.record),
        }
    }

    /// Marks the cycle as the task's last in its timing.
    pub(crate) fn end(&self, timing: &mut TaskTiming) {
        timing.end(&self.record);
        if let Some(follow) = &self.follow {
            timing.end_following(follow);
        }
    }
}
