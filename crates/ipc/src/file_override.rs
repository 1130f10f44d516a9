//! Root's right to open files whatever their permissions say, and when a thread must be without it.

use std::marker::PhantomData;

use rustix::thread::{CapabilitySet, capabilities, set_capabilities};

/// Drops the calling thread's right, as root, to open files regardless of their permissions, until
/// the returned guard is dropped.
///
/// iceoryx2 marks shared memory that is still being created by its permissions. Root can open it
/// regardless, finds it empty, and sleeps a millisecond at a time until it is not: forever, if its
/// creator was killed. Without this right a port of the thread sees the mark and continues. Call this
/// after opening the ports, and drop the guard before them: ports remove files in directories that
/// another user may have created. It does nothing in a thread without privileges.
pub fn give_up_file_override() -> FileOverrideGivenUp {
    let given_up = give_up_effective(CapabilitySet::DAC_OVERRIDE | CapabilitySet::DAC_READ_SEARCH);
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
    // To have fewer capabilities is always allowed.
    match set_capabilities(None, sets) {
        Ok(()) => given_up,
        Err(_) => CapabilitySet::empty(),
    }
}

/// Restores, when dropped, the right that [`give_up_file_override`] dropped.
#[must_use = "dropping it restores the right"]
#[derive(Debug)]
pub struct FileOverrideGivenUp {
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
