//! Events of a task's blocks and inputs: detected in the slack of the cycle, and logged in the ordinary thread.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use isochrone_blocks::{BlockType, Indication, status};
use isochrone_engine::{TaskEngine, TaskPlan};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::node::event::Event;
use crate::task::freshness::InputState;
use crate::task::limiter::{Allowed, Limiter};
use crate::task::messages::{
    CAUTION, ERROR_WITHOUT_WORD, LoggedBefore, Messages, Moved, is_watched,
};

/// How many events may wait for the ordinary thread. An event that finds no room is sent later, if it still holds
/// then.
const ROOM: usize = 256;

/// The cycle's end.
pub(crate) struct EventSender {
    ring: Producer<Event>,
    watched: Box<[WatchedInstance]>,
    /// The next instance to look at among those that may need a caution.
    next_cautioned: usize,
    /// Indices of these instances in `watched`.
    cautioned: Box<[usize]>,
    errors: u64,
    in_error: bool,
    /// Another configuration is in place, and that event has not been sent yet.
    has_changed: bool,
}

/// The watched instances of another configuration, and which of them had a reported error before.
#[derive(Debug)]
pub(crate) struct Watch {
    watched: Box<[WatchedInstance]>,
    cautioned: Box<[usize]>,
    /// Places among those that were watched, and among these.
    kept: Box<[(usize, usize)]>,
}

impl Watch {
    /// The instances of a task that come after others.
    pub(crate) fn following(task: &TaskPlan, old: &Messages, moved: &Moved) -> Self {
        let watched = watched(task);
        let of_instance = |(place, watched): (usize, &WatchedInstance)| (watched.instance, place);
        let places: HashMap<_, _> = watched.iter().enumerate().map(of_instance).collect();
        let kept = old
            .watched()
            .enumerate()
            .filter_map(|(place, instance)| Some((place, *places.get(&moved.place(instance)?)?)));
        Self { kept: kept.collect(), cautioned: cautioned(&watched), watched }
    }
}

/// An instance that can report errors, or need a caution.
#[derive(Debug)]
struct WatchedInstance {
    instance: usize,
    first_slot: usize,
    indication: Option<Indication>,
    block_type: Arc<BlockType>,
    reported: u16,
}

impl WatchedInstance {
    /// Its error, from one slot.
    fn error(&self, image: &[f64]) -> u16 {
        let error = self.indication.and_then(|indication| {
            let value =
                image.get(self.first_slot + indication.place()).copied().unwrap_or_default();
            let word = || indication.status_word(value).unwrap_or(ERROR_WITHOUT_WORD);
            indication.is_error(value).then(word)
        });
        error.unwrap_or(status::OK)
    }

    /// Its error, or whether it needs a caution, from all its slots.
    fn state(&self, image: &[f64]) -> u16 {
        let last = self.first_slot + self.block_type.slots();
        let slots = image.get(self.first_slot..last).unwrap_or_default();
        match self.error(image) {
            status::OK if self.block_type.needs_caution(slots) => CAUTION,
            error => error,
        }
    }

    fn outputs(&self) -> Range<usize> {
        let first = self.first_slot + self.block_type.inputs.len();
        first..self.first_slot + self.block_type.slots()
    }

    fn tell(&mut self, status: u16, cycle: u64, ring: &mut Producer<Event>) {
        let event = Event::Block { instance: self.instance, status, cycle };
        if status != self.reported && ring.push(event).is_ok() {
            self.reported = status;
        }
    }
}

impl EventSender {
    /// Looks for blocks whose error status has changed; for the slack. While no block reports an error, this costs
    /// one comparison, and a look at a few of the blocks that may need a caution.
    pub(crate) fn look(&mut self, engine: &TaskEngine, cycle: u64) {
        if !self.tells_change() {
            return;
        }
        let errors = engine.block_errors();
        let is_same = errors == std::mem::replace(&mut self.errors, errors);
        if !is_same || self.in_error {
            self.look_at_errors(engine.image(), cycle);
        }
        self.look_at_cautions(engine, cycle);
    }

    fn look_at_errors(&mut self, image: &[f64], cycle: u64) {
        self.in_error = false;
        for watched in &mut self.watched {
            let error = watched.error(image);
            // For a block that may need a caution, the end of an error is reported when its turn comes and all its
            // slots are looked at.
            if error != status::OK || watched.block_type.caution.is_none() {
                watched.tell(error, cycle, &mut self.ring);
                self.in_error |= error != status::OK || watched.reported != status::OK;
            }
        }
    }

    /// Looks at a few of the blocks that may need a caution, at others in each cycle: such states last, so this is
    /// not urgent.
    fn look_at_cautions(&mut self, engine: &TaskEngine, cycle: u64) {
        const LOOKED: usize = 8;
        let count = self.cautioned.len();
        for _ in 0..count.min(LOOKED) {
            self.next_cautioned = (self.next_cautioned + 1) % count;
            let place = self.cautioned.get(self.next_cautioned);
            if let Some(watched) = place.and_then(|place| self.watched.get_mut(*place)) {
                let state = watched.state(engine.image());
                // While the output of a block is forced, the end of its caution cannot be seen.
                let is_hidden = state == status::OK
                    && watched.reported == CAUTION
                    && engine.is_forced(&watched.outputs());
                if !is_hidden {
                    watched.tell(state, cycle, &mut self.ring);
                }
            }
        }
    }

    /// Sends the state of an input; `false` if there is no room.
    pub(crate) fn tell_input(&mut self, input: usize, state: InputState, cycle: u64) -> bool {
        self.tells_change() && self.ring.push(Event::Input { input, state, cycle }).is_ok()
    }

    /// Changes to the instances of another configuration, and leaves its own in their place.
    pub(crate) fn change(&mut self, watch: &mut Watch) {
        for (from, to) in &watch.kept {
            if let (Some(from), Some(to)) = (self.watched.get(*from), watch.watched.get_mut(*to)) {
                to.reported = from.reported;
            }
        }
        std::mem::swap(&mut self.watched, &mut watch.watched);
        std::mem::swap(&mut self.cautioned, &mut watch.cautioned);
        self.has_changed = true;
    }

    /// Whether a change of the configuration, if there was one, has been sent: later events would otherwise be taken
    /// for events of the configuration before.
    fn tells_change(&mut self) -> bool {
        self.has_changed = self.has_changed && self.ring.push(Event::Changed).is_err();
        !self.has_changed
    }
}

/// The ordinary thread's end.
pub(crate) struct Log {
    ring: Consumer<Event>,
    messages: Arc<Messages>,
    /// The messages of the configurations to come.
    next_messages: Receiver<Arc<Messages>>,
    /// For each input, whether a state of its samples was logged before.
    is_known: Box<[bool]>,
    /// The events since they were last taken.
    happened: Vec<Event>,
    /// One for each instance and then each input, so that one that changes all the time does not drown out the
    /// others.
    limiters: Vec<Limiter<Event>>,
    /// Those of the limiters that hold an event.
    holding: BTreeSet<usize>,
}

/// The instances of a task that can report errors, or need a caution.
fn watched(task: &TaskPlan) -> Box<[WatchedInstance]> {
    let mut watched = Vec::new();
    let mut first = 0;
    for bank in &task.banks {
        if is_watched(&bank.block_type) {
            let block_type = Arc::new(bank.block_type);
            watched.extend((0..bank.instances.len()).map(|index| WatchedInstance {
                instance: first + index,
                first_slot: bank.first_slot + index * bank.block_type.slots(),
                indication: bank.block_type.indication(),
                block_type: Arc::clone(&block_type),
                reported: status::OK,
            }));
        }
        first += bank.instances.len();
    }
    watched.into()
}

/// Places of those that may need a caution.
fn cautioned(watched: &[WatchedInstance]) -> Box<[usize]> {
    let watched = watched.iter().enumerate();
    watched.filter(|(_, it)| it.block_type.caution.is_some()).map(|(place, _)| place).collect()
}

/// Makes both ends for a task, and the sender for the messages of later configurations.
pub(crate) fn ends(task: &TaskPlan) -> (EventSender, Log, Sender<Arc<Messages>>) {
    let (producer, consumer) = RingBuffer::new(ROOM);
    let (send_messages, next_messages) = channel();
    let watched = watched(task);
    let events = EventSender {
        ring: producer,
        next_cautioned: 0,
        cautioned: cautioned(&watched),
        watched,
        errors: 0,
        in_error: false,
        has_changed: false,
    };
    let messages = Arc::new(Messages::of(task));
    let log = Log {
        limiters: limiters(&messages),
        holding: BTreeSet::new(),
        ring: consumer,
        messages,
        next_messages,
        is_known: vec![false; task.inputs.len()].into(),
        happened: Vec::new(),
    };
    (events, log, send_messages)
}

fn limiters(messages: &Messages) -> Vec<Limiter<Event>> {
    std::iter::repeat_with(Limiter::default).take(messages.speakers()).collect()
}

impl Log {
    /// Logs what happened since the last time.
    pub(crate) fn write(&mut self) {
        while let Ok(event) = self.ring.pop() {
            self.happened.push(event);
            if matches!(event, Event::Changed) {
                self.change();
            }
            let speaker = self.messages.speaker(&event);
            let Some(limiter) = self.limiters.get_mut(speaker) else { continue };
            match limiter.pass(event) {
                Some(allowed) => {
                    self.holding.remove(&speaker);
                    self.say(allowed);
                }
                None => {
                    self.holding.insert(speaker);
                }
            }
        }
        self.say_held(Limiter::held);
    }

    /// Changes to the blocks of another configuration.
    fn change(&mut self) {
        // Held messages are about the configuration before.
        self.say_held(Limiter::take_held);
        if let Ok(messages) = self.next_messages.try_recv() {
            (self.limiters, self.holding) = (limiters(&messages), BTreeSet::new());
            self.messages = messages;
        }
    }

    /// As [`write`](Self::write), and also writes messages that are still held back by a limiter.
    pub(crate) fn finish(&mut self) {
        self.write();
        self.say_held(Limiter::take_held);
    }

    fn say_held(&mut self, held: fn(&mut Limiter<Event>) -> Option<Allowed<Event>>) {
        for speaker in self.holding.clone() {
            if let Some(allowed) = self.limiters.get_mut(speaker).and_then(held) {
                self.holding.remove(&speaker);
                self.say(allowed);
            }
        }
    }

    fn say(&mut self, Allowed { message: event, left_out }: Allowed<Event>) {
        let Some(sentence) = self.sentence(event) else { return };
        let sentence = Allowed { message: sentence, left_out };
        match event {
            Event::Input { state: InputState::Good, .. }
            | Event::Block { status: status::OK, .. } => tracing::info!("{sentence}"),
            _ => tracing::warn!("{sentence}"),
        }
    }

    fn sentence(&mut self, event: Event) -> Option<String> {
        let mut was_known = false;
        if let Event::Input { input, state, .. } = event
            && let Some(is_known) = self.is_known.get_mut(input)
        {
            was_known = *is_known;
            *is_known |= !matches!(state, InputState::Waiting | InputState::Restored);
        }
        self.messages.sentence(&event, LoggedBefore::of(was_known))
    }

    /// The wording of what is logged here.
    pub(crate) fn messages(&self) -> Arc<Messages> {
        Arc::clone(&self.messages)
    }

    /// The events since the last call, in order.
    pub(crate) fn happened(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.happened)
    }
}
