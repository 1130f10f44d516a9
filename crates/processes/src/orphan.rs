//! Ending with the program that started this one.

use std::process::Command;

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

/// Tells a program by whom it was started.
const PARENT: &str = "ISOCHRONE_PARENT_PID";

/// Lets a program of isochrone know that it is to end with this one.
///
/// The kernel could be told between fork and exec. But what forks here may have its memory locked and
/// real-time threads at work, and each of its pages would fault once more afterwards.
pub(crate) fn tell(command: &mut Command) {
    command.env(PARENT, std::process::id().to_string());
}

/// Makes the kernel send SIGTERM to this process when the thread that started it as a
/// [`Child`](crate::Child) ends, for example because its program was killed. Does nothing in a process
/// that was started otherwise. Call it first in `main`.
pub fn end_with_parent() {
    let told = std::env::var(PARENT).ok().and_then(|pid| Pid::from_raw(pid.parse().ok()?));
    if told.is_none() || told != getppid() {
        return;
    }
    let asked = set_parent_process_death_signal(Some(Signal::TERM));
    // It may have been killed meanwhile.
    if asked.is_ok() && told != getppid() {
        let _ = rustix::process::kill_process(rustix::process::getpid(), Signal::TERM);
    }
}
