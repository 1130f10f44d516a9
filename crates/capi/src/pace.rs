//! Waiting on the grid of the nodes.
#![allow(unsafe_code)] // the C interface

use std::ptr::null_mut;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, Pace};
use isochrone_ipc::ForRealTime;

use crate::arguments::Place;
use crate::handles::{self, Port};
use crate::publisher::isochrone_stamp;
use crate::status::{Failure, act, isochrone_status};

/// Waits on the grid on which the nodes of this machine release their tasks. It belongs to the thread that opened it.
pub struct isochrone_pace {
    _private: (),
}

pub(crate) struct Grid(Pace);

impl Port for Grid {
    type Handle = isochrone_pace;
    const NOUN: &str = "pace";
}

/// The clock of all times here: CLOCK_MONOTONIC, in ns.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_now_ns() -> u64 {
    Monotonic.now_ns()
}

/// Makes a pace: release n is due at k * 20 ms + 0.5 ms + phase_ns + n * period_ns, whole k, after the first wait. If the
/// period divides 20 ms, every program with it is on one grid, whenever it started.
///
/// phase_ns: how long after the releases of tasks without a phase; less than period_ns.
/// pace: receives the handle; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_pace_open(
    period_ns: u64,
    phase_ns: u64,
    pace: *mut *mut isochrone_pace,
) -> isochrone_status {
    act(|| {
        // SAFETY: this is the pointer that the interface asks for.
        let place = unsafe { Place::new(pace, "pace") }?;
        place.set(null_mut());
        if period_ns == 0 {
            return Err(Failure::argument("the period is not above 0 ns; give one such as 5 ms"));
        }
        if phase_ns >= period_ns {
            return Err(Failure::argument(format!(
                "a phase of {phase_ns} ns is not less than the period of {period_ns} ns"
            )));
        }
        let [period, phase] = [period_ns, phase_ns].map(Duration::from_nanos);
        let grid = Grid(Pace::new(period, phase));
        place.set(handles::open(ForRealTime::nothing().map(|()| grid))?);
        Ok(())
    })
}

/// Sleeps until the next release. Releases that are over are left out and counted in `missed`. A signal does not end it.
///
/// stamp: receives cycle, release_ns and missed of the release, for isochrone_publisher_send(); source_ns and flags are
/// 0. NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_pace_wait(
    pace: *mut isochrone_pace,
    stamp: *mut isochrone_stamp,
) -> isochrone_status {
    act(|| {
        let release = handles::with(pace, |grid: &mut Grid| Ok(grid.0.wait()))?;
        if let (Some(release), false) = (release, stamp.is_null()) {
            // SAFETY: this is the pointer that the interface asks for.
            let place = unsafe { Place::new(stamp, "stamp") }?;
            place.set(isochrone_stamp {
                cycle: release.cycle,
                release_ns: release.release_ns,
                source_ns: 0,
                missed: release.missed,
                flags: 0,
            });
        }
        Ok(())
    })
}

/// Ends a pace. NULL is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_pace_close(pace: *mut isochrone_pace) -> isochrone_status {
    act(|| handles::close::<Grid>(pace))
}
