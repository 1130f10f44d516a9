//! Values that were set, over a restart of the node.

use std::collections::BTreeMap;
use std::fmt;

use isochrone_engine::orders::{Store, Work};
use isochrone_model::{AskedBy, Refusal, Role, Value, Written};
use serde::{Deserialize, Serialize};

use super::requests::{prepared, sorted};
use super::{Kind, Operator, ParameterValue, PreparedRequest, RequestTerms};

/// A parameter or a variable that was set and not undone. Values are retained as their bits, so that every one comes
/// back exactly.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct RetainedValue {
    /// Its name.
    pub name: String,
    /// Its type, as configurations write it.
    #[serde(rename = "type")]
    pub value_type: String,
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
                write!(f, "the value that was set for \"{name}\" is dropped: {why}")
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
    /// Those that it sets.
    pub values: Vec<RetainedValue>,
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
            let signal = signals.at(task, slot as usize)?;
            let (name, value_type) = (signal.name, signal.value_type.to_string());
            let value = value.to_bits();
            (value != constant).then_some(RetainedValue { name, value_type, value, constant })
        };
        held.into_iter().filter_map(retained).collect()
    }

    /// Prepares to set what was set in an earlier run of the node, and takes it for set from now on: before the first
    /// cycle. A value comes back only if the constant in the file is the one that it replaced; a variable's comes back
    /// in any case. It was allowed when it was set, so `control` and `[[protect]]` do not matter. `first` is the first
    /// cycle of each task.
    pub fn restore(&mut self, retained: &[RetainedValue], first: &[u64]) -> RestoredValues {
        let mut restored = RestoredValues::default();
        let mut stores: BTreeMap<usize, Vec<Store>> = BTreeMap::new();
        for of_run in retained {
            let judged = self.judge(of_run);
            let (store, differs) = judged.unwrap_or_else(|refused| (None, Some(refused)));
            restored.unexpected.extend(differs);
            let Some((task, store)) = store else { continue };
            let value = ParameterValue { value: store.value, version: 0 };
            self.values.insert((task, store.slot), value);
            stores.entry(task).or_default().push(store);
            restored.values.push(of_run.clone());
        }
        if !stores.is_empty() {
            let work = |(task, stores)| {
                (task, Work::Set { feeds: [].into(), stores: sorted(Some(stores)) })
            };
            let orders = stores.into_iter().map(work).collect();
            let prepared = prepared(orders, restored_terms(), Kind::Set, Vec::new(), None);
            restored.request = Some(prepared.due(None, first));
        }
        restored
    }

    /// What becomes of a retained value.
    fn judge(&self, retained: &RetainedValue) -> Result<Judged, Unexpected> {
        let RetainedValue { name, value_type, value, constant } = retained;
        let name = || name.clone();
        let refused = |refusal: Refusal| {
            let why = refusal.findings.first().map_or_else(String::new, |it| it.message.clone());
            Unexpected::Refused { name: name(), why }
        };
        let signal = self.signals.find(&retained.name).map_err(refused)?;
        let configured = self.signals.constant(signal.task, signal.slot);
        let Some(configured) = configured.filter(|_| signal.role.is_settable()) else {
            let why = "it is no parameter or variable any more".to_owned();
            return Err(Unexpected::Refused { name: name(), why });
        };
        if signal.value_type.as_str() != value_type {
            let why = format!("it is {} now, and {value_type} was set", signal.value_type);
            return Err(Unexpected::Refused { name: name(), why });
        }
        let set = Value::of(f64::from_bits(*value), signal.value_type);
        let slot = self.allowed(&signal, &Written::from(set)).map_err(refused)?;
        let store = Some((signal.task, Store::new(signal.slot, slot)));
        if configured.to_bits() == *constant {
            return Ok((store, None));
        }
        if configured.to_bits() == *value {
            // It was saved.
            return Ok((None, None));
        }
        let (retained, configured) = (set, Value::of(configured, signal.value_type));
        Ok(if signal.role == Role::Variable {
            (store, Some(Unexpected::Kept { name: name(), retained, configured }))
        } else {
            (None, Some(Unexpected::Edited { name: name(), retained, configured }))
        })
    }
}

/// The task and the value of what comes back, and what is different now.
type Judged = (Option<(usize, Store)>, Option<Unexpected>);

/// Who sets retained values, for the journal.
fn restored_terms() -> RequestTerms {
    let by = AskedBy { client: Some("retained state".to_owned()), ..AskedBy::default() };
    RequestTerms { by, ..RequestTerms::default() }
}
