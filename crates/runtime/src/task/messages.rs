//! Log messages about errors of a task's blocks and the state of its inputs.

use std::collections::HashMap;
use std::sync::Arc;

use isochrone_blocks::{BlockType, Caution, status};
use isochrone_engine::config::OnStale;
use isochrone_engine::{BankPlan, InputPlan, TaskPlan};
use isochrone_timing::units::counted;

use crate::node::event::Event;
use crate::task::freshness::{Accepted, InputState, Missing};

/// Stands for a status word where a block has none.
pub(crate) const ERROR_WITHOUT_WORD: u16 = u16::MAX;

/// Stands for a status word where a block reports no error and needs a caution.
pub(crate) const CAUTION: u16 = u16::MAX - 1;

/// Whether blocks of a type can report errors, or need a caution.
pub(crate) fn is_watched(block_type: &BlockType) -> bool {
    block_type.indication().is_some() || block_type.caution.is_some()
}

/// Names and types of a task's blocks and inputs.
pub(crate) struct Messages {
    banks: Vec<Bank>,
    instances: usize,
    inputs: Vec<InputMessages>,
}

struct Bank {
    block_type: BlockType,
    instances: Arc<[String]>,
}

struct InputMessages {
    name: String,
    service: Option<String>,
    accepted: Accepted,
    max_age_ns: Option<u64>,
    on_stale: OnStale,
}

/// Whether a state of an input's samples was logged before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LoggedBefore {
    Yes,
    No,
}

impl LoggedBefore {
    pub(crate) fn of(was_known: bool) -> Self {
        if was_known { Self::Yes } else { Self::No }
    }
}

/// The indices of a task's blocks and inputs in another configuration.
#[derive(Debug)]
pub(crate) struct Moved {
    /// For each block its new index, if the other configuration has one of its name and type.
    blocks: Box<[Option<usize>]>,
    new_blocks: usize,
}

impl Moved {
    pub(crate) fn of(old: &Messages, new: &Messages) -> Self {
        let places = new.blocks().enumerate();
        let places: HashMap<_, _> =
            places.map(|(place, (name, block_type))| ((name, block_type.name), place)).collect();
        let place =
            |(name, block_type): (&str, &BlockType)| places.get(&(name, block_type.name)).copied();
        Self { blocks: old.blocks().map(place).collect(), new_blocks: new.instances }
    }

    /// The new index of a block or an input.
    pub(crate) fn place(&self, speaker: usize) -> Option<usize> {
        match speaker.checked_sub(self.blocks.len()) {
            Some(input) => Some(self.new_blocks + input),
            None => self.blocks.get(speaker).copied().flatten(),
        }
    }
}

impl Messages {
    pub(crate) fn of(task: &TaskPlan) -> Self {
        let bank = |bank: &BankPlan| Bank {
            block_type: bank.block_type,
            instances: bank.instances.clone(),
        };
        let input = |input: &InputPlan| InputMessages {
            name: input.name.clone(),
            service: input.service.clone(),
            accepted: Accepted::of_service(input),
            max_age_ns: input.max_age_ns,
            on_stale: input.on_stale,
        };
        Self {
            banks: task.banks.iter().map(bank).collect(),
            instances: task.banks.iter().map(|bank| bank.instances.len()).sum(),
            inputs: task.inputs.iter().map(input).collect(),
        }
    }

    /// The index of the block or input that an event is about: blocks in the order of the image, then inputs.
    pub(crate) fn speaker(&self, event: &Event) -> usize {
        match event {
            Event::Block { instance, .. } => *instance,
            Event::Input { input, .. } => self.instances + input,
            Event::Changed => self.speakers(),
        }
    }

    /// The log line for an event.
    pub(crate) fn sentence(&self, event: &Event, logged: LoggedBefore) -> Option<String> {
        match *event {
            Event::Block { instance, status, .. } => {
                let (bank, name) = self.instance(instance)?;
                Some(block_sentence(&bank.block_type, name, status))
            }
            Event::Input { input, state, cycle } => {
                let sentence = self.inputs.get(input)?.sentence(state, logged);
                Some(format!("{sentence} (cycle {cycle})"))
            }
            Event::Changed => None,
        }
    }

    /// The caution that an event is about, with the name of the block.
    pub(crate) fn caution(&self, event: &Event) -> Option<(String, &'static Caution)> {
        let Event::Block { instance, status: CAUTION, .. } = *event else { return None };
        let (bank, name) = self.instance(instance)?;
        Some((name.to_owned(), bank.block_type.caution?))
    }

    /// The fault after an event: the name, its status word and what that means. `reasons` has why inputs take no
    /// sample.
    pub(crate) fn explain(
        &self,
        event: &Event,
        reasons: &HashMap<String, String>,
    ) -> Option<(String, Option<u16>, String)> {
        match *event {
            Event::Block { instance, status, .. } => {
                let (bank, name) = self.instance(instance)?;
                let known = bank.block_type.status.iter().find(|known| known.code == status);
                let meaning = known.map_or("the block reports an error", |known| known.meaning);
                let status = Some(status).filter(|status| *status != ERROR_WITHOUT_WORD);
                Some((name.to_owned(), status, meaning.to_owned()))
            }
            Event::Input { input, state, .. } => {
                let input = self.inputs.get(input)?;
                let meaning = match (state, reasons.get(&input.name)) {
                    (InputState::Missing(why), Some(reason))
                        if !matches!(why, Missing::Channel { .. }) =>
                    {
                        input.takes_none(reason)
                    }
                    _ => input.meaning(state),
                };
                Some((input.name.clone(), None, meaning))
            }
            Event::Changed => None,
        }
    }

    /// How many blocks and inputs there are.
    pub(crate) fn speakers(&self) -> usize {
        self.instances + self.inputs.len()
    }

    /// Names and types of the blocks, in the order of the image.
    fn blocks(&self) -> impl Iterator<Item = (&str, &BlockType)> {
        self.banks.iter().flat_map(|bank| {
            bank.instances.iter().map(move |name| (name.as_str(), &bank.block_type))
        })
    }

    /// The blocks that can report errors, or need a caution: their places in the order of the image.
    pub(crate) fn watched(&self) -> impl Iterator<Item = usize> {
        let blocks = self.blocks().enumerate();
        blocks.filter(|(_, (_, block_type))| is_watched(block_type)).map(|(at, _)| at)
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
    if let (CAUTION, Some(Caution { meaning, remedy, .. })) = (word, block_type.caution) {
        return format!("block \"{name}\" ({kind}): {meaning}; {remedy}");
    }
    match block_type.status.iter().find(|known| known.code == word) {
        _ if word == status::OK => match block_type.caution {
            None => format!("block \"{name}\" ({kind}) reports no error any more"),
            Some(Caution { over, .. }) => {
                format!("block \"{name}\" ({kind}) reports no error any more, and {over}")
            }
        },
        Some(known) => format!(
            "block \"{name}\" ({kind}) reports 16#{word:04X} {}: {}",
            known.name, known.meaning
        ),
        None if word == ERROR_WITHOUT_WORD => format!("block \"{name}\" ({kind}) reports an error"),
        None => format!("block \"{name}\" ({kind}) reports error 16#{word:04X}"),
    }
}

impl InputMessages {
    fn sentence(&self, state: InputState, logged: LoggedBefore) -> String {
        let (name, meaning) = (&self.name, self.meaning(state));
        match state {
            InputState::Good if logged == LoggedBefore::Yes => {
                format!("input \"{name}\" takes samples again")
            }
            InputState::Good => format!("input \"{name}\" has its first sample"),
            InputState::Waiting | InputState::Restored => {
                format!("input \"{name}\" has {meaning}")
            }
            InputState::Stale | InputState::Stopped | InputState::Doubted(_) => {
                format!("input \"{name}\" is {meaning}")
            }
            InputState::Rejected(_) | InputState::Missing(_) => {
                format!("input \"{name}\" {meaning}")
            }
        }
    }

    /// The reason for the state, and what the input reads.
    fn meaning(&self, state: InputState) -> String {
        let reads = match self.on_stale {
            OnStale::Hold => "keeps its value",
            OnStale::Default => "reads its default",
            OnStale::Ramp(_) => "goes to its default",
        };
        let of = self.service.as_deref();
        let of = of.map_or_else(String::new, |service| format!(" of service \"{service}\""));
        match state {
            InputState::Good => "ok".into(),
            InputState::Waiting | InputState::Restored => {
                let service = self.service.as_deref().unwrap_or_default();
                let is_restored = state == InputState::Restored;
                let reads = if is_restored { reads } else { "reads its default" };
                let since = if is_restored { " since the restart" } else { "" };
                format!(
                    "no sample yet{since}, because service \"{service}\" has sent no frame; it {reads}"
                )
            }
            InputState::Stale => {
                format!("stale: its last sample{of} is older than max_age; it {reads}")
            }
            InputState::Stopped => format!("stale: its publisher{of} has ended; it {reads}"),
            InputState::Doubted(flags) => format!("stale: its frames{of} say {flags}; it {reads}"),
            InputState::Rejected(sample) => format!(
                "rejects {sample:?}, {}; it {}",
                self.accepted.refusal(sample),
                self.reads_without_sample()
            ),
            InputState::Missing(why) => {
                let why = match why {
                    Missing::Layout => {
                        format!("the frames{of} have a layout that is not known yet")
                    }
                    Missing::Signal => format!("the frames{of} have no signal that fits it"),
                    Missing::Unit => format!("the frames{of} have it in another unit"),
                    Missing::Channel { channel, values } => format!(
                        "it reads channel {channel}, counted from 0, and the frames{of} have {}; have their \
                         publisher send as many values as it announces, or correct the input's channel",
                        counted(values as u64, "value")
                    ),
                };
                self.takes_none(&why)
            }
        }
    }

    /// Says that frames arrive and the input takes no sample of them.
    fn takes_none(&self, reason: &str) -> String {
        format!("takes no sample: {reason}; it {}", self.reads_without_sample())
    }

    /// What the input reads while it takes no sample of the frames that arrive: its last one ages meanwhile.
    fn reads_without_sample(&self) -> String {
        match (self.max_age_ns, self.on_stale) {
            (None, _) | (_, OnStale::Hold) => "keeps its value".into(),
            (Some(_), OnStale::Default) => {
                "keeps its value until that is older than max_age, and reads its default then"
                    .into()
            }
            (Some(_), OnStale::Ramp(_)) => {
                "keeps its value until that is older than max_age, and goes to its default then"
                    .into()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_blocks::PinType;

    use super::*;

    #[test]
    fn a_stale_input_says_what_it_reads_instead() {
        for (on_stale, reads) in [
            (OnStale::Hold, "keeps its value"),
            (OnStale::Default, "reads its default"),
            (OnStale::Ramp(5.0), "goes to its default"),
        ] {
            let (name, service) = ("level".to_owned(), Some("plant/raw".to_owned()));
            let (accepted, max_age_ns) = (Accepted::all_of(PinType::Lreal), Some(7));
            let input = InputMessages { name, service, accepted, max_age_ns, on_stale };
            let said = |state| input.meaning(state);
            let why = "its last sample of service \"plant/raw\" is older than max_age";
            assert_eq!(said(InputState::Stale), format!("stale: {why}; it {reads}"));
            let why = "its publisher of service \"plant/raw\" has ended";
            assert_eq!(said(InputState::Stopped), format!("stale: {why}; it {reads}"));
            let why =
                "no sample yet since the restart, because service \"plant/raw\" has sent no frame";
            assert_eq!(said(InputState::Restored), format!("{why}; it {reads}"));
        }
    }

    #[test]
    fn an_input_that_takes_no_sample_says_what_it_reads_until_then_and_from_then_on() {
        let reads = |max_age_ns, on_stale| {
            let name = "level".to_owned();
            let input = InputMessages {
                name,
                service: None,
                accepted: Accepted::all_of(PinType::Int),
                max_age_ns,
                on_stale,
            };
            [InputState::Rejected(0.5), InputState::Missing(Missing::Layout)].map(|state| {
                let meaning = input.meaning(state);
                meaning.rsplit_once("; it ").unwrap().1.to_owned()
            })
        };
        let ramp = OnStale::Ramp(5.0);
        for (max_age_ns, on_stale, expected) in [
            (None, ramp, "keeps its value"),
            (Some(7), OnStale::Hold, "keeps its value"),
            (
                Some(7),
                ramp,
                "keeps its value until that is older than max_age, and goes to its default then",
            ),
            (
                Some(7),
                OnStale::Default,
                "keeps its value until that is older than max_age, and reads its default then",
            ),
        ] {
            assert_eq!(reads(max_age_ns, on_stale), [expected, expected]);
        }
    }
}
