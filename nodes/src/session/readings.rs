//! The newest values of signals, and what they are worth.

use std::collections::{BTreeMap, HashMap, HashSet};

use isochrone_control::{Force, Role, SignalDescription, Value};

use super::news::ReadValues;
use crate::operate::ok_of;

/// Marks of a signal besides its value.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Marks {
    pub(crate) forced: bool,
    /// It is computed from what is forced.
    pub(crate) from_forced: bool,
    /// An input that is not ok, its `ok`, or a pin of a block that reports an error.
    pub(crate) bad: bool,
    /// A source of its value is stale, a substitute, rejected or in error.
    pub(crate) in_doubt: bool,
}

impl Marks {
    /// `F`: forced; `f`: computed from what is; `!`: not ok; `?`: computed from what is not.
    pub(crate) fn letters(self) -> [char; 2] {
        let forced = match self {
            Self { forced: true, .. } => 'F',
            Self { from_forced: true, .. } => 'f',
            Self { .. } => ' ',
        };
        let quality = match self {
            Self { bad: true, .. } => '!',
            Self { in_doubt: true, .. } => '?',
            Self { .. } => ' ',
        };
        [forced, quality]
    }
}

/// The latest values of a node's signals.
#[derive(Debug, Default)]
pub(crate) struct Readings {
    values: HashMap<String, Value>,
    /// The flags of the values that have some.
    quality: BTreeMap<String, Vec<String>>,
    forced: HashSet<String>,
    /// Blocks that report an error and inputs that are not ok.
    alarmed: HashSet<String>,
}

impl Readings {
    /// Replaces the values. Signals that are not among them have none any more.
    pub(crate) fn take(&mut self, ReadValues { values, quality }: ReadValues) {
        self.quality = quality;
        self.values = values.0.into_iter().collect();
    }

    /// Forgets all values: they are no news any more.
    pub(crate) fn forget(&mut self) {
        self.values.clear();
        self.quality.clear();
    }

    pub(crate) fn set_forced(&mut self, forces: &[Force]) {
        self.forced = forces.iter().map(|force| force.name.clone()).collect();
    }

    /// These blocks report an error, and these inputs are not ok.
    pub(crate) fn set_alarmed(&mut self, names: impl IntoIterator<Item = String>) {
        self.alarmed = names.into_iter().collect();
    }

    pub(crate) fn value(&self, name: &str) -> Option<Value> {
        self.values.get(name).copied()
    }

    /// The flags of a signal's value.
    pub(crate) fn flags(&self, name: &str) -> &[String] {
        self.quality.get(name).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn marks(&self, signal: &SignalDescription) -> Marks {
        let name = &signal.name;
        // Alarms are asked for less often than values.
        let is_not_ok = signal.role == Role::Input
            && self
                .value(&ok_of(name))
                .map_or_else(|| self.alarmed.contains(name), |ok| ok == Value::Bool(false));
        let is_of_failed_block =
            matches!(signal.role, Role::Parameter | Role::Wired | Role::Output)
                && name.rsplit_once('.').is_some_and(|(block, _)| self.alarmed.contains(block));
        let says_not_ok = signal.role == Role::Ok && self.value(name) == Some(Value::Bool(false));
        // A force is meant, and has marks of its own.
        let is_force = |flag: &String| flag == "FORCED";
        let flags = self.flags(name);
        let in_doubt = flags.iter().any(|flag| !is_force(flag));
        let bad = is_not_ok || says_not_ok || is_of_failed_block;
        let forced = self.forced.contains(name);
        Marks { forced, from_forced: !forced && flags.iter().any(is_force), bad, in_doubt }
    }
}
