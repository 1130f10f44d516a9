//! The records of a task's cycles, from the cycle to the ordinary thread.

use isochrone_timing::{CycleRecord, FollowRecord, TaskTiming};
use rtrb::{Consumer, Producer, RingBuffer};

/// Records that fit between the cycle and the thread that reads them: 40 ms at the shortest period.
const RING_RECORDS: usize = 4096;

/// What a cycle tells of itself.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Cycle {
    pub(crate) record: CycleRecord,
    /// Of a task that follows its data.
    pub(crate) follow: Option<FollowRecord>,
}

/// The records of a task that follows nothing stay as short as they are.
enum Ends<Plain, Following> {
    Plain(Plain),
    Following(Following),
}

type FollowingCycle = (CycleRecord, FollowRecord);

/// The end in the cycle.
pub(crate) struct RecordSender(Ends<Producer<CycleRecord>, Producer<FollowingCycle>>);

/// The end in the ordinary thread.
pub(crate) struct RecordReceiver(Ends<Consumer<CycleRecord>, Consumer<FollowingCycle>>);

/// Both ends for a task, which follows its data or does not.
pub(crate) fn ends(follow_within_ns: Option<u64>) -> (RecordSender, RecordReceiver) {
    if follow_within_ns.is_some() {
        let (sender, receiver) = RingBuffer::new(RING_RECORDS);
        return (RecordSender(Ends::Following(sender)), RecordReceiver(Ends::Following(receiver)));
    }
    let (sender, receiver) = RingBuffer::new(RING_RECORDS);
    (RecordSender(Ends::Plain(sender)), RecordReceiver(Ends::Plain(receiver)))
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

    /// Tells the task's timing that this was the last cycle.
    pub(crate) fn end(&self, timing: &mut TaskTiming) {
        timing.end(&self.record);
        if let Some(follow) = &self.follow {
            timing.end_following(follow);
        }
    }
}
