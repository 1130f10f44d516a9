//! What blocks will report with values that they are about to get.

use std::collections::HashSet;

use super::signals::Signals;
use crate::plan::{Plan, first_error};

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
    ) -> Vec<String> {
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
            let name = instance.name;
            let code = first_error(instance.block_type, &constants, period_ns, &self.obs)?;
            let word = instance.block_type.status.iter().find(|word| word.code == code);
            let meaning = word.map_or("an error", |word| word.meaning);
            Some(format!("block \"{name}\" will report 16#{code:04X}: {meaning}"))
        };
        slots.filter_map(&mut warning).collect()
    }
}
