//! Warnings about values that are about to be set.

use std::collections::HashSet;
use std::fmt;

use isochrone_engine::{Plan, first_error};

use super::signals::Signals;

/// A warning about a value that is set.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ValueWarning {
    /// A block will report an error.
    Error {
        /// The block.
        block: String,
        /// Its status word then.
        status: u16,
        /// Its meaning.
        meaning: &'static str,
    },
    /// A force holds the parameter at another value.
    Forced {
        /// The parameter.
        name: String,
    },
    /// The signal is forced already, and the new force replaces that one.
    Replaced {
        /// The signal.
        name: String,
    },
    /// The block does not read the parameter in every call.
    Latched {
        /// The parameter.
        name: String,
        /// The BOOL pin that makes the block read it.
        latch: String,
    },
}

impl ValueWarning {
    /// What it is about: a block or a parameter.
    pub fn name(&self) -> &str {
        match self {
            Self::Error { block, .. } => block,
            Self::Forced { name } | Self::Replaced { name } | Self::Latched { name, .. } => name,
        }
    }

    /// The warnings as text: one sentence for all that differ only in their block or parameter, with the name of the
    /// first.
    pub fn sentences(warnings: &[Self]) -> Vec<(&str, String)> {
        // The first of a group, and the names of all that are like it.
        let mut kinds: Vec<(&Self, Vec<&str>)> = Vec::new();
        for warning in warnings {
            match kinds.iter_mut().find(|(first, _)| first.is_like(warning)) {
                Some((_, names)) => names.push(warning.name()),
                None => kinds.push((warning, vec![warning.name()])),
            }
        }
        kinds.into_iter().map(|(first, names)| (first.name(), first.sentence_of(&names))).collect()
    }

    /// Whether both differ only in their block or parameter.
    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Error { status, meaning, .. }, Self::Error { status: of, meaning: is, .. }) => {
                (status, meaning) == (of, is)
            }
            (Self::Latched { latch, .. }, Self::Latched { latch: other, .. }) => {
                pin(latch) == pin(other)
            }
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }

    /// The sentence for a group.
    fn sentence_of(&self, names: &[&str]) -> String {
        /// How many names a sentence has.
        const NAMED: usize = 3;
        let count = names.len();
        if count == 1 {
            return self.to_string();
        }
        let named: Vec<String> =
            names.iter().take(NAMED).map(|name| format!("\"{name}\"")).collect();
        let more = (count > NAMED).then(|| format!(" and {} more", count - NAMED));
        let names = named.join(", ") + &more.unwrap_or_default();
        match self {
            Self::Error { status, meaning, .. } => {
                format!("{count} blocks ({names}) will report 16#{status:04X}: {meaning}")
            }
            Self::Forced { .. } => format!(
                "{count} parameters ({names}) are forced: their blocks read the new values after the release"
            ),
            Self::Replaced { .. } => format!(
                "{count} signals ({names}) were forced already: the new forces, with their end, replace those"
            ),
            Self::Latched { latch, .. } => format!(
                "{count} parameters ({names}) are read only in their block's first call and while its \"{}\" is TRUE",
                pin(latch)
            ),
        }
    }
}

/// The pin in `block.pin`.
fn pin(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(_, pin)| pin)
}

impl fmt::Display for ValueWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error { block, status, meaning } => {
                write!(f, "block \"{block}\" will report 16#{status:04X}: {meaning}")
            }
            Self::Forced { name } => {
                write!(f, "\"{name}\" is forced: its block reads the new value after the release")
            }
            Self::Replaced { name } => {
                write!(
                    f,
                    "\"{name}\" was forced already: the new force, with its end, replaces that one"
                )
            }
            Self::Latched { name, latch } => write!(
                f,
                "\"{name}\" is read only in the block's first call and while \"{latch}\" is TRUE"
            ),
        }
    }
}

/// The data to try out a block.
#[derive(Debug)]
pub(super) struct Warnings {
    obs: Vec<(i16, u64)>,
}

impl Warnings {
    pub(super) fn of(plan: &Plan) -> Self {
        Self { obs: plan.obs.clone() }
    }

    /// A warning for each instance of a library block that has a pin among `slots` and will report an
    /// error, whatever its wires bring. `value` says which pins were given a value since they were configured.
    pub(super) fn of_instances(
        &self,
        signals: &Signals,
        task: usize,
        slots: impl Iterator<Item = usize>,
        value: impl Fn(u32) -> Option<f64>,
    ) -> Vec<ValueWarning> {
        let mut seen = HashSet::new();
        let mut warning = |slot: usize| {
            let instance = signals.instance_of(task, slot)?;
            if !seen.insert(instance.first_slot) {
                return None;
            }
            let pins = instance.constants.iter().zip(instance.first_slot..);
            let constant = |(constant, slot): (&f64, usize)| {
                let given = value(slot as u32);
                given.or_else(|| (!signals.is_wired(task, slot)).then_some(*constant))
            };
            let constants: Vec<Option<f64>> = pins.map(constant).collect();
            let period_ns = signals.task(task)?.period_ns;
            let block = instance.name;
            let status = first_error(instance.block_type, &constants, period_ns, &self.obs)?;
            let word = instance.block_type.status.iter().find(|word| word.code == status);
            let meaning = word.map_or("an error", |word| word.meaning);
            Some(ValueWarning::Error { block, status, meaning })
        };
        slots.filter_map(&mut warning).collect()
    }

    /// A warning for each of `slots` that its block does not read in every call, unless it reads it now. `value` as
    /// with [`of_instances`](Self::of_instances).
    pub(super) fn of_latches(
        signals: &Signals,
        task: usize,
        slots: impl Iterator<Item = usize>,
        value: impl Fn(u32) -> Option<f64>,
    ) -> Vec<ValueWarning> {
        let warning = |slot: usize| {
            let instance = signals.instance_of(task, slot)?;
            let inputs = instance.block_type.inputs;
            let latch = inputs.get(slot - instance.first_slot)?.latched_by?;
            let pin = inputs.iter().position(|pin| pin.name == latch)?;
            let latch_slot = instance.first_slot + pin;
            let constant = instance.constants.get(pin).copied();
            let given = value(latch_slot as u32).or(constant);
            let is_read =
                !signals.is_wired(task, latch_slot) && given.is_some_and(|given| given != 0.0);
            let latch = signals.at(task, latch_slot)?.name;
            (!is_read)
                .then_some(ValueWarning::Latched { name: signals.at(task, slot)?.name, latch })
        };
        slots.filter_map(warning).collect()
    }
}
