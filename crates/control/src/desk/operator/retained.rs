//! Values that were set, over a restart of the node.

use isochrone_engine::orders::Store;
use isochrone_model::{Role, Value};
use serde::{Deserialize, Serialize};

use super::{Operator, ParameterValue};
use crate::desk::signals::Signal;

/// A parameter or a variable that was set and not undone. Values are retained as their bits, so that every one comes
/// back exactly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RetainedValue {
    /// Its name.
    pub name: String,
    /// The bits of its value.
    pub value: u64,
    /// The bits of the constant in the configuration that it replaced.
    pub constant: u64,
}

/// A retained value that meets another configuration than the one in which it was set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unexpected {
    /// The configuration has no parameter or variable of this name and type any more.
    #[error("\"{name}\" was set, and the configuration has no such parameter or variable any more")]
    Gone {
        /// Its name.
        name: String,
    },
    /// Its constant was edited, and the file wins.
    #[error("\"{name}\" was set to {retained}, and the file was edited since: it is {configured}")]
    Edited {
        /// Its name.
        name: String,
        /// The value that was set.
        retained: Value,
        /// The value in the file, which it has now.
        configured: Value,
    },
    /// The `initial` of a variable was edited, and the retained value wins.
    #[error("variable \"{name}\" keeps {retained}, which was set; the file was edited since, and has {configured}")]
    Kept {
        /// Its name.
        name: String,
        /// The value that it keeps.
        retained: Value,
        /// The value in the file.
        configured: Value,
    },
    /// The configuration does not allow it any more.
    #[error("\"{name}\" was set to {retained}, which is beyond its limits now: it is {configured}")]
    BeyondLimits {
        /// Its name.
        name: String,
        /// The value that was set.
        retained: Value,
        /// The value in the file, which it has now.
        configured: Value,
    },
}

/// What became of retained values.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct RestoredValues {
    /// For each task what is to be written into its image.
    pub stores: Vec<Vec<Store>>,
    /// What differs from the configuration in which they were set.
    pub unexpected: Vec<Unexpected>,
}

impl Operator {
    /// The parameters and variables that differ from the configuration, in the order of the images.
    pub fn retained_values(&self) -> Vec<RetainedValue> {
        let mut held: Vec<_> = self.values.iter().map(|(at, held)| (*at, held.value)).collect();
        held.sort_unstable_by_key(|(at, _)| *at);
        let retained = |((task, slot), value): ((usize, u32), f64)| {
            let signals = self.signals_of(task);
            let constant = signals.constant(task, slot as usize)?.to_bits();
            let name = signals.at(task, slot as usize)?.name;
            let value = value.to_bits();
            (value != constant).then_some(RetainedValue { name, value, constant })
        };
        held.into_iter().filter_map(retained).collect()
    }

    /// Takes back values that were set in an earlier run of the node; before its start. A value comes back only if the
    /// constant in the file is the one that it replaced; a variable's comes back in any case.
    pub fn restore(&mut self, values: &[RetainedValue]) -> RestoredValues {
        let mut restored = RestoredValues::default();
        restored.stores.resize_with(self.changes.len(), Vec::new);
        for value in values {
            let (at, differs) = self.judge(value);
            restored.unexpected.extend(differs);
            let Some((task, slot)) = at else { continue };
            let value = f64::from_bits(value.value);
            self.values.insert((task, slot), ParameterValue { value, version: 0 });
            if let Some(stores) = restored.stores.get_mut(task) {
                stores.push(Store::new(slot as usize, value));
            }
        }
        restored
    }

    /// Where a retained value goes, if it comes back, and what is different now.
    fn judge(&self, retained: &RetainedValue) -> (Option<(usize, u32)>, Option<Unexpected>) {
        let name = retained.name.clone();
        let gone = |name| (None, Some(Unexpected::Gone { name }));
        let Some(signal) = self.signals.locate(&name) else { return gone(name) };
        let Signal { task, slot, value_type, role, .. } = signal;
        let value = f64::from_bits(retained.value);
        let constant = self.signals.constant(task, slot);
        let Some(constant) = constant.filter(|_| role.is_settable()) else {
            return gone(name);
        };
        if !(value_type.holds(value) || signal.can_be_unset) {
            return gone(name);
        }
        let [shown, configured] = [value, constant].map(|slot| Value::of(slot, value_type));
        let is_allowed =
            self.limits(&signal).is_none_or(|[min, max]| (min..=max).contains(&value));
        if !is_allowed {
            let differs = Unexpected::BeyondLimits { name, retained: shown, configured };
            return (None, Some(differs));
        }
        let at = Some((task, slot as u32));
        if constant.to_bits() == retained.constant {
            return (at, None);
        }
        if role == Role::Variable {
            return (at, Some(Unexpected::Kept { name, retained: shown, configured }));
        }
        (None, Some(Unexpected::Edited { name, retained: shown, configured }))
    }
}
