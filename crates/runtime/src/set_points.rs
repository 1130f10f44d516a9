//! Set-points: made and checked in the ordinary thread, applied at the start of a cycle, and freed in
//! the ordinary thread again.

use isochrone_cyclic::Release;
use isochrone_engine::TaskEngine;
use rtrb::{Consumer, Producer, RingBuffer};

/// Transactions that may be on their way to a task.
const ROOM: usize = 64;

/// Writes that one task applies at the start of one cycle.
#[derive(Debug)]
pub(crate) struct Transaction {
    pub(crate) number: u64,
    /// Slots and values.
    pub(crate) writes: Box<[(usize, f64)]>,
    /// In which cycle it was applied, once it was.
    pub(crate) cycle: u64,
}

/// The end in the cycle.
pub(crate) struct Applier {
    new: Consumer<Box<Transaction>>,
    done: Producer<Box<Transaction>>,
}

/// The end in the ordinary thread.
pub(crate) struct Sender {
    new: Producer<Box<Transaction>>,
    done: Consumer<Box<Transaction>>,
    on_their_way: usize,
}

/// Makes both ends for a task.
pub(crate) fn ends() -> (Applier, Sender) {
    let (send, new) = RingBuffer::new(ROOM);
    let (done, receive) = RingBuffer::new(ROOM);
    (Applier { new, done }, Sender { new: send, done: receive, on_their_way: 0 })
}

impl Applier {
    /// Applies what was sent. Frees nothing; while nothing was sent, it is one look at the ring.
    #[inline]
    pub(crate) fn apply(&mut self, engine: &mut TaskEngine, release: &Release) {
        while let Ok(mut transaction) = self.new.pop() {
            for (slot, value) in &transaction.writes {
                engine.set(*slot, *value, release.start_ns);
            }
            transaction.cycle = release.cycle;
            // There is always room: no more are on their way than the ring holds.
            let _ = self.done.push(transaction);
        }
    }
}

impl Sender {
    /// Whether another transaction may be sent.
    pub(crate) fn has_room(&self) -> bool {
        self.on_their_way < ROOM
    }

    /// Sends a transaction, for which there is room.
    pub(crate) fn send(&mut self, transaction: Transaction) {
        if self.new.push(Box::new(transaction)).is_ok() {
            self.on_their_way += 1;
        }
    }

    /// The next one that was applied; number and cycle.
    pub(crate) fn applied(&mut self) -> Option<(u64, u64)> {
        let done = self.done.pop().ok()?;
        self.on_their_way -= 1;
        Some((done.number, done.cycle))
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Pins, Plan, Rules, Source};

    use super::*;

    const CONFIGURATION: &str = r#"
        [node]
        name = "n"
        [[task]]
        name = "t"
        period = "100ms"
        [[block]]
        name = "ramp"
        type = "LimRateOfChangeCI"
        in = { value = 25.0, setChangeRate = 10.0 }
    "#;

    fn release(cycle: u64) -> Release {
        Release { cycle, release_ns: cycle, start_ns: cycle, missed: 0, newly_missed: 0 }
    }

    #[test]
    fn a_transaction_is_applied_in_the_cycle_that_it_names_and_comes_back() {
        let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
        let (mut applier, mut sender) = ends();
        let slot = Pins::of(&plan).find("ramp.value", 3.0).unwrap().slot;
        sender.send(Transaction { number: 7, writes: [(slot, 3.0)].into(), cycle: 0 });
        assert_eq!(sender.applied(), None);
        applier.apply(&mut engine, &release(41));
        assert_eq!(engine.image()[slot], 3.0);
        assert_eq!(sender.applied(), Some((7, 41)));
        assert_eq!(sender.applied(), None);
    }

    #[test]
    fn a_cycle_that_stands_still_is_sent_no_more_than_it_can_give_back() {
        let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
        let (mut applier, mut sender) = ends();
        let mut number = 0;
        while sender.has_room() {
            sender.send(Transaction { number, writes: [].into(), cycle: 0 });
            number += 1;
        }
        applier.apply(&mut engine, &release(0));
        assert!(!sender.has_room(), "they have not come back yet");
        assert_eq!(std::iter::from_fn(|| sender.applied()).count(), ROOM);
        assert!(sender.has_room());
    }
}
