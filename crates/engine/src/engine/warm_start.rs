//! Starting a task where another run of it has ended.

use std::collections::HashMap;

use isochrone_blocks::BlockType;

use super::parcel::NO_CYCLE;
use super::{CarriedInstance, CopySpan, TaskEngine, TaskState};
use crate::orders::Store;
use crate::plan::{AlarmPlan, InputPart, TaskPlan};

/// What a task took over from a retained state.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct WarmStart {
    /// Blocks that go on where they stood.
    pub blocks: usize,
    /// Alarms that do.
    pub alarms: usize,
    /// Inputs that begin with their last value, by their index in the plan, and that value.
    pub inputs: Vec<(usize, f64)>,
    /// Blocks and inputs of the state that the task does not have, or has with another type.
    pub unmatched: Vec<String>,
    /// Alarms that begin anew, as their definition is another one.
    pub edited: Vec<String>,
    /// The number of the first cycle.
    pub first_cycle: u64,
}

/// A block in a retained state.
struct Place<'a> {
    block_type: BlockType,
    /// Its definition, if it is an alarm.
    alarm: Option<&'a AlarmPlan>,
    first_slot: usize,
    first_word: usize,
}

impl TaskEngine {
    /// Takes over what the blocks and inputs of the same name and type had in `state`, which is of the plan `old`:
    /// private state, outputs, and last input values, which are not `ok`. Parameters and variables keep the values of
    /// this engine's plan. Before the first cycle; allocates.
    pub fn warm_start(&mut self, new: &TaskPlan, old: &TaskPlan, state: &TaskState) -> WarmStart {
        let mut places = places(old);
        let alarms = alarms(new);
        let mut done = WarmStart::default();
        let periods_ns = [old, new].map(|plan| plan.settings.period_ns);
        let mut word = 0;
        for bank in &new.banks {
            let stride = bank.block_type.slots();
            for (index, name) in bank.instances.iter().enumerate() {
                let (slot, own_word) = (bank.first_slot + index * stride, word);
                word += bank.block_type.state_words;
                let carried = |place: &Place<'_>| {
                    let is_same = is_same_alarm(alarms.get(name.as_str()).copied(), place.alarm);
                    CarriedInstance::of(&place.block_type, &bank.block_type).filter(|_| is_same)
                };
                let Some(carried) = places.get(name.as_str()).and_then(carried) else { continue };
                let Some(place) = places.remove(name.as_str()) else { continue };
                for CopySpan { from, to, len } in carried.outputs {
                    let (from, to) = (place.first_slot + from, slot + to);
                    take_over(&state.image, from, &mut self.image, to, len);
                }
                for CopySpan { from, to, len } in carried.words {
                    let (from, to) = (place.first_word + from, own_word + to);
                    take_over(&state.state, from, &mut self.state, to, len);
                }
                if let Some(cycle) = state.cycle
                    && periods_ns[0] != periods_ns[1]
                    && let Some(words) = self.state.get_mut(own_word..word)
                {
                    bank.block_type.change_period(words, cycle, periods_ns);
                }
                let count = if place.alarm.is_some() { &mut done.alarms } else { &mut done.blocks };
                *count += 1;
            }
        }
        for (index, input) in old.inputs.iter().enumerate() {
            let like = new.inputs.iter().position(|own| {
                (&own.name, own.value_type, &own.unit)
                    == (&input.name, input.value_type, &input.unit)
            });
            let Some(own) = like else {
                done.unmatched.push(input.name.clone());
                continue;
            };
            let part = InputPart::Value;
            let (from, to) = (old.input_slot(index, part), new.input_slot(own, part));
            let (Some(read), Some(slot)) = (state.image.get(from), self.image.get_mut(to)) else {
                continue;
            };
            if read.to_bits() == input.default.to_bits() {
                // It read its default, which may have been edited.
                continue;
            }
            *slot = *read;
            done.inputs.push((own, *read));
        }
        for (name, place) in places {
            let is_edited = place.alarm.is_some() && alarms.contains_key(name);
            let names = if is_edited { &mut done.edited } else { &mut done.unmatched };
            names.push(name.to_owned());
        }
        done.unmatched.sort_unstable();
        done.edited.sort_unstable();
        self.cycle = state.cycle.unwrap_or(self.cycle);
        done.first_cycle = state.cycle.map_or(0, |cycle| cycle.saturating_add(1));
        // Tasks that read them find the last values with their first cycle.
        self.publish();
        done
    }
}

impl TaskEngine {
    /// Has tasks that read this one find these values with their first cycle, although it takes them only with its own;
    /// nothing, if it does not go on from an earlier run. Before its first cycle; allocates.
    pub fn publish_with(&mut self, stores: &[Store]) {
        if self.cycle == NO_CYCLE {
            return;
        }
        let before = self.exchange(stores);
        self.publish();
        self.exchange(&before);
    }

    /// Writes values into the image; returns those that stood there.
    fn exchange(&mut self, stores: &[Store]) -> Vec<Store> {
        let exchanged = |store: &Store| {
            let place = self.image.get_mut(store.slot as usize)?;
            Some(Store::new(store.slot as usize, std::mem::replace(place, store.value)))
        };
        stores.iter().filter_map(exchanged).collect()
    }
}

/// The blocks of a task by their names.
fn places(plan: &TaskPlan) -> HashMap<&str, Place<'_>> {
    let alarms = alarms(plan);
    let mut first_word = 0;
    let mut places = HashMap::new();
    for bank in &plan.banks {
        let block_type = bank.block_type;
        for (index, name) in bank.instances.iter().enumerate() {
            let first_slot = bank.first_slot + index * block_type.slots();
            let alarm = alarms.get(name.as_str()).copied();
            places.insert(name.as_str(), Place { block_type, alarm, first_slot, first_word });
            first_word += block_type.state_words;
        }
    }
    places
}

/// The alarms of a task by their names.
fn alarms(plan: &TaskPlan) -> HashMap<&str, &AlarmPlan> {
    plan.alarms.iter().map(|alarm| (alarm.name.as_str(), alarm)).collect()
}

/// Whether two blocks of one name are the same alarm, or both none: the state of another condition says nothing.
fn is_same_alarm(new: Option<&AlarmPlan>, old: Option<&AlarmPlan>) -> bool {
    match (new, old) {
        (Some(new), Some(old)) => new.has_definition_of(old),
        (new, old) => new.is_none() && old.is_none(),
    }
}

/// Copies words that are in both; where one of them is too short, nothing.
fn take_over<T: Copy>(from: &[T], at: usize, to: &mut [T], place: usize, len: usize) {
    let words = from.get(at..at.saturating_add(len));
    let own = to.get_mut(place..place.saturating_add(len));
    if let (Some(words), Some(own)) = (words, own) {
        own.copy_from_slice(words);
    }
}
