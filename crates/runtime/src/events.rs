//! What a task's blocks and inputs run into: noticed in the slack of the cycle, and put into words in
//! the ordinary thread.

use std::collections::BTreeSet;
use std::sync::Arc;

use isochrone_blocks::{BlockType, Indication, PinType, status};
use isochrone_engine::config::OnStale;
use isochrone_engine::{TaskEngine, TaskPlan};
use rtrb::{Consumer, Producer, RingBuffer};

use crate::freshness::InputState;
use crate::limiter::{Allowed, Limiter};

/// Events that fit between the cycle and the ordinary thread. What finds no room is told later, if it
/// still holds then.
const ROOM: usize = 256;

#[derive(Debug, Clone, Copy)]
enum Event {
    /// An instance, in the order of the image, has this error; `OK` for none.
    Block { instance: usize, status: u16 },
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

/// Stands for a status word where a block has none.
const ERROR_WITHOUT_WORD: u16 = u16::MAX;

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
    pub(crate) fn look(&mut self, engine: &TaskEngine) {
        let errors = engine.block_errors();
        if errors == std::mem::replace(&mut self.errors, errors) && !self.in_error {
            return;
        }
        self.in_error = false;
        for watched in &mut self.watched {
            let error = watched.error(engine.image());
            let event = Event::Block { instance: watched.instance, status: error };
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
    banks: Vec<Bank>,
    inputs: Vec<InputWords>,
    /// One for each instance and then for each input, so that none that changes all the time keeps
    /// the others from being heard.
    limiters: Vec<Limiter<Event>>,
    instances: usize,
    /// Those of the limiters that hold an event.
    holding: BTreeSet<usize>,
}

struct Bank {
    block_type: BlockType,
    instances: Arc<[String]>,
}

struct InputWords {
    name: String,
    service: Option<String>,
    value_type: PinType,
    on_stale: OnStale,
    /// Something was said of its samples before.
    is_known: bool,
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
    let bank = |bank: &isochrone_engine::BankPlan| Bank {
        block_type: bank.block_type,
        instances: bank.instances.clone(),
    };
    let input = |input: &isochrone_engine::InputPlan| InputWords {
        name: input.name.clone(),
        service: input.service.clone(),
        value_type: input.value_type,
        on_stale: input.on_stale,
        is_known: false,
    };
    let log = Log {
        limiters: std::iter::repeat_with(Limiter::default)
            .take(first + task.inputs.len())
            .collect(),
        instances: first,
        holding: BTreeSet::new(),
        ring: consumer,
        banks: task.banks.iter().map(bank).collect(),
        inputs: task.inputs.iter().map(input).collect(),
    };
    (events, log)
}

impl Log {
    /// Logs what happened since the last time.
    pub(crate) fn write(&mut self) {
        while let Ok(event) = self.ring.pop() {
            let speaker = match event {
                Event::Block { instance, .. } => instance,
                Event::Input { input, .. } => self.instances + input,
            };
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
        match event {
            Event::Block { instance, status } => {
                let (bank, name) = self.instance(instance)?;
                Some(block_sentence(&bank.block_type, name, status))
            }
            Event::Input { input, state, cycle } => {
                Some(format!("{} (cycle {cycle})", self.inputs.get_mut(input)?.sentence(state)))
            }
        }
    }

    fn instance(&self, mut instance: usize) -> Option<(&Bank, &str)> {
        for bank in &self.banks {
            match bank.instances.get(instance) {
                Some(name) => return Some((bank, name)),
                None => instance -= bank.instances.len(),
            }
        }
        None
    }
}

fn block_sentence(block_type: &BlockType, name: &str, word: u16) -> String {
    let kind = block_type.name;
    match block_type.status.iter().find(|known| known.code == word) {
        _ if word == status::OK => format!("block \"{name}\" ({kind}) reports no error any more"),
        Some(known) => format!(
            "block \"{name}\" ({kind}) reports 16#{word:04X} {}: {}",
            known.name, known.meaning
        ),
        None if word == ERROR_WITHOUT_WORD => format!("block \"{name}\" ({kind}) reports an error"),
        None => format!("block \"{name}\" ({kind}) reports error 16#{word:04X}"),
    }
}

impl InputWords {
    fn sentence(&mut self, state: InputState) -> String {
        let was_known = self.is_known;
        self.is_known |= !matches!(state, InputState::Waiting);
        let (name, value_type) = (&self.name, self.value_type);
        let reads = match self.on_stale {
            OnStale::Hold => "keeps its value",
            OnStale::Default => "reads its default",
            OnStale::Ramp(_) => "goes to its default",
        };
        match state {
            InputState::Good if was_known => format!("input \"{name}\" takes samples again"),
            InputState::Good => format!("input \"{name}\" has its first sample"),
            InputState::Waiting => {
                let service = self.service.as_deref().unwrap_or_default();
                format!(
                    "input \"{name}\" has no sample yet, because service \"{service}\" has sent no frame; \
                     it reads its default"
                )
            }
            InputState::Stale => {
                format!(
                    "input \"{name}\" is stale: its last sample is older than max_age; it {reads}"
                )
            }
            InputState::Stopped => {
                format!("input \"{name}\" is stale: its publisher has ended; it {reads}")
            }
            InputState::Doubted(flags) => {
                format!("input \"{name}\" is stale: its frames say {flags}; it {reads}")
            }
            InputState::Rejected(sample) => format!(
                "input \"{name}\" rejects {sample:?}, which {value_type} cannot hold; it keeps its value"
            ),
            InputState::Missing => format!(
                "input \"{name}\" takes no sample: the frames have none for it, or a layout that is not \
                 known yet; it keeps its value"
            ),
        }
    }
}
