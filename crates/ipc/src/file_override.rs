//! Root's right to open files whatever their permissions say, and when a thread must be without it.

use std::marker::PhantomData;

use rustix::thread::{CapabilitySet, capabilities, set_capabilities};

/// Gives up, for the calling thread, root's right to open files whatever their permissions say,
/// until what this returns is dropped.
///
/// iceoryx2 marks shared memory that is still being made by its permissions. Root opens it all the
/// same, finds it empty, and sleeps a millisecond at a time until it is not: for ever, if its maker
/// was killed. Without the right a port of this thread sees the mark, and goes on. Call it after
/// opening the ports, and drop it before them: ports remove files, in directories that another user
/// may have made. For a thread without privileges it does nothing.
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

/// Gives back what [`give_up_file_override`] took, when it is dropped.
#[must_use = "dropping it gives the right back"]
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
