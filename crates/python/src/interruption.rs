//! Ctrl-C while something waits.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, LazyLock};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors::failed;

/// Between two looks whether Python has received a signal.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// Set while the process should not wait any longer for those that start or end.
pub(crate) static OPENING: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Opens something, which waits for other processes that start or end; without Python's lock.
pub(crate) fn opened<R: Send>(
    py: Python<'_>,
    open: impl FnOnce() -> PyResult<R> + Send,
) -> PyResult<R> {
    interruptible(py, &OPENING, open)?
}

/// Does work that may take long in a thread of its own, without Python's lock. A signal whose handler raises an exception, as
/// Ctrl-C does, sets `stop`, at which the work must end.
pub(crate) fn interruptible<R: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    let worked = py.detach(|| {
        thread::scope(|scope| {
            let (done, is_done) = channel();
            let worker = thread::Builder::new().name("isochrone".to_owned());
            let started = worker.spawn_scoped(scope, move || {
                // Nobody waits for it only if this thread has panicked.
                let _ = done.send(work());
            });
            if let Err(cause) = started {
                return Err(failed(format!("cannot start a thread: {cause}")));
            }
            let mut raised = None;
            loop {
                match is_done.recv_timeout(LOOK) {
                    Ok(result) => return raised.map_or(Ok(Some(result)), Err),
                    // It panicked, which the end of the scope passes on.
                    Err(RecvTimeoutError::Disconnected) => return Ok(None),
                    Err(RecvTimeoutError::Timeout) if raised.is_some() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        raised = Python::attach(|py| py.check_signals()).err();
                        stop.store(raised.is_some(), Ordering::Relaxed);
                    }
                }
            }
        })
    });
    stop.store(false, Ordering::Relaxed);
    worked?.ok_or_else(|| failed("the thread that did the work has panicked"))
}

/// Waits in steps without Python's lock, until one has a result or the time is over; `None`: the latter.
pub(crate) fn wait_in_steps<R: Send>(
    py: Python<'_>,
    timeout: Option<Duration>,
    mut step: impl FnMut(Duration) -> PyResult<Option<R>> + Send,
) -> PyResult<Option<R>> {
    let begin = std::time::Instant::now();
    loop {
        let rest = timeout.map_or(LOOK, |timeout| timeout.saturating_sub(begin.elapsed()));
        if let Some(result) = py.detach(|| step(rest.min(LOOK)))? {
            return Ok(Some(result));
        }
        py.check_signals()?;
        if timeout.is_some_and(|timeout| begin.elapsed() >= timeout) {
            return Ok(None);
        }
    }
}
