//! Ending on a signal.

use std::time::Duration;

use isochrone_processes::Stop;

use crate::base::failure::Failure;
use crate::base::terminal;

/// The flag that a signal sets; it also falls due after so many seconds, if they are given. A program
/// that another signal ends at once says so.
pub(crate) fn on_signal(seconds: Option<f64>) -> Result<Stop, Failure> {
    on_signal_after(seconds, || {})
}

/// The same; a program that another signal ends at once calls `first` before it says so.
pub(crate) fn on_signal_after(
    seconds: Option<f64>,
    first: impl Fn() + Send + Sync + 'static,
) -> Result<Stop, Failure> {
    let stop = Stop::on_signal(move || {
        first();
        terminal::note(
            "ended at once by another signal, not in order: what it would have said is lost, and \
             files may be left",
        );
    })?;
    Ok(after(stop, seconds, 0))
}

/// The same flag; it also falls due so many seconds after the instant `ahead_ns` from now.
pub(crate) fn after(stop: Stop, seconds: Option<f64>, ahead_ns: u64) -> Stop {
    // Beyond what a Duration holds is forever.
    let run = |seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
    match seconds {
        Some(seconds) => stop.after(run(seconds).saturating_add(Duration::from_nanos(ahead_ns))),
        None => stop,
    }
}
