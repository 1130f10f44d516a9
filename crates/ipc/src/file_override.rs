//! Root's right to open files regardless of their permissions, and when a thread must not have it.

use std::marker::PhantomData;

use rustix::thread::{CapabilitySet, capabilities, set_capabilities};

const OVERRIDE: CapabilitySet = CapabilitySet::DAC_OVERRIDE.union(CapabilitySet::DAC_READ_SEARCH);

/// How a half-made peer is kept from holding up a port that connects to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guard {
    /// The thread does not have the right for as long as it has the port.
    Thread,
    /// Each call that may connect drops the right.
    Call,
}

impl Guard {
    /// For a port whose thread is not known to have dropped the right.
    pub(crate) fn of_ordinary_thread() -> Self {
        let has_override = capabilities(None).is_ok_and(|sets| sets.permitted.intersects(OVERRIDE));
        if has_override { Self::Call } else { Self::Thread }
    }

    /// For the duration of a call.
    pub(crate) fn of_call(self) -> Option<FileOverrideGivenUp> {
        (self == Self::Call).then(give_up_file_override)
    }
}

/// Drops the calling thread's right, as root, to open files regardless of their permissions, until
/// the returned guard is dropped.
///
/// iceoryx2 marks shared memory that is still being created by its permissions. Root can open it
/// regardless, finds it empty, and sleeps a millisecond at a time until it is not: forever, if its
/// creator was killed. Without this right a port of the thread sees the mark and continues. Ports
/// end with the right restored: they remove files in directories that another user may have created.
/// It does nothing in a thread without privileges.
pub(crate) fn give_up_file_override() -> FileOverrideGivenUp {
    let given_up = give_up_effective(OVERRIDE);
    FileOverrideGivenUp { given_up, of_this_thread: PhantomData }
}

/// Takes capabilities out of the thread's effective set; returns those that were in it.
fn give_up_effective(unwanted: CapabilitySet) -> CapabilitySet {
    let Ok(mut sets) = capabilities(None) else { return CapabilitySet::empty() };
    let given_up = sets.effective & unwanted;
    if given_up.is_empty() {
        return given_up;
    }
    sets.effective -= given_up;
    // Dropping capabilities is always allowed.
    match set_capabilities(None, sets) {
        Ok(()) => given_up,
        Err(_) => CapabilitySet::empty(),
    }
}

/// Restores, when dropped, the right that [`give_up_file_override`] dropped.
#[must_use = "dropping it restores the right"]
#[derive(Debug)]
pub(crate) struct FileOverrideGivenUp {
    given_up: CapabilitySet,
    /// Each thread has its own capabilities.
    of_this_thread: PhantomData<*const ()>,
}

impl Drop for FileOverrideGivenUp {
    fn drop(&mut self) {
        if self.given_up.is_empty() {
            return;
        }
        if let Ok(mut sets) = capabilities(None) {
            // They are still permitted, so they may become effective again.
            sets.effective |= self.given_up;
            let _ = set_capabilities(None, sets);
        }
    }
}
