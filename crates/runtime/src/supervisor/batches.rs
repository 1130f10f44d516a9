//! The events of a node, for programs that subscribe to them.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use isochrone_control::desk::{OrderOutcome, Reading};
use isochrone_model::Entry;
use isochrone_timing::{CycleRecord, FollowRecord};

use crate::node::operating::RequestOutcome;

/// How long a batch is kept for a receiver that does not take it.
const KEPT: Duration = Duration::from_secs(1);

/// The events of a node since the batch before, in order.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Batch {
    /// The cycles that ended.
    pub cycles: Vec<CycleEvent>,
    /// The changes that requests made, including those of other programs: an entry for each task of a request, and
    /// for each force that ended by itself.
    pub applied: Vec<Entry>,
    /// The transactions among [`applied`](Self::applied) whose entries are not in the file of the journal,
    /// as it cannot be written: they are written as soon as it can be, and a node that is killed before loses
    /// them.
    pub unwritten: Vec<u64>,
    /// Requests that were too late for the cycle that they named, or whose forces were released before it, including
    /// those of other programs. They changed nothing.
    pub too_late: Vec<u64>,
    /// The values that [`Running::get`](crate::Running::get) asked for.
    pub readings: Vec<Reading>,
    /// Whether the node ends or has ended: it was asked to, or one of its tasks has ended.
    pub is_ending: bool,
    /// How many events were lost before this batch because they were not taken within a second: cycles, entries,
    /// numbers and readings.
    pub lost: u64,
}

/// A cycle that ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CycleEvent {
    /// The index of the task in the plan.
    pub task: usize,
    /// When it ran.
    pub record: CycleRecord,
    /// The rest of the record, for a task that follows its data; `None` for others.
    pub follow: Option<FollowRecord>,
}

impl Batch {
    /// Adds the outcome of a request.
    pub(super) fn add(&mut self, RequestOutcome { done, unwritten }: RequestOutcome) {
        match done {
            OrderOutcome::Applied(entry) => {
                self.unwritten.extend(unwritten.map(|_| entry.transaction));
                self.applied.push(entry);
            }
            OrderOutcome::TooLate { transaction } | OrderOutcome::Released { transaction } => {
                self.too_late.push(transaction);
            }
            OrderOutcome::Read(reading) => self.readings.push(reading),
        }
    }

    /// A batch that says only that the node ends.
    fn of_end() -> Self {
        Self { is_ending: true, ..Self::default() }
    }

    /// Whether it has no events.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn len(&self) -> u64 {
        let Self { cycles, applied, too_late, readings, .. } = self;
        (cycles.len() + applied.len() + too_late.len() + readings.len()) as u64
    }
}

/// The events of a node from the call of [`Running::events`](crate::Running::events) on. As an iterator it waits for
/// each [`Batch`], and ends with the node.
///
/// There are about sixty batches a second. A batch that is not taken within a second is dropped, and its events are
/// counted in the next one: a program that stops taking batches holds up nothing and fills no memory.
#[derive(Debug)]
pub struct Events(Arc<Queue>);

#[derive(Debug, Default)]
struct Queue {
    waiting: Mutex<Backlog>,
    has_more: Condvar,
}

/// The batches of one receiver.
#[derive(Debug, Default)]
struct Backlog {
    batches: VecDeque<(Instant, Batch)>,
    lost: u64,
    is_over: bool,
}

impl Events {
    /// Waits up to this long for the next batch, which is empty if none came. `None`: the node has ended, and all
    /// batches were taken.
    pub fn within(&self, time: Duration) -> Option<Batch> {
        let is_empty = |waiting: &mut Backlog| waiting.batches.is_empty() && !waiting.is_over;
        let waited = self.0.has_more.wait_timeout_while(self.0.lock(), time, is_empty);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        waiting.take().or_else(|| Some(Batch::default()).filter(|_| !waiting.is_over))
    }
}

impl Iterator for Events {
    type Item = Batch;

    fn next(&mut self) -> Option<Batch> {
        let is_empty = |waiting: &mut Backlog| waiting.batches.is_empty() && !waiting.is_over;
        let waited = self.0.has_more.wait_while(self.0.lock(), is_empty);
        waited.unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Backlog> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Backlog {
    fn put(&mut self, now: Instant, batch: Batch) {
        let is_kept = |(at, _): &(Instant, Batch)| now.duration_since(*at) <= KEPT;
        let old = self.batches.iter().position(is_kept).unwrap_or(self.batches.len());
        self.lost += self.batches.drain(..old).map(|(_, batch)| batch.len()).sum::<u64>();
        self.batches.push_back((now, batch));
    }

    fn take(&mut self) -> Option<Batch> {
        let (_, batch) = self.batches.pop_front()?;
        Some(Batch { lost: std::mem::take(&mut self.lost), ..batch })
    }
}

/// The receivers of a node's events. Without any, no events are kept.
#[derive(Debug, Clone, Default)]
pub(super) struct Listeners(Arc<Mutex<Listening>>);

#[derive(Debug, Default)]
struct Listening {
    queues: Vec<Weak<Queue>>,
    is_ending: bool,
    is_over: bool,
}

impl Listeners {
    /// Adds a receiver.
    pub(super) fn add(&self) -> Events {
        let mut listening = self.lock();
        let queue = Arc::<Queue>::default();
        queue.lock().is_over = listening.is_over;
        if listening.is_ending && !listening.is_over {
            queue.lock().put(Instant::now(), Batch::of_end());
        }
        listening.queues.push(Arc::downgrade(&queue));
        Events(queue)
    }

    /// Whether there is a receiver.
    pub(super) fn are_there(&self) -> bool {
        let mut listening = self.lock();
        listening.queues.retain(|queue| queue.strong_count() > 0);
        !listening.queues.is_empty()
    }

    /// Sends a batch to all receivers.
    pub(super) fn tell(&self, batch: &Batch) {
        self.lock().tell(batch);
    }

    /// Tells all receivers, also later ones, that the node begins to end.
    pub(super) fn begin_end(&self) {
        let mut listening = self.lock();
        listening.is_ending = true;
        listening.tell(&Batch::of_end());
    }

    /// Ends all receivers: there are no more events.
    pub(super) fn end(&self) {
        let mut listening = self.lock();
        listening.is_over = true;
        for queue in listening.queues.drain(..).filter_map(|queue| queue.upgrade()) {
            queue.lock().is_over = true;
            queue.has_more.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Listening> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Listening {
    fn tell(&self, batch: &Batch) {
        let now = Instant::now();
        for queue in self.queues.iter().filter_map(Weak::upgrade) {
            queue.lock().put(now, batch.clone());
            queue.has_more.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn batch(number: u64) -> Batch {
        Batch { too_late: vec![number], ..Batch::default() }
    }

    #[test]
    fn what_is_not_taken_within_a_second_is_lost_and_counted_in_the_next_batch() {
        let (mut waiting, begin) = (Backlog::default(), Instant::now());
        for number in 0..150 {
            waiting.put(begin + Duration::from_millis(10 * number), batch(number));
        }
        let first = waiting.take().unwrap();
        assert_eq!((first.lost, &first.too_late[..]), (49, &[49][..]));
        let second = waiting.take().unwrap();
        assert_eq!((second.lost, &second.too_late[..]), (0, &[50][..]));
        assert_eq!(std::iter::from_fn(|| waiting.take()).count(), 99);
    }

    #[test]
    fn everybody_who_asked_is_told_what_happened_since_and_then_of_the_end() {
        let listeners = Listeners::default();
        assert!(!listeners.are_there());
        let first = listeners.add();
        listeners.tell(&batch(1));
        let second = listeners.add();
        listeners.tell(&batch(2));
        listeners.end();
        let numbers = |events: Events| events.flat_map(|batch| batch.too_late).collect::<Vec<_>>();
        assert_eq!((numbers(first), numbers(second)), (vec![1, 2], vec![2]));
        assert_eq!(listeners.add().within(Duration::ZERO), None, "the node has ended");
    }

    #[test]
    fn who_listens_when_the_node_ends_already_is_told_so_at_once() {
        let listeners = Listeners::default();
        let before = listeners.add();
        listeners.begin_end();
        let after = listeners.add();
        listeners.tell(&Batch { is_ending: true, ..batch(1) });
        listeners.end();
        for events in [before, after] {
            let told: Vec<_> = events.map(|it| (it.is_ending, it.too_late)).collect();
            assert_eq!(told, [(true, vec![]), (true, vec![1])]);
        }
    }

    #[test]
    fn nothing_is_kept_when_nobody_listens_any_more_and_no_event_is_an_empty_batch() {
        let listeners = Listeners::default();
        let events = listeners.add();
        assert!(listeners.are_there());
        assert_eq!(events.within(Duration::ZERO), Some(Batch::default()));
        drop(events);
        assert!(!listeners.are_there());
    }
}
