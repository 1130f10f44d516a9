//! Ending on a signal: Ctrl-C, SIGTERM and SIGHUP set a flag that every loop looks at.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::failure::Failure;

/// Exit status of a program that a second Ctrl-C ends at once.
const INTERRUPTED: i32 = 130;

/// The flag that ends the program, and when it is to end by itself.
#[derive(Clone)]
pub(crate) struct Stop {
    flag: Arc<AtomicBool>,
    end: Option<Instant>,
    /// The flag of the run that this is a part of.
    whole: Option<Arc<AtomicBool>>,
}

impl Stop {
    /// Sets the flag on a signal; a second signal ends the program at once. `seconds` is how long
    /// to run; forever if it is not given.
    pub(crate) fn on_signal(seconds: Option<f64>) -> Result<Self, Failure> {
        let flag = Arc::new(AtomicBool::new(false));
        let signalled = flag.clone();
        ctrlc::set_handler(move || {
            if signalled.swap(true, Ordering::Relaxed) {
                std::process::exit(INTERRUPTED);
            }
        })
        .map_err(|error| Failure::found(format!("cannot handle signals: {error}")))?;
        let end = seconds.map(|seconds| {
            // Beyond what a Duration holds is forever.
            let run = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
            let now = Instant::now();
            now.checked_add(run).unwrap_or(now + Duration::from_secs(u64::from(u32::MAX)))
        });
        Ok(Self { flag, end, whole: None })
    }

    /// A stop of its own for a part of the run: due with this one, after `run`, or when it is asked
    /// for, which leaves this one alone.
    pub(crate) fn within(&self, run: Duration) -> Self {
        let end = Instant::now().checked_add(run);
        Self { flag: Arc::default(), end, whole: Some(self.flag.clone()) }
    }

    /// The flag itself, for loops that are told to stop.
    pub(crate) fn flag(&self) -> Arc<AtomicBool> {
        self.flag.clone()
    }

    /// Whether it is time to end; sets the flag when the time is up.
    pub(crate) fn is_due(&self) -> bool {
        let whole_is_due = self.whole.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed));
        if whole_is_due || self.end.is_some_and(|end| Instant::now() >= end) {
            self.request();
        }
        self.flag.load(Ordering::Relaxed)
    }

    /// Asks everything to end.
    pub(crate) fn request(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

/// Reads a number of seconds.
pub(crate) fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 => Ok(seconds),
        _ => Err("give a number of seconds greater than 0, such as 10 or 0.5".into()),
    }
}
