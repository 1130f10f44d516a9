//! What blocks will report with values that they are about to get.

use std::collections::HashSet;
use std::fmt;

use super::signals::Signals;
use crate::plan::{Plan, first_error};

/// A block that will report an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// The block.
    pub block: String,
    /// Its status word then.
    pub status: u16,
    /// What that means.
    pub meaning: &'static str,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { block, status, meaning } = self;
        write!(f, "block \"{block}\" will report 16#{status:04X}: {meaning}")
    }
}

/// What is needed to try a block out.
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
    ) -> Vec<Warning> {
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
            Some(Warning { block, status, meaning })
        };
        slots.filter_map(&mut warning).collect()
    }
}
