//! What a program inherits from the test that starts it.
#![allow(unsafe_code)]

use std::os::unix::process::CommandExt;
use std::process::Command;

/// Starts the program of `command` as a shell in a terminal would: with SIGINT and SIGHUP as they are by default,
/// even if this test runs under `nohup` or in the background of a script, and with no files but its standard
/// streams. iceoryx2 opens files that programs inherit, and other tests in this process have many of them.
pub fn afresh(command: &mut Command) -> &mut Command {
    let set_up = || {
        for signal in [libc::SIGINT, libc::SIGHUP] {
            // SAFETY: sets the disposition of a signal that exists, in a process that has one thread.
            unsafe { libc::signal(signal, libc::SIG_DFL) };
        }
        // A kernel without the call (before 5.11) leaves the files open, as if this were not here.
        // SAFETY: the call takes three integers, marks files to be closed by exec, and closes none now.
        unsafe { libc::syscall(libc::SYS_close_range, 3, u32::MAX, libc::CLOSE_RANGE_CLOEXEC) };
        Ok(())
    };
    // SAFETY: between fork and exec `set_up` makes two kinds of system call that are safe in a signal handler; it
    // allocates nothing, takes no lock, and touches no memory of the parent.
    unsafe { command.pre_exec(set_up) }
}
