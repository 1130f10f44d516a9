//! What chance asks of a node.

use isochrone_blocks::PinType;
use proptest::prelude::*;

use crate::random::PUBLISHED;
use crate::random::table::{Kind, Reference, Row};
use isochrone_testing::graphs::{EntryChoice, entry_choice};

/// A value that a type has, by chance.
fn value(pin_type: PinType, choice: u16) -> f64 {
    let pick = |values: &[f64]| values[usize::from(choice) % values.len()];
    match pin_type {
        PinType::Lreal => pick(&[0.0, 1.0, -2.5, 10.0, 250.0, 1e6, f64::INFINITY]),
        PinType::Bool => pick(&[0.0, 1.0]),
        PinType::Int => pick(&[0.0, 1.0, -3.0, 35.0, 30_000.0]),
        PinType::Time => pick(&[0.0, 1.0, 50.0, -3.0]),
        PinType::Word => pick(&[0.0, 1.0, 32_769.0]),
    }
}

/// What is asked for before a step of a task: what, which signals and values, how long, when; and how
/// many cycles are skipped.
#[derive(Clone, Debug)]
pub(crate) struct Action {
    pub(crate) task: usize,
    pub(crate) what: u8,
    pub(crate) choices: Vec<(u16, u16)>,
    pub(crate) cycles: Option<u64>,
    pub(crate) ahead: Option<u64>,
    pub(crate) skipped: u64,
    pub(crate) edits: Vec<Edit>,
}

/// An edit of the configuration: where, how, and what is put there.
type Edit = (u16, u8, EntryChoice);

/// A node's entries after edits.
pub(crate) fn edited(old: &[EntryChoice], edits: &[Edit]) -> Vec<EntryChoice> {
    let mut choices = old.to_vec();
    for (place, how, new) in edits {
        let place = usize::from(*place) % choices.len();
        match how % 6 {
            0 if place >= PUBLISHED => choices[place] = *new,
            1 => choices[place].3 = new.3,
            2 => {
                let pin = usize::from(new.4) % new.3.len();
                choices[place].3[pin] = new.3[pin];
            }
            3 => choices.push(*new),
            4 if choices.len() > PUBLISHED => drop(choices.pop()),
            5 if place >= PUBLISHED => choices[place].1 = new.1,
            _ => {}
        }
    }
    // An entry that changes its task would have one name in both for a while.
    choices.iter_mut().zip(old).for_each(|(new, old)| new.2 = old.2);
    choices
}

pub(crate) fn action() -> impl Strategy<Value = Action> {
    let choices = prop::collection::vec(any::<(u16, u16)>(), 1..4);
    let cycles = prop::option::of(1u64..6);
    let ahead = prop_oneof![3 => Just(None), 1 => (0u64..5).prop_map(Some)];
    let skipped = prop_oneof![4 => Just(0u64), 1 => 0u64..4];
    let edits = prop::collection::vec((any::<u16>(), any::<u8>(), entry_choice()), 1..4);
    (0usize..2, any::<u8>(), choices, cycles, ahead, skipped, edits).prop_map(
        |(task, what, choices, cycles, ahead, skipped, edits)| Action {
            task,
            what,
            choices,
            cycles,
            ahead,
            skipped,
            edits,
        },
    )
}

/// The signals of a task and of some kinds that chance has chosen, each with a value.
pub(crate) fn chosen(
    reference: &Reference,
    action: &Action,
    kinds: &[Kind],
) -> Vec<(String, PinType, f64)> {
    let rows = reference.rows(action.task).iter();
    let candidates: Vec<&Row> = rows.filter(|row| kinds.contains(&row.kind)).collect();
    let mut chosen: Vec<(String, PinType, f64)> = Vec::new();
    for (which, choice) in action.choices.iter().filter(|_| !candidates.is_empty()) {
        let Row { name, pin_type, .. } = candidates[usize::from(*which) % candidates.len()];
        if chosen.iter().all(|(known, ..)| known != name) {
            chosen.push((name.clone(), *pin_type, value(*pin_type, *choice)));
        }
    }
    chosen
}
