//! Waiting between attempts at what fails only for a moment.

use std::hash::{BuildHasher, RandomState};
use std::time::Duration;

use crate::exhausted;

const FIRST_PAUSE: Duration = Duration::from_millis(2);
const LONGEST_PAUSE: Duration = Duration::from_millis(100);
const ATTEMPTS: u32 = 12;

/// Doubling pauses of about 2 ms to 100 ms, 0.7 s in all.
pub(crate) struct Backoff {
    left: u32,
    pause: Duration,
}

impl Backoff {
    pub(crate) fn new() -> Self {
        Self { left: ATTEMPTS, pause: FIRST_PAUSE }
    }

    /// Sleeps, then says whether another attempt is due. None is where this process lacks descriptors: others do
    /// not give it any by then, and a thread that also reads frames would lose them.
    pub(crate) fn try_again(&mut self) -> bool {
        if self.left == 0 || exhausted::descriptors().is_some() {
            return false;
        }
        self.left -= 1;
        // Those who collided once must not go on doing so: each pauses for another while. The
        // hasher's keys are the one source of chance in the standard library.
        let chance = RandomState::new().hash_one(()) % 8;
        std::thread::sleep(self.pause / 2 + self.pause * chance as u32 / 8);
        self.pause = (self.pause * 2).min(LONGEST_PAUSE);
        true
    }
}
