//! The quality of values: the age of the samples that they were computed from, and their flags.

use isochrone_blocks::Indication;
use isochrone_model::Flags;

use crate::plan::{BankPlan, TaskPlan, Upstream};

/// What is known of a value that comes from outside of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Source {
    /// When the oldest sample behind it was published; 0: none was.
    pub(crate) source_ns: u64,
    pub(crate) flags: Flags,
}

impl Source {
    /// Of what depends on nothing outside.
    pub(crate) const CONSTANT: Self = Self { source_ns: 0, flags: Flags::NONE };
    /// Of an input that has no sample, and of a value of a task that has not finished a cycle yet.
    pub(crate) const NO_SAMPLE: Self = Self { source_ns: 0, flags: Flags::SUBSTITUTE };
    pub(crate) const UNKNOWN: Self = Self::NO_SAMPLE;
}

/// What a value or a frame is computed from.
pub(crate) struct Origins {
    sources: Box<[usize]>,
    blocks: Box<[Reporters]>,
}

/// Instances of a bank that can report errors.
struct Reporters {
    bank: usize,
    indication: Indication,
    /// Slots of the first and of each further instance's pin.
    first_slot: usize,
    stride: usize,
    count: usize,
}

impl Origins {
    pub(crate) fn of(upstream: &Upstream, task: &TaskPlan) -> Self {
        let reporters = |bank: usize, plan: &BankPlan, range: &std::ops::Range<usize>| {
            let (indication, stride) = (plan.block_type.indication()?, plan.block_type.slots());
            let first_slot = plan.first_slot + range.start * stride + indication.place();
            Some(Reporters { bank, indication, first_slot, stride, count: range.len() })
        };
        let blocks = upstream.blocks.iter();
        let blocks =
            blocks.filter_map(|i| reporters(i.bank, task.banks.get(i.bank)?, &i.range)).collect();
        Self { sources: upstream.sources.as_slice().into(), blocks }
    }
}

/// The state of a task by which values are judged.
pub(crate) struct Worth<'a> {
    pub(crate) sources: &'a [Source],
    /// For each bank how many of its blocks report an error in this cycle; `None`: none does.
    pub(crate) bank_errors: Option<&'a [u64]>,
    pub(crate) image: &'a [f64],
}

impl Worth<'_> {
    /// The oldest sample and all flags of what a value is computed from.
    pub(crate) fn of(&self, origins: &Origins) -> Source {
        let mut worth = Source { source_ns: u64::MAX, flags: Flags::NONE };
        for source in origins.sources.iter().filter_map(|source| self.sources.get(*source)) {
            // 0, no sample, becomes the youngest of all.
            worth.source_ns = worth.source_ns.min(source.source_ns.wrapping_sub(1));
            worth.flags |= source.flags;
        }
        worth.source_ns = worth.source_ns.wrapping_add(1);
        if let Some(bank_errors) = self.bank_errors
            && origins.blocks.iter().any(|blocks| self.has_error(blocks, bank_errors))
        {
            worth.flags |= Flags::ERROR;
        }
        worth
    }

    fn has_error(&self, blocks: &Reporters, bank_errors: &[u64]) -> bool {
        if bank_errors.get(blocks.bank).is_none_or(|errors| *errors == 0) {
            return false;
        }
        let slots = self.image.get(blocks.first_slot..).unwrap_or_default();
        let mut pins = slots.iter().step_by(blocks.stride).take(blocks.count);
        pins.any(|value| blocks.indication.is_error(*value))
    }
}
