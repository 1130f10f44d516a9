//! Clients that left behind something that a server's port can never release.

use std::fs;
use std::time::{Duration, Instant};

/// If the memory map cannot tell, this many departures count as one that left something behind.
const MANY: usize = 64;
/// From here on a port is to be replaced even while it is used. iceoryx2 has room for 128, and panics
/// when there are more and a client leaves whose request is still held.
const TOO_MANY: usize = 112;
/// Between two looks into the memory map.
const PAUSE: Duration = Duration::from_secs(1);

/// Which clients have left since a port was opened.
///
/// A request of a client that is gone before it was received is lost in iceoryx2 0.10: it is taken out
/// of the connection and never handed back, so the connection stays, and the client's memory with it.
/// Nobody can see that from outside but in the process's memory map.
#[derive(Debug, Default)]
pub(super) struct Departures {
    present: Vec<u128>,
    left: Vec<u128>,
    not_before: Option<Instant>,
}

/// Whether a port must be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Burden {
    /// No.
    None,
    /// As soon as it is unused.
    Light,
    /// Even while it is used.
    Heavy,
}

impl Departures {
    /// Records the present clients.
    pub(super) fn note(&mut self, present: Vec<u128>) {
        let left = self.present.iter().filter(|client| !present.contains(client));
        self.left.extend(left);
        self.present = present;
    }

    /// Whether clients left something behind. Looks into the memory map, at most once a second.
    pub(super) fn burden(&mut self, crosses_processes: bool) -> Burden {
        let now = Instant::now();
        let is_due = self.not_before.is_none_or(|instant| instant <= now);
        if self.left.is_empty() || !(is_due || self.left.len() >= TOO_MANY) {
            return Burden::None;
        }
        self.not_before = now.checked_add(PAUSE);
        let map = if crosses_processes { fs::read_to_string("/proc/self/maps").ok() } else { None };
        let is_known = map.is_some();
        if let Some(map) = map {
            self.left.retain(|client| map.contains(&format!("_{client}.")));
        }
        match self.left.len() {
            0 => Burden::None,
            TOO_MANY.. => Burden::Heavy,
            MANY.. => Burden::Light,
            _ if is_known => Burden::Light,
            _ => Burden::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_those_that_left_count_and_of_them_only_those_whose_memory_is_still_mapped() {
        let mut departures = Departures::default();
        let mut burden = |present: std::ops::Range<u128>, crosses_processes| {
            departures.note(present.collect());
            departures.not_before = None;
            departures.burden(crosses_processes)
        };
        assert_eq!(burden(0..200, false), Burden::None);
        assert_eq!(burden(50..200, false), Burden::None);
        assert_eq!(burden(100..200, false), Burden::Light);
        assert_eq!(burden(200..200, false), Burden::Heavy);
        assert_eq!(burden(200..200, true), Burden::None, "nothing is mapped here");
    }
}
