//! Pages of results that do not fit into one answer.

use isochrone_control::Room;

/// How many items to skip, and how many to return at most.
pub(super) fn page(offset: Option<u64>, limit: Option<u64>) -> (usize, usize) {
    let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
    (count(offset.unwrap_or_default()), count(limit.unwrap_or(u64::MAX)))
}

/// The first items, as many as fit into an answer.
pub(super) fn fitting<T: serde::Serialize>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut room = Room::of_answer();
    items.take_while(|item| room.takes(item)).collect()
}
