//! Values that were set, over a restart of the node.

use std::fmt;

use isochrone_model::{AskedBy, Refusal, Role, Value};
use serde::{Deserialize, Serialize};

use super::{Operator, ParameterValue, PreparedRequest, RequestTerms};

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
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Unexpected {
    /// Its constant was edited, and the file wins.
    Edited {
        /// Its name.
        name: String,
        /// The value that was set.
        retained: Value,
        /// The value in the file, which it has now.
        configured: Value,
    },
    /// The `initial` of a variable was edited, and the retained value wins.
    Kept {
        /// Its name.
        name: String,
        /// The value that it keeps.
        retained: Value,
        /// The value in the file.
        configured: Value,
    },
    /// The configuration does not have it any more, or does not allow the value.
    Refused {
        /// Its name.
        name: String,
        /// Why.
        why: String,
    },
}

impl fmt::Display for Unexpected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Edited { name, retained, configured } => write!(
                f,
                "\"{name}\" was set to {retained}, and the file was edited since: it is {configured}"
            ),
            Self::Kept { name, retained, configured } => write!(
                f,
                "variable \"{name}\" keeps {retained}, which was set; the file was edited since, and has {configured}"
            ),
            Self::Refused { name, why } => {
                write!(f, "\"{name}\" was set, and is not any more: {why}")
            }
        }
    }
}

/// What becomes of retained values.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct RestoredValues {
    /// The request that sets them again, if there are any.
    pub request: Option<PreparedRequest>,
    /// How many it sets.
    pub values: usize,
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

    /// Prepares to set what was set in an earlier run of the node, and takes it for set from now on: before the first
    /// cycle. A value comes back only if the constant in the file is the one that it replaced; a variable's comes back
    /// in any case. `first` is the first cycle of each task.
    pub fn restore(&mut self, retained: &[RetainedValue], first: &[u64]) -> RestoredValues {
        let mut restored = RestoredValues::default();
        let mut values = Vec::new();
        for of_run in retained {
            let judged = self.judge(of_run, first);
            let (value, differs) = judged.unwrap_or_else(|refused| (None, Some(refused)));
            restored.unexpected.extend(differs);
            values.extend(value.map(|value| (of_run.name.as_str(), value)));
        }
        // Each was allowed by itself.
        let request = self.set(values.iter().copied(), restored_terms(), first).ok();
        let Some(request) = request.filter(|_| !values.is_empty()) else { return restored };
        (restored.values, restored.request) = (values.len(), Some(request));
        for (name, value) in values {
            let Ok(signal) = self.signals.find(name) else { continue };
            let at = (signal.task, signal.slot as u32);
            if let Some(value) = signal.slot_of(value) {
                self.values.insert(at, ParameterValue { value, version: 0 });
            }
        }
        restored
    }

    /// The value that comes back, and what is different now.
    fn judge(
        &self,
        retained: &RetainedValue,
        first: &[u64],
    ) -> Result<(Option<Value>, Option<Unexpected>), Unexpected> {
        let refused = |refusal: Refusal| {
            let why = refusal.findings.first().map_or_else(String::new, |it| it.message.clone());
            Unexpected::Refused { name: retained.name.clone(), why }
        };
        let signal = self.signals.find(&retained.name).map_err(refused)?;
        let value = Value::of(f64::from_bits(retained.value), signal.value_type);
        self.set([(retained.name.as_str(), value)], restored_terms(), first).map_err(refused)?;
        let constant = self.signals.constant(signal.task, signal.slot).unwrap_or(f64::NAN);
        if constant.to_bits() == retained.constant {
            return Ok((Some(value), None));
        }
        if constant.to_bits() == retained.value {
            // It was saved.
            return Ok((None, None));
        }
        let name = retained.name.clone();
        let (retained, configured) = (value, Value::of(constant, signal.value_type));
        Ok(if signal.role == Role::Variable {
            (Some(value), Some(Unexpected::Kept { name, retained, configured }))
        } else {
            (None, Some(Unexpected::Edited { name, retained, configured }))
        })
    }
}

/// Who sets retained values, for the journal.
fn restored_terms() -> RequestTerms {
    let by = AskedBy { client: Some("retained state".to_owned()), ..AskedBy::default() };
    RequestTerms { by, ..RequestTerms::default() }
}
