//! Waiting for what happens in its own time.

use std::fmt::Display;
use std::io::Write;
use std::thread;
use std::time::{Duration, Instant};

/// Longer than anything that a test waits for takes on a machine that is busy with other things.
pub const PATIENCE: Duration = Duration::from_secs(180);

/// Between two looks.
const LOOK_INTERVAL: Duration = Duration::from_millis(2);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// Polls a condition, sleeping between attempts.
#[track_caller]
pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    wait_for_some(what, || is_so().then_some(()));
}

/// Polls for a value, sleeping between attempts.
#[track_caller]
pub fn wait_for_some<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    wait_for_ok(what, || look().ok_or("timed out"))
}

/// As [`wait_for_some`]. Each failed attempt returns what it saw; a timeout reports the last.
#[track_caller]
pub fn wait_for_ok<T, E: Display>(what: &str, mut look: impl FnMut() -> Result<T, E>) -> T {
    let since = Instant::now();
    loop {
        let looked = Instant::now();
        match look() {
            Ok(found) => return found,
            Err(seen) => assert!(since.elapsed() < PATIENCE, "waited until {what}: {seen}"),
        }
        // Expensive checks, such as running a program, use at most half a CPU.
        thread::sleep(looked.elapsed().clamp(LOOK_INTERVAL, LONGEST_PAUSE));
    }
}

/// Says that this machine lacks what a test needs. It goes past the test harness, which keeps what
/// tests that pass print to itself.
pub fn not_tested(what: &str, why: &str) {
    let _ = writeln!(std::io::stderr(), "NOT TESTED: {what}: {why}");
}
