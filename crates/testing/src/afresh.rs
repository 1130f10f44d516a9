//! A fresh start for programs: what they would inherit from the test is reset.
#![allow(unsafe_code)]

use std::os::unix::process::CommandExt;
use std::process::Command;
use std::ptr;

/// Starts the program of `command` as a shell in a terminal would: with signals unblocked and as they are by
/// default, even if this test runs under `nohup` or in the background of a script, and with no files but its
/// standard streams. iceoryx2 opens files that programs inherit, and other tests in this process have many.
pub fn afresh(command: &mut Command) -> &mut Command {
    let set_up = || {
        take_signals();
        close_files_on_exec();
        Ok(())
    };
    // SAFETY: between fork and exec `set_up` only makes calls that are safe in a signal handler; it allocates
    // nothing, takes no lock, and touches no memory of the parent.
    unsafe { command.pre_exec(set_up) }
}

fn take_signals() {
    for signal in [libc::SIGHUP, libc::SIGINT, libc::SIGQUIT, libc::SIGTERM] {
        // SAFETY: sets the disposition of a signal that exists, in a process that has one thread.
        unsafe { libc::signal(signal, libc::SIG_DFL) };
    }
    // SAFETY: an all-zero set is a valid one, which `sigemptyset` then initialises; the old mask is not asked for.
    unsafe {
        let mut none = std::mem::zeroed();
        libc::sigemptyset(&mut none);
        libc::sigprocmask(libc::SIG_SETMASK, &none, ptr::null_mut());
    }
}

fn close_files_on_exec() {
    /// As many files as a test process opens, where the kernel cannot close all at once (before 5.11).
    const MOST_FILES: i32 = 4096;
    // SAFETY: the call takes three integers, marks files to be closed by exec, and closes none now.
    let marked =
        unsafe { libc::syscall(libc::SYS_close_range, 3, u32::MAX, libc::CLOSE_RANGE_CLOEXEC) };
    if marked != 0 {
        for file in 3..MOST_FILES {
            // SAFETY: sets a flag of a file if it is open, and else fails.
            unsafe { libc::fcntl(file, libc::F_SETFD, libc::FD_CLOEXEC) };
        }
    }
}
