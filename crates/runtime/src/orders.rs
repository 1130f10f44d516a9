//! Orders on their way: made and checked in the ordinary thread, applied at the start of a cycle, and
//! freed in the ordinary thread again.

use isochrone_cyclic::Release;
use isochrone_engine::TaskEngine;
use isochrone_engine::operate::{Ended, Inbox, MAX_FORCES, Order, Replacement};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::events::{Events, Watch};
use crate::snapshots::Tap;

/// Orders that write and may be on their way to a task, and as many that read: who schedules values
/// ahead keeps nobody from looking.
const ROOM: usize = 64;
/// What comes back at most, until the ordinary thread has looked: all orders, and all forces that may
/// end by themselves, each of which may have taken the place of another.
const ROOM_BACK: usize = 2 * ROOM + 2 * MAX_FORCES;

/// What a cycle is given.
enum Given {
    Order(Box<Order>),
    Changeover(Box<Changeover>),
}

/// Another configuration for a task, with what its cycle tells of it.
pub(crate) struct Changeover {
    pub(crate) replacement: Replacement,
    pub(crate) tap: Tap,
    pub(crate) watch: Watch,
}

/// What a cycle gives back.
pub(crate) enum Returned {
    /// The task has another configuration; the one before is in the box.
    Changed(Box<Changeover>),
    /// An order that it is done with.
    Order(Box<Order>),
    /// A force that came to its end, and the first cycle without it.
    Ended(Ended, u64),
}

/// The end in the cycle.
pub(crate) struct Applier {
    new: Consumer<Given>,
    back: Producer<Returned>,
    inbox: Inbox,
    /// There is one at a time.
    changeover: Option<Box<Changeover>>,
}

/// The end in the ordinary thread.
pub(crate) struct Sender {
    new: Producer<Given>,
    back: Consumer<Returned>,
    writing: usize,
    reading: usize,
}

/// Makes both ends for a task.
pub(crate) fn ends() -> (Applier, Sender) {
    let (send, new) = RingBuffer::new(2 * ROOM);
    let (back, receive) = RingBuffer::new(ROOM_BACK);
    let applier = Applier { new, back, inbox: Inbox::new(ROOM), changeover: None };
    (applier, Sender { new: send, back: receive, writing: 0, reading: 0 })
}

impl Applier {
    /// Takes what was sent, and puts another configuration in its place whose cycle has come; before
    /// [`apply`](Self::apply). Frees nothing.
    #[inline]
    pub(crate) fn change(
        &mut self,
        engine: &mut TaskEngine,
        tap: &mut Tap,
        events: &mut Events,
        release: &Release,
    ) {
        self.receive();
        let is_due =
            |changeover: &mut Box<Changeover>| release.cycle >= changeover.replacement.at();
        if let Some(mut changeover) = self.changeover.take_if(is_due) {
            engine.replace(&mut changeover.replacement, release.cycle);
            tap.change(&mut changeover.tap);
            events.change(&mut changeover.watch);
            let _ = self.back.push(Returned::Changed(changeover));
        }
    }

    /// Whether one of these inputs is given a value for `cycle`. While nothing was sent, it is one look
    /// at the ring.
    pub(crate) fn gives(&mut self, cycle: u64, inputs: &[usize]) -> bool {
        self.receive();
        self.inbox.gives(cycle, inputs)
    }

    /// Copies what another configuration takes over that is due with the next cycle; for the end of
    /// the slack.
    #[inline]
    pub(crate) fn prepare(&mut self, engine: &mut TaskEngine, release: &Release) {
        let due = self.changeover.as_mut().map(|changeover| &mut changeover.replacement);
        if let Some(replacement) = due.filter(|due| release.cycle + 1 >= due.at()) {
            engine.hand_over(replacement);
        }
    }

    #[inline]
    fn receive(&mut self) {
        while let Ok(given) = self.new.pop() {
            match given {
                Given::Order(order) => drop(self.inbox.take(order)),
                Given::Changeover(changeover) => self.changeover = Some(changeover),
            }
        }
    }

    /// Ends the forces whose time has come, and applies what was sent for this cycle. Frees nothing;
    /// while nothing was sent or is forced, it is one look at the ring.
    #[inline]
    pub(crate) fn apply(&mut self, engine: &mut TaskEngine, release: &Release) {
        self.receive();
        let Self { back, inbox, .. } = self;
        // There is always room to give something back: no more is on its way than the ring holds.
        engine.expire(release.cycle, |ended| {
            let _ = back.push(Returned::Ended(ended, release.cycle));
        });
        inbox.apply(engine, release.cycle, release.start_ns, |order| {
            let _ = back.push(Returned::Order(order));
        });
    }

    /// Copies the values that were asked for, when the blocks have stepped; for the slack.
    #[inline]
    pub(crate) fn read(&mut self, engine: &TaskEngine, cycle: u64) {
        let Self { back, inbox, .. } = self;
        inbox.read(engine, cycle, |order| {
            let _ = back.push(Returned::Order(order));
        });
    }

    /// As [`read`](Self::read) long after the last cycle that ran, also for what was sent since.
    pub(crate) fn read_between(&mut self, engine: &TaskEngine, last_cycle: u64) {
        self.receive();
        self.read(engine, last_cycle);
    }
}

impl Sender {
    /// Whether another order that writes may be sent.
    pub(crate) fn has_room(&self) -> bool {
        self.writing < ROOM
    }

    /// Whether another order that reads may be sent.
    pub(crate) fn has_room_to_read(&self) -> bool {
        self.reading < ROOM
    }

    /// Sends an order, for which there is room.
    pub(crate) fn send(&mut self, order: Box<Order>) {
        self.give(Given::Order(order));
    }

    /// Sends another configuration, for which there is room; the next when it has come back.
    pub(crate) fn send_change(&mut self, changeover: Box<Changeover>) {
        self.give(Given::Changeover(changeover));
    }

    fn give(&mut self, given: Given) {
        let on_their_way = match &given {
            Given::Order(order) if order.is_reading() => &mut self.reading,
            Given::Order(_) | Given::Changeover(_) => &mut self.writing,
        };
        if self.new.push(given).is_ok() {
            *on_their_way += 1;
        }
    }

    /// The next thing that came back.
    pub(crate) fn returned(&mut self) -> Option<Returned> {
        let returned = self.back.pop().ok()?;
        match &returned {
            Returned::Order(order) if order.is_reading() => self.reading -= 1,
            Returned::Order(_) | Returned::Changed(_) => self.writing -= 1,
            Returned::Ended(..) => {}
        }
        Some(returned)
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::operate::{Feeds, Operator, OrderState, Request};
    use isochrone_engine::{Plan, Rules, Source};

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
        let (release_ns, start_ns) = (cycle, cycle);
        Release { cycle, release_ns, start_ns, missed: 0, newly_missed: 0, follow: None }
    }

    fn set(operator: &mut Operator, at: Option<u64>) -> Box<Order> {
        let request = Request { at, ..Request::default() };
        let prepared = operator.set([("ramp.value", 3.0.into())], request, &[0]).unwrap();
        operator.send(prepared).1.remove(0).1
    }

    fn returned(sender: &mut Sender) -> Option<OrderState> {
        sender.returned().map(|returned| match returned {
            Returned::Order(order) => order.state(),
            Returned::Ended(..) | Returned::Changed(_) => panic!("nothing else was sent"),
        })
    }

    #[test]
    fn an_order_is_applied_in_the_cycle_that_it_names_and_comes_back() {
        let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
        let mut operator = Operator::new(&plan, Feeds::Program);
        let (mut applier, mut sender) = ends();
        sender.send(set(&mut operator, Some(43)));
        sender.send(set(&mut operator, None));
        assert_eq!(returned(&mut sender), None);
        applier.apply(&mut engine, &release(41));
        assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 41 }));
        applier.apply(&mut engine, &release(42));
        assert_eq!(returned(&mut sender), None);
        // The cycle was missed.
        applier.apply(&mut engine, &release(44));
        assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 44 }));
        sender.send(set(&mut operator, Some(44)));
        applier.apply(&mut engine, &release(45));
        assert_eq!(returned(&mut sender), Some(OrderState::TooLate));
    }

    #[test]
    fn what_is_sent_between_two_cycles_is_read_there_and_applied_in_the_next() {
        let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
        let mut operator = Operator::new(&plan, Feeds::Program);
        let (mut applier, mut sender) = ends();
        engine.step(7);
        sender.send(set(&mut operator, None));
        let reading = operator.get(["ramp.value"], 0, 1).unwrap().0;
        sender.send(operator.send(reading).1.remove(0).1);
        applier.read_between(&engine, 7);
        assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 7 }));
        assert_eq!(returned(&mut sender), None, "nothing is changed between two cycles");
        applier.apply(&mut engine, &release(8));
        assert_eq!(returned(&mut sender), Some(OrderState::Applied { cycle: 8 }));
    }

    #[test]
    fn a_cycle_that_stands_still_is_sent_no_more_than_it_can_give_back() {
        let plan = Plan::new(Source::new("n.toml", CONFIGURATION), &Rules::default()).unwrap();
        let mut engine = TaskEngine::build(&plan).unwrap().pop().unwrap();
        let mut operator = Operator::new(&plan, Feeds::Program);
        let (mut applier, mut sender) = ends();
        while sender.has_room() {
            sender.send(set(&mut operator, None));
        }
        while sender.has_room_to_read() {
            let reading = operator.get(["ramp.value"], 0, 1).unwrap().0;
            sender.send(operator.send(reading).1.remove(0).1);
        }
        applier.apply(&mut engine, &release(0));
        applier.read(&engine, 0);
        assert!(!sender.has_room() && !sender.has_room_to_read(), "they have not come back yet");
        assert_eq!(std::iter::from_fn(|| returned(&mut sender)).count(), 2 * ROOM);
        assert!(sender.has_room() && sender.has_room_to_read());
    }
}
