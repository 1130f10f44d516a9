//! What a task's blocks and inputs run into: noticed in the slack of the cycle, and logged in the
//! ordinary thread.

use std::collections::BTreeSet;
use std::sync::Arc;

use isochrone_blocks::{Indication, status};
use isochrone_engine::{TaskEngine, TaskPlan};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::freshness::InputState;
use crate::limiter::{Allowed, Limiter};
use crate::words::{ERROR_WITHOUT_WORD, Said, Words};

/// Events that fit between the cycle and the ordinary thread. What finds no room is told later, if it
/// still holds then.
const ROOM: usize = 256;

/// What is to be said of a block or an input.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Event {
    /// An instance, in the order of the image, has this error since a cycle; `OK` for none.
    Block { instance: usize, status: u16, cycle: u64 },
    /// An input came into this state in a cycle.
    Input { input: usize, state: InputState, cycle: u64 },
}

/// The end in the cycle.
pub(crate) struct Events {
    ring: Producer<Event>,
    watched: Box<[Watched]>,
    errors: u64,
    in_error: bool,
}

/// An instance that can report errors.
struct Watched {
    instance: usize,
    slot: usize,
    indication: Indication,
    told: u16,
}

impl Watched {
    fn error(&self, image: &[f64]) -> u16 {
        let value = image.get(self.slot).copied().unwrap_or_default();
        if self.indication.is_error(value) {
            self.indication.status_word(value).unwrap_or(ERROR_WITHOUT_WORD)
        } else {
            status::OK
        }
    }
}

impl Events {
    /// Looks for blocks that came into an error or out of one; for the slack. While no block reports
    /// an error, it is a comparison.
    pub(crate) fn look(&mut self, engine: &TaskEngine, cycle: u64) {
        let errors = engine.block_errors();
        if errors == std::mem::replace(&mut self.errors, errors) && !self.in_error {
            return;
        }
        self.in_error = false;
        for watched in &mut self.watched {
            let error = watched.error(engine.image());
            let event = Event::Block { instance: watched.instance, status: error, cycle };
            if error != watched.told && self.ring.push(event).is_ok() {
                watched.told = error;
            }
            self.in_error |= watched.told != status::OK || error != watched.told;
        }
    }

    /// Tells what has become of an input; `false` where there is no room.
    pub(crate) fn tell_input(&mut self, input: usize, state: InputState, cycle: u64) -> bool {
        self.ring.push(Event::Input { input, state, cycle }).is_ok()
    }
}

/// The end in the ordinary thread.
pub(crate) struct Log {
    ring: Consumer<Event>,
    words: Arc<Words>,
    /// Of each input, whether something was said of its samples before.
    is_known: Box<[bool]>,
    /// What happened since it was last asked for.
    happened: Vec<Event>,
    /// One for each instance and then for each input, so that none that changes all the time keeps
    /// the others from being heard.
    limiters: Vec<Limiter<Event>>,
    /// Those of the limiters that hold an event.
    holding: BTreeSet<usize>,
}

/// Makes both ends for a task.
pub(crate) fn ends(task: &TaskPlan) -> (Events, Log) {
    let (producer, consumer) = RingBuffer::new(ROOM);
    let mut watched = Vec::new();
    let mut first = 0;
    for bank in &task.banks {
        if let Some(indication) = bank.block_type.indication() {
            let slot = bank.first_slot + indication.place();
            watched.extend((0..bank.instances.len()).map(|index| Watched {
                instance: first + index,
                slot: slot + index * bank.block_type.slots(),
                indication,
                told: status::OK,
            }));
        }
        first += bank.instances.len();
    }
    let events = Events { ring: producer, watched: watched.into(), errors: 0, in_error: false };
    let log = Log {
        limiters: std::iter::repeat_with(Limiter::default)
            .take(first + task.inputs.len())
            .collect(),
        holding: BTreeSet::new(),
        ring: consumer,
        words: Arc::new(Words::of(task)),
        is_known: vec![false; task.inputs.len()].into(),
        happened: Vec::new(),
    };
    (events, log)
}

impl Log {
    /// Logs what happened since the last time.
    pub(crate) fn write(&mut self) {
        while let Ok(event) = self.ring.pop() {
            self.happened.push(event);
            let speaker = self.words.speaker(&event);
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

    /// As [`write`](Self::write), and what became of each in the end, though its pause is not over.
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
            *is_known |= !matches!(state, InputState::Waiting);
        }
        self.words.sentence(&event, Said::of(was_known))
    }

    /// How what is logged here is put.
    pub(crate) fn words(&self) -> Arc<Words> {
        Arc::clone(&self.words)
    }

    /// What happened since the last time, in its order.
    pub(crate) fn happened(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.happened)
    }
}
