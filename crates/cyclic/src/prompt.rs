//! Wake-ups of ordinary threads at the instant they asked for.

use std::marker::PhantomData;
use std::num::NonZeroU64;

use rustix::thread::set_current_timer_slack;

/// Lets the kernel wake the calling thread when a sleep is over, until this is dropped.
///
/// The kernel wakes ordinary threads up to 50 us later than they asked for, to serve several timers at
/// once. Here that timer slack is 1 ns, as it is for real-time threads. Dropping this gives the thread back
/// the slack that it was started with.
#[must_use = "dropping it gives the thread its timer slack back"]
#[derive(Debug)]
pub struct PromptWakeUps {
    // The slack belongs to the thread.
    _thread: PhantomData<*const ()>,
}

impl PromptWakeUps {
    /// For the calling thread. One system call, which cannot fail.
    pub fn in_this_thread() -> Self {
        let _ = set_current_timer_slack(Some(NonZeroU64::MIN));
        Self { _thread: PhantomData }
    }
}

impl Drop for PromptWakeUps {
    fn drop(&mut self) {
        let _ = set_current_timer_slack(None);
    }
}

#[cfg(test)]
mod tests {
    use rustix::thread::current_timer_slack;

    use super::*;

    #[test]
    fn the_slack_is_the_smallest_there_is_and_is_given_back() {
        let before = current_timer_slack().unwrap();
        let prompt = PromptWakeUps::in_this_thread();
        assert_eq!(current_timer_slack().unwrap(), 1);
        drop(prompt);
        assert_eq!(current_timer_slack().unwrap(), before);
    }
}
