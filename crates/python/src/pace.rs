//! The grid on which nodes release their tasks.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone::cyclic::{
    Clock, Cyclic, Monotonic, PromptWakeUps, Release, Schedule, Wake, epoch_after_ns,
};
use isochrone::model::parse_duration_ns;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::held::Held;
use crate::interruption::LOOK;

/// A release: its cycle, when it was due and when the wait ended, and how many were missed so far.
type Due = (u64, u64, u64, u64);

/// Keeps releases on the grid.
#[pyclass(frozen, module = "isochrone._native")]
pub(crate) struct Pace(Held<Releases>);

struct Releases {
    schedule: Schedule,
    /// Since the first wait.
    running: Option<Cyclic<Monotonic>>,
}

#[pymethods]
impl Pace {
    #[new]
    fn new(period_ns: u64, phase_ns: u64) -> Self {
        let schedule = Schedule { phase_ns, ..Schedule::every(period_ns, Wake::Sleep) };
        Self(Held::new("the pace".to_owned(), Releases { schedule, running: None }))
    }

    /// Waits for the next release that is not over.
    fn wait(&self, py: Python<'_>) -> PyResult<Due> {
        loop {
            let released = py.detach(|| self.0.with(Releases::wait))?;
            py.check_signals()?;
            if let Some(release) = released {
                return Ok((release.cycle, release.release_ns, release.start_ns, release.missed));
            }
        }
    }
}

impl Releases {
    /// The next release, or `None` after a part of the wait for it.
    fn wait(&mut self) -> Option<Release> {
        let _prompt = PromptWakeUps::in_this_thread();
        let now_ns = Monotonic.now_ns();
        let schedule = self.schedule;
        let cyclic = self.running.get_or_insert_with(|| {
            let epoch_ns = epoch_after_ns(now_ns);
            Cyclic::new(Monotonic, schedule, epoch_ns, Arc::new(AtomicBool::new(false)))
        });
        let step_ns = now_ns.saturating_add(LOOK.as_nanos() as u64);
        if cyclic.next_release_ns() > step_ns {
            Monotonic.sleep_until_ns(step_ns);
            return None;
        }
        cyclic.wait()
    }
}

/// What CLOCK_MONOTONIC reads.
#[pyfunction]
pub(crate) fn now_ns() -> u64 {
    Monotonic.now_ns()
}

/// A duration as configurations have it, such as `10ms`, in ns.
#[pyfunction]
pub(crate) fn duration_ns(text: &str) -> PyResult<u64> {
    parse_duration_ns(text).map_err(PyValueError::new_err)
}
