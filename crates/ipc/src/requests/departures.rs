//! Clients that left a server's port with something that the port can never let go of.

use std::fs;

/// From here on a port is to be replaced as soon as nobody uses it...
const MANY: usize = 64;
/// ... and from here on also while somebody does. iceoryx2 has room for 128, and panics when there are
/// more and a client leaves whose request is still held.
const TOO_MANY: usize = 112;

/// Which clients have left since a port was opened.
///
/// A request of a client that is gone before it was received is lost in iceoryx2 0.10: it is taken out
/// of the connection and never handed back, so the connection stays, and the client's memory with it.
/// Nobody can see that from outside but in the process's memory map.
#[derive(Debug, Default)]
pub(super) struct Departures {
    present: Vec<u128>,
    left: Vec<u128>,
}

/// Whether a port must be replaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Burden {
    Light,
    Heavy,
    TooHeavy,
}

impl Departures {
    /// Takes note of who is there.
    pub(super) fn note(&mut self, present: Vec<u128>) {
        let left = self.present.iter().filter(|client| !present.contains(client));
        self.left.extend(left);
        self.present = present;
    }

    /// How many clients may have left something behind. Looks into the memory map when there are many.
    pub(super) fn burden(&mut self, crosses_processes: bool) -> Burden {
        if self.left.len() >= MANY && crosses_processes {
            // Without the map all count.
            if let Ok(map) = fs::read_to_string("/proc/self/maps") {
                self.left.retain(|client| map.contains(&format!("_{client}.")));
            }
        }
        match self.left.len() {
            0..MANY => Burden::Light,
            MANY..TOO_MANY => Burden::Heavy,
            _ => Burden::TooHeavy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_those_that_left_count_and_of_them_only_those_whose_memory_is_still_mapped() {
        let mut departures = Departures::default();
        departures.note((0..200).collect());
        assert_eq!(departures.burden(false), Burden::Light);
        departures.note((100..200).collect());
        assert_eq!(departures.burden(false), Burden::Heavy);
        departures.note(Vec::new());
        assert_eq!(departures.burden(false), Burden::TooHeavy);
        assert_eq!(departures.burden(true), Burden::Light, "nothing is mapped here");
    }
}
