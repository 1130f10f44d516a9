//! Ending with the program that started this one.

use std::ffi::OsStr;
use std::io::{self, Write};
use std::os::unix::process::CommandExt;
use std::process::{self, Command};

use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

/// The variable that names the process that started a program.
const PARENT: &str = "ISOCHRONE_PARENT_PID";

/// The variable that makes an isochrone program become another one.
const BECOMES: &str = "ISOCHRONE_BECOMES_ARGUMENTS";
/// This program, also where an upgrade has removed or replaced its file since it was started.
const OWN_PROGRAM: &str = "/proc/self/exe";
/// The exit status of shells if a program cannot be run.
const CANNOT_RUN: i32 = 126;

/// Makes an isochrone program end with this one.
///
/// The kernel could be told between fork and exec. But what forks here may have its memory locked and
/// real-time threads at work, and each of its pages would fault once more afterwards.
pub(crate) fn tell(command: &mut Command) {
    command.env(PARENT, process::id().to_string());
}

/// A command that runs a program of another make, which ends when this one is killed as one of isochrone
/// does: this program is started again, asks the kernel for that, and becomes the other.
pub(crate) fn bound(program: &OsStr) -> Command {
    let mut command = Command::new(OWN_PROGRAM);
    command.arg(program).env(BECOMES, "1");
    command
}

/// Makes the kernel send SIGTERM to this process when the thread that started it as a
/// [`Child`](crate::Child) ends, for example because its program was killed. Does nothing in a process
/// that was started otherwise. Call it first in `main`: for [`Child::start_bound`](crate::Child::start_bound)
/// this program becomes another one here.
pub fn end_with_parent() {
    let parent = std::env::var(PARENT).ok().and_then(|pid| Pid::from_raw(pid.parse().ok()?));
    if parent.is_none() || parent != getppid() {
        return;
    }
    let asked = set_parent_process_death_signal(Some(Signal::TERM));
    // It may have been killed meanwhile.
    if asked.is_ok() && parent != getppid() {
        let _ = rustix::process::kill_process(rustix::process::getpid(), Signal::TERM);
    }
    if std::env::var_os(BECOMES).is_some() {
        become_program();
    }
}

/// Becomes the program that the arguments name. The request to the kernel survives that.
fn become_program() -> ! {
    let mut arguments = std::env::args_os().skip(1);
    let program = arguments.next().unwrap_or_default();
    let cause =
        Command::new(&program).args(arguments).env_remove(PARENT).env_remove(BECOMES).exec();
    // The program that started it reads that.
    let _ = writeln!(io::stderr(), "cannot run {}: {cause}", program.display());
    process::exit(CANNOT_RUN);
}
