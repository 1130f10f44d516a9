//! Which banks have instances that share their inputs, as operators change them.

use super::many::Sharing;
use super::{Bank, Stepping, TaskEngine};
use crate::orders::{EndedForce, Forces, SlotForce};

/// Banks that are passed over in a cycle in search of one to check.
const LOOKED_AT: usize = 64;

impl Bank {
    /// Finds out whether its instances share their inputs.
    fn check_sharing(&mut self, image: &[f64], forces: &Forces) {
        let Stepping::Many(many) = &mut self.stepping else { return };
        let pins = self.block_type.slots();
        let slots = self.first_slot..self.first_slot + self.slots;
        let matters =
            |slot: usize| many.depends_on(&self.block_type, (slot - self.first_slot) % pins);
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
        && many.depends_on(&bank.block_type, pin)
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
