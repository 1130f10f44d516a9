//! Orders to a task: made and checked in the ordinary thread, applied at the start of a cycle, and freed in the
//! ordinary thread.

use isochrone_cyclic::Release;
use isochrone_engine::TaskEngine;
use isochrone_engine::orders::{EndedForce, Inbox, MAX_FORCES, Order, Replacement};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::keeping::recorder::Recorder;
use crate::task::alarms::{AlarmSender, NewAlarms};
use crate::task::events::{EventSender, Watch};
use crate::task::records::Cycle;
use crate::task::retained::Copier;
use crate::task::snapshots::Tap;
use crate::task::traces::{MAX_TRACES, NewSlots, Tracer, Traces};

/// How many orders that write may be under way to a task, and how many that read: a client that schedules values
/// ahead does not keep others from reading.
const ROOM: usize = 64;
/// How many releases have room besides: a client that fills the queue does not keep others from ending a force.
const ROOM_TO_RELEASE: usize = 8;
/// Orders of both kinds.
const ORDERS: usize = 2 * ROOM + ROOM_TO_RELEASE;
/// The most commands under way: those orders, the beginning and end of each trace, and the beginning of a recording.
const ROOM_THERE: usize = ORDERS + 2 * MAX_TRACES + 1;
/// The most that may come back before the ordinary thread looks: all orders and traces, and all forces that may end
/// by themselves, each of which may have replaced another.
const ROOM_BACK: usize = ORDERS + MAX_TRACES + 2 * MAX_FORCES;

/// A command to the cycle.
enum CycleCommand {
    Order(Box<Order>),
    Changeover(Box<Changeover>),
    Trace(Box<Tracer>),
    /// Ends the trace of this number.
    EndOfTrace(u64),
    Recorder(Box<Recorder>),
}

/// A new configuration for a task, with the channels that belong to it.
pub(crate) struct Changeover {
    pub(crate) replacement: Replacement,
    pub(crate) tap: Tap,
    pub(crate) watch: Watch,
    pub(crate) alarms: NewAlarms,
    pub(crate) traces: NewSlots,
    /// Where the node is recorded.
    pub(crate) recorder: Option<Box<Recorder>>,
    /// Where the node retains its state.
    pub(crate) copier: Option<Box<Copier>>,
}

/// What a cycle returns.
pub(crate) enum Returned {
    /// The task has a new configuration; the box holds the old one.
    Changed(Box<Changeover>),
    /// An order that was carried out.
    Order(Box<Order>),
    /// A force that ended by itself, and the first cycle without it.
    Ended(EndedForce, u64),
    /// A trace that has ended.
    Trace(Box<Tracer>),
}

/// The cycle's end.
pub(crate) struct Applier {
    new: Consumer<CycleCommand>,
    back: Producer<Returned>,
    inbox: Inbox,
    /// There is one at a time.
    changeover: Option<Box<Changeover>>,
    traces: Traces,
    recorder: Option<Box<Recorder>>,
}

/// The ordinary thread's end.
pub(crate) struct Sender {
    new: Producer<CycleCommand>,
    back: Consumer<Returned>,
    writing: usize,
    reading: usize,
}

/// Makes both ends for a task.
pub(crate) fn ends() -> (Applier, Sender) {
    let (send, new) = RingBuffer::new(ROOM_THERE);
    let (back, receive) = RingBuffer::new(ROOM_BACK);
    let (inbox, traces) = (Inbox::new(ROOM + ROOM_TO_RELEASE), Traces::default());
    let applier = Applier { new, back, inbox, changeover: None, traces, recorder: None };
    (applier, Sender { new: send, back: receive, writing: 0, reading: 0 })
}

impl Applier {
    /// Takes in commands, and puts a new configuration into effect if its cycle has come; call it before
    /// [`apply`](Self::apply). Frees nothing.
    #[inline]
    pub(crate) fn change(
        &mut self,
        engine: &mut TaskEngine,
        tap: &mut Tap,
        events: &mut EventSender,
        alarms: &mut AlarmSender,
        copier: &mut Option<Box<Copier>>,
        release: &Release,
    ) {
        self.receive();
        let is_due =
            |changeover: &mut Box<Changeover>| release.cycle >= changeover.replacement.at();
        if let Some(mut changeover) = self.changeover.take_if(is_due) {
            engine.replace(&mut changeover.replacement, release.cycle);
            tap.change(&mut changeover.tap);
            events.change(&mut changeover.watch);
            alarms.change(&mut changeover.alarms);
            if let (Some(copier), Some(new)) = (copier, &mut changeover.copier) {
                copier.change(new);
            }
            std::mem::swap(&mut self.recorder, &mut changeover.recorder);
            let Self { back, traces, .. } = self;
            traces.change(&mut changeover.traces, |ended| {
                let _ = back.push(Returned::Trace(ended));
            });
            let _ = self.back.push(Returned::Changed(changeover));
        }
    }

    /// Whether one of these inputs is given a value for `cycle`. While nothing was sent, this costs one look at the
    /// ring.
    pub(crate) fn gives(&mut self, cycle: u64, inputs: &[usize]) -> bool {
        self.receive();
        self.inbox.gives(cycle, inputs)
    }

    /// Copies the state that a new configuration takes over, if it is due with the next cycle; for the end of the
    /// slack.
    #[inline]
    pub(crate) fn prepare(&mut self, engine: &mut TaskEngine, release: &Release) {
        let due = self.changeover.as_mut().map(|changeover| &mut changeover.replacement);
        if let Some(replacement) = due.filter(|due| release.cycle + 1 >= due.at()) {
            engine.hand_over(replacement);
        }
    }

    /// Takes in what was sent.
    #[inline]
    pub(crate) fn receive(&mut self) {
        while let Ok(given) = self.new.pop() {
            match given {
                CycleCommand::Order(order) => drop(self.inbox.take(order)),
                CycleCommand::Changeover(changeover) => self.changeover = Some(changeover),
                CycleCommand::Trace(tracer) => {
                    let refused = self.traces.arm(tracer);
                    self.give_back(refused);
                }
                // It arrives before the first cycle, and replaces none.
                CycleCommand::Recorder(recorder) => self.recorder = Some(recorder),
                CycleCommand::EndOfTrace(number) => {
                    let ended = self.traces.disarm(number);
                    self.give_back(ended);
                }
            }
        }
    }

    #[inline]
    fn give_back(&mut self, tracer: Option<Box<Tracer>>) {
        if let Some(tracer) = tracer {
            let _ = self.back.push(Returned::Trace(tracer));
        }
    }

    /// Copies the traced and recorded values of a cycle after the blocks have stepped; for the slack.
    #[inline]
    pub(crate) fn capture(&mut self, engine: &TaskEngine, cycle: &Cycle) {
        self.traces.take(engine.image(), cycle);
        if let Some(recorder) = &mut self.recorder {
            recorder.take(engine, cycle);
        }
    }

    /// Ends the forces whose time is up, and applies the orders for this cycle. Frees nothing; while nothing was sent
    /// or is forced, this costs one look at the ring.
    #[inline]
    pub(crate) fn apply(&mut self, engine: &mut TaskEngine, release: &Release) {
        self.receive();
        self.apply_received(engine, release);
    }

    /// As [`apply`](Self::apply), of what was [received](Self::receive) before.
    #[inline]
    pub(crate) fn apply_received(&mut self, engine: &mut TaskEngine, release: &Release) {
        let Self { back, inbox, .. } = self;
        // There is always room to return something: no more is under way than the ring holds.
        engine.expire(release.cycle, |ended| {
            let _ = back.push(Returned::Ended(ended, release.cycle));
        });
        inbox.apply(engine, release.cycle, release.start_ns, |order| {
            let _ = back.push(Returned::Order(order));
        });
    }

    /// Copies the values that were requested after the blocks have stepped; for the slack.
    #[inline]
    pub(crate) fn read(&mut self, engine: &TaskEngine, cycle: u64) {
        let Self { back, inbox, .. } = self;
        inbox.read(engine, cycle, |order| {
            let _ = back.push(Returned::Order(order));
        });
    }

    /// As [`read`](Self::read), long after the last cycle that ran, and also for orders sent since.
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

    /// Whether another order that releases forces may be sent.
    pub(crate) fn has_room_to_release(&self) -> bool {
        self.writing < ROOM + ROOM_TO_RELEASE
    }

    /// Whether another order that reads may be sent.
    pub(crate) fn has_room_to_read(&self) -> bool {
        self.reading < ROOM
    }

    /// Whether an order or a new configuration has not come back yet.
    pub(crate) fn is_under_way(&self) -> bool {
        self.writing + self.reading > 0
    }

    /// Sends an order, for which there is room.
    pub(crate) fn send(&mut self, order: Box<Order>) {
        self.give(CycleCommand::Order(order));
    }

    /// Sends a new configuration, for which there is room. Send the next after it has come back.
    pub(crate) fn send_change(&mut self, changeover: Box<Changeover>) {
        self.give(CycleCommand::Changeover(changeover));
    }

    /// Begins a trace. There is room for as many as a task has.
    pub(crate) fn begin_trace(&mut self, tracer: Box<Tracer>) {
        let _ = self.new.push(CycleCommand::Trace(tracer));
    }

    /// Records from the first cycle on; before the start.
    pub(crate) fn record(&mut self, recorder: Box<Recorder>) {
        let _ = self.new.push(CycleCommand::Recorder(recorder));
    }

    /// Ends a trace, once.
    pub(crate) fn end_trace(&mut self, number: u64) {
        let _ = self.new.push(CycleCommand::EndOfTrace(number));
    }

    fn give(&mut self, given: CycleCommand) {
        let on_their_way = match &given {
            CycleCommand::Order(order) if order.is_reading() => &mut self.reading,
            _ => &mut self.writing,
        };
        if self.new.push(given).is_ok() {
            *on_their_way += 1;
        }
    }

    /// The next thing that was returned.
    pub(crate) fn returned(&mut self) -> Option<Returned> {
        let returned = self.back.pop().ok()?;
        match &returned {
            Returned::Order(order) if order.is_reading() => self.reading -= 1,
            Returned::Order(_) | Returned::Changed(_) => self.writing -= 1,
            Returned::Ended(..) | Returned::Trace(_) => {}
        }
        Some(returned)
    }
}

#[cfg(test)]
#[path = "orders_tests.rs"]
mod tests;
