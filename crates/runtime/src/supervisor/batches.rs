//! What happens in a node, for the programs that ask for it.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use isochrone_control::desk::{OrderOutcome, Reading};
use isochrone_model::Entry;
use isochrone_timing::{CycleRecord, FollowRecord};

use crate::operating::RequestOutcome;

/// How long a batch is kept for a program that does not take it.
const KEPT: Duration = Duration::from_secs(1);

/// What happened in a node since the batch before, in the order in which it came.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Batch {
    /// The cycles that ended.
    pub cycles: Vec<CycleEvent>,
    /// What requests changed, those of other programs included: an entry for each task of a request, and what
    /// ended by itself.
    pub applied: Vec<Entry>,
    /// The transactions among [`applied`](Self::applied) whose entries are not in the file of the journal,
    /// as it cannot be written: they are written as soon as it can be, and a node that is killed before loses
    /// them.
    pub unwritten: Vec<u64>,
    /// Requests that came too late for the cycle that they named, or whose forces were released before it, those
    /// of other programs included. Nothing happened.
    pub too_late: Vec<u64>,
    /// Values that [`Running::get`](crate::Running::get) asked for.
    pub readings: Vec<Reading>,
    /// Whether the node ends or has ended: it was asked to, or one of its tasks has ended.
    pub is_ending: bool,
    /// How much of all this was lost before this batch, because it was not taken within a second: cycles,
    /// entries, numbers and readings.
    pub lost: u64,
}

/// A cycle that ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CycleEvent {
    /// The task, by its place in the plan.
    pub task: usize,
    /// When it ran.
    pub record: CycleRecord,
    /// What that leaves out, of a task that follows its data; `None` for others.
    pub follow: Option<FollowRecord>,
}

impl Batch {
    /// Adds what has come back of a request.
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

    /// Nothing but that the node ends.
    fn of_end() -> Self {
        Self { is_ending: true, ..Self::default() }
    }

    /// Whether nothing happened.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn len(&self) -> u64 {
        let Self { cycles, applied, too_late, readings, .. } = self;
        (cycles.len() + applied.len() + too_late.len() + readings.len()) as u64
    }
}

/// What happens in a node from the call of [`Running::events`](crate::Running::events) on. As an iterator it waits
/// for each [`Batch`], and ends with the node.
///
/// There is a batch some sixty times a second. One that is not taken within a second is lost, and what it held is
/// counted in the next: a program that stops taking holds up nothing, and fills no memory.
#[derive(Debug)]
pub struct Events(Arc<Queue>);

#[derive(Debug, Default)]
struct Queue {
    waiting: Mutex<Waiting>,
    has_more: Condvar,
}

/// The batches of one receiver.
#[derive(Debug, Default)]
struct Waiting {
    batches: VecDeque<(Instant, Batch)>,
    lost: u64,
    is_over: bool,
}

impl Events {
    /// The next batch, for which it waits so long; an empty one when nothing came. `None`: the node has ended, and
    /// everything was taken.
    pub fn within(&self, time: Duration) -> Option<Batch> {
        let is_empty = |waiting: &mut Waiting| waiting.batches.is_empty() && !waiting.is_over;
        let waited = self.0.has_more.wait_timeout_while(self.0.lock(), time, is_empty);
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        waiting.take().or_else(|| Some(Batch::default()).filter(|_| !waiting.is_over))
    }
}

impl Iterator for Events {
    type Item = Batch;

    fn next(&mut self) -> Option<Batch> {
        let is_empty = |waiting: &mut Waiting| waiting.batches.is_empty() && !waiting.is_over;
        let waited = self.0.has_more.wait_while(self.0.lock(), is_empty);
        waited.unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
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

/// Those who asked for the events of a node. Nothing is kept while there is nobody.
#[derive(Debug, Clone, Default)]
pub(super) struct Listeners(Arc<Mutex<Listening>>);

#[derive(Debug, Default)]
struct Listening {
    queues: Vec<Weak<Queue>>,
    is_ending: bool,
    is_over: bool,
}

impl Listeners {
    /// Another one.
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

    /// Whether somebody listens.
    pub(super) fn are_there(&self) -> bool {
        let mut listening = self.lock();
        listening.queues.retain(|queue| queue.strong_count() > 0);
        !listening.queues.is_empty()
    }

    /// Gives everybody what happened.
    pub(super) fn tell(&self, batch: &Batch) {
        self.lock().tell(batch);
    }

    /// The node begins to end, which everybody is told, and whoever listens from now on.
    pub(super) fn begin_end(&self) {
        let mut listening = self.lock();
        listening.is_ending = true;
        listening.tell(&Batch::of_end());
    }

    /// Nothing happens any more.
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
        let (mut waiting, begin) = (Waiting::default(), Instant::now());
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
