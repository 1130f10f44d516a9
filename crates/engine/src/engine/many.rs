//! Banks of many instances, most of which share all inputs but the first.
//!
//! A hundred ramps have one rate, and each has a signal of its own, its first input. A loop that reads the rate once
//! lets the compiler take what depends on it alone out of the loop.

use isochrone_blocks::{BlockType, Cycle, Feed, StepShared};

use super::{Bank, Stepping, TaskEngine};
use crate::orders::{EndedForce, Forces, SlotForce};
use crate::plan::WirePlan;

/// Fewer instances are faster one by one: in banks of three or four, a step took 5 % longer than so.
const FEWEST: usize = 8;
/// Banks that are passed over in a cycle in search of one to check.
const LOOKED_AT: usize = 64;

/// A bank of many instances.
pub(super) struct Many {
    /// Wires to the same pin of all instances, in the order of the pins.
    runs: Box<[WireRun]>,
    /// The loop for instances that share all inputs but the first; `None`: wires bring them different ones, or their
    /// type has no such loop.
    step: Option<StepShared>,
    /// The input pins after the first without a run. If there is a `step`, none of them is wired.
    constants: Box<[usize]>,
    sharing: Sharing,
}

/// Whether all instances have the same inputs after the first, and nothing is forced that a feed would write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sharing {
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

    fn have_same_constants(&self, block_type: &BlockType, slots: &[f64]) -> bool {
        let value = |instance: &[f64], pin: usize| instance.get(pin).map(|slot| slot.to_bits());
        self.constants.iter().all(|pin| {
            let first = value(slots, *pin);
            let mut instances = slots.chunks_exact(block_type.slots());
            instances.all(|instance| value(instance, *pin) == first)
        })
    }

    /// Whether an input pin is one that all instances must share, or that a feed writes.
    fn depends_on(&self, pin: usize) -> bool {
        pin > 0 || self.runs.first().is_some_and(|run| run.pin == 0)
    }
}

impl Bank {
    /// Finds out whether its instances share their inputs.
    fn check_sharing(&mut self, image: &[f64], forces: &Forces) {
        let Stepping::Many(many) = &mut self.stepping else { return };
        let (pins, inputs) = (self.block_type.slots(), self.block_type.inputs.len());
        let slots = self.first_slot..self.first_slot + self.slots;
        let matters = |slot: usize| {
            let pin = (slot - self.first_slot) % pins;
            pin < inputs && many.depends_on(pin)
        };
        let shared = many.step.is_some()
            && !forces.of(&slots).any(matters)
            && many.have_same_constants(&self.block_type, image.get(slots).unwrap_or_default());
        many.sharing = if shared { Sharing::Yes } else { Sharing::No };
    }
}

impl TaskEngine {
    /// Checks all banks after the image was replaced, in one pass over it, such as a copy takes. Allocates nothing.
    pub fn check_sharing(&mut self) {
        for bank in &mut self.banks {
            bank.check_sharing(&self.image, &self.forces);
        }
        self.unchecked = 0;
    }

    /// Steps all banks instance by instance until they are checked again, as the image is replaced.
    pub(super) fn forget_sharing(&mut self) {
        self.unchecked = 0;
        for bank in &mut self.banks {
            if let Stepping::Many(many) = &mut bank.stepping
                && many.step.is_some()
            {
                many.sharing = Sharing::Unknown;
                self.unchecked += 1;
            }
        }
    }

    /// Notes that an input slot of a bank is written or forced. For the real-time path, before the step.
    pub(super) fn note_written(&mut self, slot: usize) {
        note_written(&mut self.banks, &mut self.unchecked, slot);
    }

    /// Ends forces, and gives their slots what was written meanwhile. For the real-time path, if `ended` is.
    pub(super) fn end_forces(
        &mut self,
        ends: impl FnMut(&SlotForce) -> bool,
        mut ended: impl FnMut(EndedForce),
    ) {
        let (banks, unchecked) = (&mut self.banks, &mut self.unchecked);
        self.forces.end(ends, &mut self.image, |force| {
            note_written(banks, unchecked, force.slot() as usize);
            ended(force);
        });
    }

    /// Checks whether the instances of a bank share their inputs, if something was written or forced there. For the
    /// slack: allocates nothing, and checks one bank a call.
    #[inline]
    pub fn maintain(&mut self) {
        if self.unchecked > 0 {
            self.check_one_sharing();
        }
    }

    #[cold]
    fn check_one_sharing(&mut self) {
        for _ in 0..LOOKED_AT.min(self.banks.len()) {
            self.next_checked = (self.next_checked + 1) % self.banks.len();
            let Some(bank) = self.banks.get_mut(self.next_checked) else { return };
            if let Stepping::Many(many) = &bank.stepping
                && many.sharing == Sharing::Unknown
            {
                bank.check_sharing(&self.image, &self.forces);
                self.unchecked -= 1;
                return;
            }
        }
    }
}

fn note_written(banks: &mut [Bank], unchecked: &mut usize, slot: usize) {
    let behind = banks.partition_point(|bank| bank.first_slot <= slot);
    let bank = behind.checked_sub(1).and_then(|index| banks.get_mut(index));
    let Some(bank) = bank.filter(|bank| slot < bank.first_slot + bank.slots) else { return };
    let pin = (slot - bank.first_slot) % bank.block_type.slots();
    if let Stepping::Many(many) = &mut bank.stepping
        && many.step.is_some()
        && many.sharing != Sharing::Unknown
        && pin < bank.block_type.inputs.len()
        && many.depends_on(pin)
    {
        many.sharing = Sharing::Unknown;
        *unchecked += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orders::{AtEnd, Order, Store, Work};
    use crate::{Plan, Rules, Source};

    fn engine() -> TaskEngine {
        let text = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n[[block]]\n\
                    name = \"ramp\"\ntype = \"LimRateOfChangeCI\"\ncount = 20\n\
                    in = { value = 25.0, setChangeRate = 10.0 }\n";
        let plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
        TaskEngine::build(&plan).unwrap().remove(0)
    }

    fn sharing(engine: &TaskEngine) -> Sharing {
        let Stepping::Many(many) = &engine.banks[0].stepping else { panic!("20 are many") };
        many.sharing
    }

    fn apply(engine: &mut TaskEngine, work: Work) {
        engine.apply(&mut Order::new(None, work), 1, 0);
    }

    fn set(engine: &mut TaskEngine, slot: usize, value: f64) {
        let stores = [Store::new(slot, value)].into();
        apply(engine, Work::Set { feeds: [].into(), stores });
    }

    /// Slots of `ramp.1`.
    const VALUE: usize = 9;
    const RATE: usize = 10;

    #[test]
    fn instances_share_their_inputs_until_one_has_another_and_again_when_it_has_the_same() {
        let mut engine = engine();
        assert_eq!(sharing(&engine), Sharing::Yes);
        set(&mut engine, VALUE, 7.0);
        assert_eq!(sharing(&engine), Sharing::Yes, "each has its own");
        for (rate, found) in [(11.0, Sharing::No), (10.0, Sharing::Yes)] {
            set(&mut engine, RATE, rate);
            assert_eq!(sharing(&engine), Sharing::Unknown);
            engine.step(1);
            assert_eq!(sharing(&engine), Sharing::Unknown, "only the slack checks it");
            engine.maintain();
            assert_eq!((sharing(&engine), engine.unchecked), (found, 0));
        }
    }

    #[test]
    fn a_forced_input_is_shared_by_no_bank_until_its_force_ends() {
        let mut engine = engine();
        let forces = [SlotForce::new(RATE as u32, AtEnd::Restore, [].into())].into();
        let stores = [Store::new(RATE, 10.0)].into();
        apply(&mut engine, Work::Force { stores, forces, cycles: Some(5) });
        engine.maintain();
        assert_eq!(sharing(&engine), Sharing::No, "even at the value of the others");
        engine.expire(6, |_| ());
        engine.maintain();
        assert_eq!((sharing(&engine), engine.unchecked), (Sharing::Yes, 0));
    }

    #[test]
    fn a_loaded_image_is_checked_in_the_slack() {
        let mut engine = engine();
        let mut words = vec![0.0; engine.state_words()];
        engine.copy_words(&mut words);
        engine.load_words(1, &words);
        assert_eq!((sharing(&engine), engine.unchecked), (Sharing::Unknown, 1));
        engine.maintain();
        assert_eq!((sharing(&engine), engine.unchecked), (Sharing::Yes, 0));
    }
}
