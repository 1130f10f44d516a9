//! Joining and leaving a domain.
#![allow(unsafe_code)] // the C interface

use std::ffi::c_char;
use std::mem::take;
use std::path::Path;
use std::ptr::{null_mut, without_provenance_mut};
use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError};

use isochrone_ipc::{Domain, Participant, ipc};
use nix::libc;

use crate::arguments::{Place, optional_text, text};
use crate::joined::Joined;
use crate::process::of_this_process;
use crate::status::{
    Failure, ISOCHRONE_ERROR_CLOSED, ISOCHRONE_ERROR_DOMAIN, act, isochrone_status,
};

/// A program in a domain. Any thread may use it.
pub struct isochrone_participant {
    _private: (),
}

/// Those who have not left, by the numbers that are their handles. Each thread may use them, so there is one table.
static PARTICIPANTS: Mutex<Participants> = Mutex::new(Participants { last: 0, joined: Vec::new() });

struct Participants {
    last: u32,
    joined: Vec<(usize, Arc<Joined>)>,
}

fn participants() -> MutexGuard<'static, Participants> {
    PARTICIPANTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Lets those leave that have not left when the program ends, so that nothing is left of them.
fn leave_at_exit() {
    static ONCE: Once = Once::new();
    extern "C" fn leave_all() {
        let _ = act(|| {
            let left = take(&mut participants().joined);
            left.into_iter().for_each(|(_, joined)| of_this_process(joined.process, joined));
            Ok(())
        });
    }
    ONCE.call_once(|| {
        // SAFETY: the function neither unwinds nor needs anything but what is static. Without a place for it, files are
        // left that the next process of the domain removes.
        let _ = unsafe { libc::atexit(leave_all) };
    });
}

fn closed() -> Failure {
    Failure::new(ISOCHRONE_ERROR_CLOSED, "the participant has left already, or is none at all")
}

/// The participant of a handle.
pub(crate) fn joined(handle: *mut isochrone_participant) -> Result<Arc<Joined>, Failure> {
    if handle.is_null() {
        return Err(Failure::argument("the participant is NULL"));
    }
    let participants = participants();
    let found = participants.joined.iter().find(|(number, _)| *number == handle.addr());
    found.map(|(_, joined)| Arc::clone(joined)).ok_or_else(closed)
}

/// Joins a domain: the programs that exchange frames with each other.
///
/// Call it in an ordinary thread, before any thread of the program gets a real-time priority: it takes milliseconds and
/// starts a thread, which inherits priority and CPUs of the caller. That thread announces layouts, hears those of others
/// and makes good failed connections. It blocks all signals. Do not fork while a participant is joined, except to exec.
///
/// name: what others see of this program, such as "pump/sensor"; at most 128 ASCII characters.
/// config_file: a configuration file of iceoryx2. NULL: that of the environment variable ICEORYX2_CONFIG, or else where
/// iceoryx2 itself looks.
/// participant: receives the handle; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_participant_join(
    name: *const c_char,
    config_file: *const c_char,
    participant: *mut *mut isochrone_participant,
) -> isochrone_status {
    act(|| {
        // SAFETY: these are the pointers that the interface asks for.
        let (name, config_file, place) = unsafe {
            let place = Place::new(participant, "participant")?;
            place.set(null_mut());
            (text(name, "name")?, optional_text(config_file, "config_file")?, place)
        };
        let failed = |error: String| Failure::new(ISOCHRONE_ERROR_DOMAIN, error);
        let domain = match config_file {
            Some(file) => Domain::from_file(Path::new(file)),
            None => Domain::find(),
        };
        let domain = domain.map_err(|error| failed(error.to_string()))?;
        let participant = Participant::<ipc::Service>::join(name, domain);
        let participant = participant.and_then(Participant::for_real_time);
        let participant = participant.map_err(|error| failed(error.to_string()))?;
        let joined = Joined::new(participant).map_err(|error| {
            failed(format!("the participant's thread cannot be started: {error}"))
        })?;
        leave_at_exit();
        let mut participants = participants();
        participants.last = participants.last.wrapping_add(1).max(1);
        let number = participants.last as usize;
        participants.joined.push((number, Arc::new(joined)));
        place.set(without_provenance_mut(number));
        Ok(())
    })
}

/// Leaves the domain. Publishers, subscribers and clients that were opened with the participant stay usable; the domain
/// is left when the last of them is closed. NULL is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_participant_leave(
    participant: *mut isochrone_participant,
) -> isochrone_status {
    act(|| {
        if participant.is_null() {
            return Ok(());
        }
        let mut participants = participants();
        let found =
            participants.joined.iter().position(|(number, _)| *number == participant.addr());
        let left = participants.joined.remove(found.ok_or_else(closed)?);
        // Ending takes a while, in which others may join.
        drop(participants);
        drop(left);
        Ok(())
    })
}
