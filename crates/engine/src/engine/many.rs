//! Banks of many instances, most of which share all inputs but the first.
//!
//! A hundred ramps have one rate, and each has a signal of its own, its first input. A loop that reads the rate once
//! lets the compiler take what depends on it alone out of the loop.

use isochrone_blocks::{BlockType, Cycle, Feed, StepShared};

use crate::plan::WirePlan;

/// Fewer instances are faster one by one: banks of three or four took 5 % longer this way.
const FEWEST: usize = 8;

/// A bank of many instances.
pub(super) struct Many {
    /// Wires to the same pin of all instances, in the order of the pins.
    runs: Box<[WireRun]>,
    /// The loop for instances that share all inputs but the first; `None`: wires bring them different ones, or their
    /// type has no such loop.
    pub(super) step: Option<StepShared>,
    /// The input pins after the first without a run. If there is a `step`, none of them is wired.
    constants: Box<[usize]>,
    pub(super) sharing: Sharing,
}

/// Whether all instances have the same inputs after the first, and nothing is forced that a feed would write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sharing {
    Yes,
    No,
    /// Something was written since it was known.
    Unknown,
}

/// Wires to the same pin of all instances, from slots that are equally far apart.
struct WireRun {
    pin: usize,
    from: usize,
    stride: usize,
}

impl WireRun {
    /// The run that these wires form, if they lead to a pin of one instance after the other, `pins` slots apart.
    fn of(pin: usize, pins: usize, wires: &[WirePlan]) -> Option<Self> {
        let [first, second, ..] = wires else { return None };
        let stride = second.from.checked_sub(first.from)?;
        let follows = |a: &WirePlan, b: &WirePlan| {
            b.from.checked_sub(a.from) == Some(stride) && (b.to - a.to) as usize == pins
        };
        let is_next = |pair: &[WirePlan]| matches!(pair, [a, b] if follows(a, b));
        let is_run = wires.windows(2).all(is_next);
        is_run.then_some(Self { pin, from: first.from as usize, stride: stride as usize })
    }

    /// What it brings.
    fn feed<'a>(&self, before: &'a [f64]) -> Feed<'a> {
        Feed { values: before.get(self.from..).unwrap_or_default(), stride: self.stride }
    }
}

impl Many {
    /// Takes out of `wires`, which lead to slots counted from the bank's first, those that form runs. `delayed`: slots
    /// that wires of the cycle before write. `None`: there are too few instances.
    pub(super) fn of(
        block_type: &BlockType,
        instances: usize,
        wires: &mut Vec<WirePlan>,
        mut delayed: impl Iterator<Item = usize>,
    ) -> Option<Self> {
        if instances < FEWEST {
            return None;
        }
        let slots = block_type.slots();
        let pin = |wire: &WirePlan| wire.to as usize % slots;
        wires.sort_unstable_by_key(|wire| (pin(wire), wire.to));
        let of_pins = wires.chunk_by(|a, b| pin(a) == pin(b));
        let of_pins = of_pins.filter(|of_pin| of_pin.len() == instances);
        let runs = of_pins.filter_map(|of_pin| WireRun::of(pin(of_pin.first()?), slots, of_pin));
        let runs: Box<[WireRun]> = runs.collect();
        wires.retain(|wire| runs.iter().all(|run| run.pin != pin(wire)));
        let differ = runs.iter().any(|run| run.pin > 0 && run.stride > 0)
            || wires.iter().any(|wire| pin(wire) > 0)
            || delayed.any(|slot| slot % slots > 0);
        let is_constant = |pin: &usize| runs.iter().all(|run| run.pin != *pin);
        Some(Self {
            step: block_type.step_shared().filter(|_| !differ),
            constants: (1..block_type.inputs.len()).filter(is_constant).collect(),
            runs,
            sharing: Sharing::Unknown,
        })
    }

    /// Copies what wires bring, except for a first input that [`step`](Self::step) reads where it stands.
    pub(super) fn copy_wires<'a>(
        &self,
        block_type: &BlockType,
        before: &'a [f64],
        slots: &mut [f64],
    ) -> Option<Feed<'a>> {
        let (feed, runs) = match &*self.runs {
            [first, runs @ ..] if first.pin == 0 && self.sharing == Sharing::Yes => {
                (Some(first.feed(before)), runs)
            }
            runs => (None, runs),
        };
        for run in runs {
            let pins = slots.iter_mut().skip(run.pin).step_by(block_type.slots());
            pins.zip(run.feed(before).iter()).for_each(|(slot, value)| *slot = value);
        }
        feed
    }

    pub(super) fn step(
        &self,
        block_type: &BlockType,
        feed: Option<Feed<'_>>,
        slots: &mut [f64],
        words: &mut [u64],
        cycle: &Cycle<'_>,
    ) -> u64 {
        match self.step {
            Some(step) if self.sharing == Sharing::Yes => {
                debug_assert!(self.have_same_constants(block_type, slots), "{}", block_type.name);
                step(feed, slots, words, cycle)
            }
            _ => block_type.step_bank(slots, words, cycle),
        }
    }

    pub(super) fn have_same_constants(&self, block_type: &BlockType, slots: &[f64]) -> bool {
        let value = |instance: &[f64], pin: usize| instance.get(pin).map(|slot| slot.to_bits());
        self.constants.iter().all(|pin| {
            let first = value(slots, *pin);
            let mut instances = slots.chunks_exact(block_type.slots());
            instances.all(|instance| value(instance, *pin) == first)
        })
    }

    /// Whether a pin is an input that all instances must share, or that a feed writes.
    pub(super) fn depends_on(&self, block_type: &BlockType, pin: usize) -> bool {
        let is_fed = self.runs.first().is_some_and(|run| run.pin == 0);
        pin < block_type.inputs.len() && (pin > 0 || is_fed)
    }
}
