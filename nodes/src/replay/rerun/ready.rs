//! The check that a cycle can be repeated: what it read of other tasks must be there.

use crate::replay::operations::Operations;
use crate::replay::task::{ParcelSearch, Places, Row, Task};

/// The values to hand to a task before a cycle: which task they are of, their index, and their cycle.
pub(super) type Hand = (usize, usize, (u64, u64));

/// Whether a cycle can be repeated.
pub(super) enum Ready {
    Yes(Vec<Hand>),
    /// The values that it waited for have just arrived.
    Soon,
    /// Rows of other tasks come first.
    NotYet,
    /// It never can be; why.
    Never(String),
}

/// Whether the next cycle of a task has everything that it read of other tasks.
pub(super) fn ready(
    tasks: &mut [Task],
    operations: &mut Operations,
    is_other: bool,
    (index, places): (usize, &Places),
    is_end: bool,
) -> Ready {
    let Some((task, row)) = tasks.get(index).and_then(|task| Some((task, task.rows.front()?)))
    else {
        return Ready::NotYet;
    };
    let (mut hands, mut ahead) = (Vec::new(), Vec::new());
    for &(from, place) in &places.wires {
        let Some(source) = tasks.get(from) else { continue };
        let past = source.past.get(&index);
        let cannot = |cycle: u64| {
            let name = &source.name;
            Ready::Never(format!(
                "it reads cycle {cycle} of task \"{name}\", which cannot be repeated"
            ))
        };
        let Some(place) = place else {
            let next = source.rows.front();
            let is_past = |next: &Row| next.head.end_ns > row.head.start_ns;
            if !next.map_or(is_end || source.broken.is_some(), is_past) {
                return Ready::NotYet;
            }
            if let (None, Some(broken)) = (next, &source.broken) {
                return cannot(broken.cycle);
            }
            let found = past.and_then(|past| past.find_at(row.head.start_ns));
            hands.extend(found.map(|place| (from, place, (u64::MAX, 0))));
            continue;
        };
        let cycle = row.value(place);
        if cycle.is_nan() {
            continue;
        }
        let read = (cycle as u64, row.value(place + 1) as u64);
        if task.read.get(&from) == Some(&read) {
            continue;
        }
        let changes = (!is_other).then_some(read.1);
        // After its last cycle before another configuration, a task gives its values in the new wires.
        let is_ahead = changes == Some(source.changes + 1)
            && source.last.is_some_and(|last| last.cycle == read.0)
            && !source.is_handed_over();
        if is_ahead {
            ahead.push(from);
        }
        match past.map_or(ParcelSearch::Later, |past| past.find(read.0, changes)) {
            ParcelSearch::Here(place) => hands.push((from, place, read)),
            ParcelSearch::Later if is_ahead => {}
            ParcelSearch::Later if source.broken.is_none() => return Ready::NotYet,
            ParcelSearch::Later | ParcelSearch::Never => return cannot(read.0),
        }
    }
    if ahead.is_empty() {
        return Ready::Yes(hands);
    }
    let mut ready = Ready::NotYet;
    for from in ahead {
        let Some(source) = tasks.get_mut(from) else { continue };
        source.hand_over(operations, from);
        if source.is_handed_over() {
            ready = Ready::Soon;
        }
    }
    ready
}
