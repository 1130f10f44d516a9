//! Which frames, and which values for other tasks, a force acts on.

use crate::plan::WirePlan;

use super::signals::Signals;

impl Signals {
    /// What is computed from a slot of a task, in this cycle or a later one: the indexes of outputs,
    /// then of values for other tasks.
    pub(super) fn taints(&self, task: usize, slot: usize) -> Box<[u32]> {
        let Some(found) = self.task(task) else { return [].into() };
        let mut tainted = Slots::new(found.slots);
        tainted.insert(slot);
        let is_input_pin = self.outputs_of(task, slot).is_some_and(|outputs| slot < outputs.start);
        if is_input_pin {
            self.outputs_of(task, slot).into_iter().flatten().for_each(|slot| tainted.insert(slot));
        }
        // Wires lead forward, but for those of the cycle before: until a pass finds nothing new.
        let mut has_news = true;
        while has_news {
            has_news = false;
            for wire in &found.wires {
                has_news |= self.follow(task, wire, &mut tainted);
            }
        }
        let given = found.published.slots.iter();
        let mut taints: Vec<u32> =
            given.filter(|(slot, _)| tainted.contains(*slot as usize)).map(|(_, of)| *of).collect();
        taints.sort_unstable();
        taints.dedup();
        taints.into()
    }

    /// Whether a wire brings the taint to an instance that did not have it.
    fn follow(&self, task: usize, wire: &WirePlan, tainted: &mut Slots) -> bool {
        if !tainted.contains(wire.from as usize) || tainted.contains(wire.to as usize) {
            return false;
        }
        tainted.insert(wire.to as usize);
        for slot in self.outputs_of(task, wire.to as usize).into_iter().flatten() {
            tainted.insert(slot);
        }
        true
    }
}

/// A set of slots, one bit for each.
struct Slots(Vec<u64>);

impl Slots {
    fn new(slots: usize) -> Self {
        Self(vec![0; slots.div_ceil(64)])
    }

    fn insert(&mut self, slot: usize) {
        if let Some(word) = self.0.get_mut(slot / 64) {
            *word |= 1 << (slot % 64);
        }
    }

    fn contains(&self, slot: usize) -> bool {
        self.0.get(slot / 64).is_some_and(|word| word >> (slot % 64) & 1 == 1)
    }
}
