//! Signal dispositions that `ctrlc` does not handle: it takes over signals that the program was started to ignore,
//! leaves SIGTERM blocked if the parent blocks it, and does not know SIGXFSZ.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;
use std::ptr;

use libc::{c_int, sighandler_t, sigset_t};

/// Runs `handle`, which sets handlers of SIGINT, SIGTERM and SIGHUP. Afterwards SIGINT and SIGHUP are ignored if they
/// were before, as under `nohup`, and SIGTERM is unblocked in this thread.
pub(crate) fn with_ignored_kept<R>(handle: impl FnOnce() -> R) -> R {
    let ignored: Vec<c_int> = [libc::SIGINT, libc::SIGHUP].into_iter().filter(is_ignored).collect();
    // Blocked until they are ignored again, which discards any that arrived.
    change_mask(libc::SIG_BLOCK, &ignored);
    let handled = handle();
    ignored.iter().for_each(|signal| set(*signal, libc::SIG_IGN));
    change_mask(libc::SIG_UNBLOCK, &ignored);
    // A signal that was sent while it was blocked arrives now, when it has a handler.
    change_mask(libc::SIG_UNBLOCK, &[libc::SIGTERM]);
    handled
}

/// Has SIGXFSZ do nothing in this program, and what it does by default in those that this one starts: a handler is
/// not inherited, an ignored signal is.
pub(crate) fn handle_file_limit() {
    extern "C" fn nothing(_: c_int) {}
    set(libc::SIGXFSZ, nothing as extern "C" fn(c_int) as sighandler_t);
}

fn is_ignored(signal: &c_int) -> bool {
    let mut action = MaybeUninit::<libc::sigaction>::uninit();
    // SAFETY: without a new action the call only writes the present one to `action`, which has room for it.
    let asked = unsafe { libc::sigaction(*signal, ptr::null(), action.as_mut_ptr()) };
    // SAFETY: the call succeeded, so it has written `action`.
    asked == 0 && unsafe { action.assume_init() }.sa_sigaction == libc::SIG_IGN
}

fn set(signal: c_int, handler: sighandler_t) {
    // SAFETY: `handler` is SIG_IGN or a function that does nothing, which is safe whatever it interrupts.
    unsafe { libc::signal(signal, handler) };
}

/// Blocks or unblocks signals in this thread.
fn change_mask(how: c_int, signals: &[c_int]) {
    let mut set = MaybeUninit::<sigset_t>::uninit();
    // SAFETY: `sigemptyset` initialises the set that the other calls work on; the old mask is not asked for.
    unsafe {
        libc::sigemptyset(set.as_mut_ptr());
        for signal in signals {
            libc::sigaddset(set.as_mut_ptr(), *signal);
        }
        libc::pthread_sigmask(how, set.as_ptr(), ptr::null_mut());
    }
}
