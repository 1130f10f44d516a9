//! Which outputs, and which values for other tasks, depend on a forced signal.

use std::ops::Range;

use isochrone_engine::orders::{AtEnd, SlotForce, Store, Work};
use isochrone_model::Role;

use super::signals::Signals;

impl Signals {
    /// The work of an order that forces values in a task, given by slot in ascending order.
    pub(super) fn force(&self, task: usize, stores: Box<[Store]>, cycles: Option<u64>) -> Work {
        let slots: Vec<usize> = stores.iter().map(|store| store.slot as usize).collect();
        let forces = self.slot_forces(task, &slots);
        Work::Force { stores, forces, cycles }
    }

    /// A force for each of these slots of a task.
    pub(super) fn slot_forces(&self, task: usize, slots: &[usize]) -> Box<[SlotForce]> {
        let force = |(&slot, taints): (&usize, Box<[u32]>)| {
            let at_end = match self.at(task, slot).map(|signal| signal.role) {
                Some(Role::Wired | Role::Output) => AtEnd::Recompute,
                Some(Role::Input | Role::Variable | Role::Parameter | Role::Ok | Role::Age)
                | None => AtEnd::Restore,
            };
            SlotForce::new(slot as u32, at_end, taints)
        };
        slots.iter().zip(self.taints(task, slots)).map(force).collect()
    }
}

/// A wire between reached slots, by their index among those.
struct Step {
    from: usize,
    to: usize,
    /// Of the instance that it leads to.
    outputs: Range<usize>,
}

impl Signals {
    /// For each of these slots of a task, what is computed from it, in this cycle or a later one: the indices of
    /// outputs, then of values for other tasks.
    ///
    /// The wires are visited a few times for all slots together, and those that are reached once more for every 64
    /// slots.
    fn taints(&self, task: usize, slots: &[usize]) -> Vec<Box<[u32]>> {
        let Some(found) = self.task(task) else {
            return slots.iter().map(|_| [].into()).collect();
        };
        let reached = Places::of(self.reached(task, slots));
        let steps: Vec<Step> = found
            .wires
            .iter()
            .filter_map(|wire| {
                let from = reached.place(wire.from as usize)?;
                let to = wire.to as usize;
                let outputs = reached.range(self.outputs_of(task, to));
                Some(Step { from, to: reached.place(to)?, outputs })
            })
            .collect();
        let given: Vec<(usize, u32)> = found
            .published
            .slots
            .iter()
            .filter_map(|(slot, of)| Some((reached.place(*slot as usize)?, *of)))
            .collect();
        let mut taints = Vec::with_capacity(slots.len());
        for some in slots.chunks(u64::BITS as usize) {
            let marks = self.marks(task, some, &reached, &steps);
            for index in 0..some.len() {
                let is_its = |place: usize| marks.get(place).is_some_and(|m| m >> index & 1 == 1);
                let tainted = given.iter().filter(|(place, _)| is_its(*place));
                let mut tainted: Vec<u32> = tainted.map(|(_, of)| *of).collect();
                tainted.sort_unstable();
                tainted.dedup();
                taints.push(tainted.into());
            }
        }
        taints
    }

    /// These slots and all slots that any of them affects.
    fn reached(&self, task: usize, slots: &[usize]) -> Slots {
        let wires = self.task(task).map_or(&[][..], |found| &found.wires);
        let mut reached = Slots::new(self.task(task).map_or(0, |found| found.slots));
        for &slot in slots {
            reached.insert(slot);
            self.own_outputs(task, slot).for_each(|slot| reached.insert(slot));
        }
        // Wires lead forward, except those of the previous cycle, so passes repeat until one finds nothing new.
        let mut has_news = true;
        while has_news {
            has_news = false;
            for wire in wires {
                let (from, to) = (wire.from as usize, wire.to as usize);
                if !reached.contains(from) || reached.contains(to) {
                    continue;
                }
                has_news = true;
                reached.insert(to);
                let outputs = self.outputs_of(task, to).into_iter().flatten();
                outputs.for_each(|slot| reached.insert(slot));
            }
        }
        reached
    }

    /// For each reached slot, which of at most 64 slots affect it: one bit for each.
    fn marks(&self, task: usize, slots: &[usize], reached: &Places, steps: &[Step]) -> Vec<u64> {
        let mut marks = vec![0; reached.count];
        for (index, &slot) in slots.iter().enumerate() {
            for slot in self.own_outputs(task, slot).chain([slot]) {
                mark(&mut marks, reached.place(slot), 1 << index);
            }
        }
        let mut has_news = true;
        while has_news {
            has_news = false;
            for Step { from, to, outputs } in steps {
                let [from, known] = [from, to].map(|at| marks.get(*at).copied().unwrap_or(0));
                let news = from & !known;
                if news != 0 {
                    has_news = true;
                    outputs.clone().chain([*to]).for_each(|at| mark(&mut marks, Some(at), news));
                }
            }
        }
        marks
    }

    /// Of an input pin, the slots of its instance's outputs.
    fn own_outputs(&self, task: usize, slot: usize) -> Range<usize> {
        self.outputs_of(task, slot).filter(|outputs| slot < outputs.start).unwrap_or_default()
    }
}

fn mark(marks: &mut [u64], place: Option<usize>, bits: u64) {
    if let Some(mark) = place.and_then(|place| marks.get_mut(place)) {
        *mark |= bits;
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

/// A set of slots, each with its index in order.
struct Places {
    slots: Slots,
    /// How many slots there are before each word of the set.
    before: Vec<usize>,
    count: usize,
}

impl Places {
    fn of(slots: Slots) -> Self {
        let mut count = 0;
        let before = slots.0.iter().map(|word| {
            let before = count;
            count += word.count_ones() as usize;
            before
        });
        let before = before.collect();
        Self { slots, before, count }
    }

    fn place(&self, slot: usize) -> Option<usize> {
        let word = self.slots.0.get(slot / 64)?;
        let below = word & ((1 << (slot % 64)) - 1);
        let before = self.before.get(slot / 64)?;
        self.slots.contains(slot).then(|| before + below.count_ones() as usize)
    }

    /// The indices of consecutive slots that are all in the set; empty otherwise.
    fn range(&self, slots: Option<Range<usize>>) -> Range<usize> {
        let first = slots.as_ref().and_then(|slots| self.place(slots.start));
        first.zip(slots).map_or(0..0, |(first, slots)| first..first + slots.len())
    }
}
