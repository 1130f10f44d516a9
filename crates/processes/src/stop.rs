//! Ending on a signal: Ctrl-C, SIGTERM and SIGHUP set a flag that every loop looks at, and the program
//! ends in order. One that hangs is ended by another signal.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::{dispositions, running};

/// Signals within this time are one request to end: `timeout` sends two, one to its program and one
/// to the group. To end at once on the second would kill the program while it removes its files.
const ONE_REQUEST: Duration = Duration::from_millis(500);

/// How long the last words of a program that hangs may take.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// Exit status of a program that did not end in order: something was wrong.
const NOT_IN_ORDER: i32 = 1;

/// The substitute for an instant that is too far off for the clock.
const FOR_EVER: Duration = Duration::from_secs(u32::MAX as u64);

/// Why a [`Stop`] cannot be created or keep time: what the system or the program refuses, and what to do about it.
#[derive(thiserror::Error)]
#[error("{0}")]
pub struct StopError(String);

impl StopError {
    /// The program has such a [`Stop`] already, or has called `ctrlc` itself.
    fn taken() -> Self {
        Self(
            "signals are handled already: call Stop::on_signal once, without ctrlc::set_handler, and clone what it \
             gives"
                .into(),
        )
    }

    /// The kernel does not take the handlers.
    fn no_handlers(cause: io::Error) -> Self {
        Self(format!("cannot handle SIGINT, SIGTERM and SIGHUP: {cause}"))
    }

    /// The thread that waits for signals or keeps the time cannot be started.
    fn no_thread(cause: io::Error) -> Self {
        Self(format!("cannot start a thread: {cause}; {}", isochrone_ipc::thread_remedy()))
    }
}

/// The flag of the program's signals.
static SIGNALLED: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Whether a signal has asked the program to end, for waits that have no [`Stop`] at hand.
pub fn is_asked_to_end() -> bool {
    SIGNALLED.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// Lets the program survive a limit of file sizes (`ulimit -f`): writes beyond it fail as on a full disk, instead of
/// SIGXFSZ killing the program. Programs that it starts have the default disposition of the signal.
pub fn outlive_file_limit() {
    dispositions::handle_file_limit();
}

/// The flag that ends the program, and the time at which it ends by itself.
#[derive(Debug, Clone)]
pub struct Stop {
    flag: Arc<AtomicBool>,
    end: Option<Instant>,
    /// The flag of the run that this is a part of.
    whole: Option<Arc<AtomicBool>>,
}

impl Stop {
    /// Sets the flag on SIGINT (Ctrl-C), SIGTERM and SIGHUP. Another signal, 500 ms later or more, ends
    /// the program at once, with exit status 1 and every [`Child`](crate::Child) of it; `last_words`
    /// is called before, in a thread that is given 100 ms: whatever the program hangs on may be stderr.
    ///
    /// SIGINT and SIGHUP that the program was started to ignore, as `nohup` does, stay ignored. SIGTERM
    /// ends it even if whoever started it blocks or ignores it.
    ///
    /// Call it before any thread is started, so that none has SIGTERM blocked. The signals have a handler
    /// rather than being blocked and waited for: a program that this one starts has them back as they
    /// are by default, and a tracer sees them. Also ends whatever waits for a domain's lock.
    ///
    /// **It replaces the handlers** of SIGINT, SIGTERM and SIGHUP that the program has by then: they are not called any
    /// more. Do not call it in a program that handles these signals itself; let its own handler end what it runs,
    /// nodes and every [`Child`](crate::Child).
    ///
    /// # Errors
    /// The kernel refuses a handler, a thread cannot be started, or signals are handled by an earlier call or by
    /// `ctrlc`.
    pub fn on_signal(last_words: impl Fn() + Send + Sync + 'static) -> Result<Self, StopError> {
        let flag = Arc::new(AtomicBool::new(false));
        if SIGNALLED.set(flag.clone()).is_err() {
            return Err(StopError::taken());
        }
        let signalled = flag.clone();
        let last_words = Arc::new(last_words);
        let mut first = None;
        // Called in a thread of its own for each signal.
        let request = move || {
            signalled.store(true, Ordering::Relaxed);
            if first.get_or_insert_with(Instant::now).elapsed() >= ONE_REQUEST {
                end_at_once(last_words.clone());
            }
        };
        dispositions::with_ignored_kept(|| ctrlc::set_handler(request)).map_err(refused)?;
        isochrone_ipc::interrupt_waiting_by(flag.clone());
        Ok(Self { flag, end: None, whole: None })
    }

    /// The same stop, due after `run` at the latest.
    #[must_use]
    pub fn after(self, run: Duration) -> Self {
        let now = Instant::now();
        let end = now.checked_add(run).unwrap_or(now + FOR_EVER);
        Self { end: Some(end), ..self }
    }

    /// A separate stop for a part of the run: due when this one is, after `run`, or on its own request,
    /// which does not affect this one.
    pub fn within(&self, run: Duration) -> Self {
        let end = Instant::now().checked_add(run);
        Self { flag: Arc::default(), end, whole: Some(self.flag.clone()) }
    }

    /// Sets the flag when the time is up even if nothing calls [`is_due`](Self::is_due): for loops that
    /// wait for a long time.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn keep_time(&self) -> Result<(), StopError> {
        let Some(end) = self.end else { return Ok(()) };
        let flag = self.flag();
        let wait = move || {
            thread::sleep(end.saturating_duration_since(Instant::now()));
            flag.store(true, Ordering::Relaxed);
        };
        start_thread("end", wait)
    }

    /// The flag, for loops that poll it.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.flag.clone()
    }

    /// Whether the program is to end; sets the flag if its time is up.
    pub fn is_due(&self) -> bool {
        let whole_is_due = self.whole.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        if whole_is_due || self.end.is_some_and(|end| Instant::now() >= end) {
            self.request();
        }
        self.flag.load(Ordering::Relaxed)
    }

    /// Sets the flag.
    pub fn request(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

/// Translates errors of `ctrlc`. Its one kind for system errors has an errno if the thread cannot be started, and
/// only words if the handler is refused.
fn refused(error: ctrlc::Error) -> StopError {
    match error {
        ctrlc::Error::MultipleHandlers => StopError::taken(),
        ctrlc::Error::System(cause) if cause.raw_os_error().is_some() => {
            StopError::no_thread(cause)
        }
        ctrlc::Error::System(cause) => StopError::no_handlers(cause),
        ctrlc::Error::NoSuchSignal(_) => StopError::no_handlers(io::Error::other(error)),
    }
}

fn start_thread(name: &str, run: impl FnOnce() + Send + 'static) -> Result<(), StopError> {
    let started = thread::Builder::new().name(name.into()).spawn(run);
    started.map(drop).map_err(StopError::no_thread)
}

/// Ends a program that hangs. Nothing is dropped on this way out.
fn end_at_once(last_words: Arc<impl Fn() + Send + Sync + 'static>) -> ! {
    running::ask_all_to_end();
    let since = Instant::now();
    let last_words = thread::Builder::new().spawn(move || last_words());
    let are_spoken = || last_words.as_ref().map_or(true, JoinHandle::is_finished);
    while !are_spoken() && since.elapsed() < LAST_WORDS {
        thread::sleep(Duration::from_millis(1));
    }
    std::process::exit(NOT_IN_ORDER);
}

isochrone_model::debug_as_display!(StopError);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_says_whether_a_thread_or_a_handler_is_refused() {
        let said = |error| refused(error).to_string();
        let no_thread = io::Error::from_raw_os_error(libc::EAGAIN);
        let no_thread = said(ctrlc::Error::System(no_thread));
        assert!(no_thread.starts_with("cannot start a thread: "), "{no_thread}");
        let no_handler = said(ctrlc::Error::System(io::Error::other("EINVAL: Invalid argument")));
        let expected = "cannot handle SIGINT, SIGTERM and SIGHUP: EINVAL: Invalid argument";
        assert_eq!(no_handler, expected);
        assert!(said(ctrlc::Error::MultipleHandlers).starts_with("signals are handled already"));
    }
}
