//! Readers that sleep until a frame comes.

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_ipc::{FrameRef, FrameSubscriber, Service};

/// Lets a thread sleep until a frame comes. For ordinary threads.
///
/// No thread that sends is asked to wake anybody, so that readers cost it nothing: the reader sleeps until
/// the next frame is due and looks for it then, see [`FrameSubscriber::next_look_ns`].
///
/// ```
/// use isochrone_cyclic::{Clock, Monotonic};
/// use isochrone_ipc::{Depth, FrameSubscriber, IsolatedDomain, Participant, ipc};
/// use isochrone_runtime::FrameWait;
///
/// # let domain = IsolatedDomain::new("framewait")?;
/// let reader = Participant::<ipc::Service>::join("reader", &domain)?;
/// let mut levels = FrameSubscriber::open(&reader, "plant/level", 1, Depth::All)?;
/// let mut valves = FrameSubscriber::open(&reader, "plant/valve", 1, Depth::All)?;
/// let wait = FrameWait::in_this_thread();
///
/// // One service.
/// let until_ns = Monotonic.now_ns() + 50_000_000;
/// while let Some(frame) = wait.next(&mut levels, until_ns) {
///     println!("{:?}", frame.values());
/// }
///
/// // Several.
/// let until_ns = Monotonic.now_ns() + 50_000_000;
/// while Monotonic.now_ns() < until_ns {
///     for subscriber in [&mut levels, &mut valves] {
///         while let Some(frame) = subscriber.next(Monotonic.now_ns()) {
///             println!("{:?}", frame.values());
///         }
///     }
///     let now_ns = Monotonic.now_ns();
///     wait.sleep_until_ns(levels.next_look_ns(now_ns).min(valves.next_look_ns(now_ns)));
///     reader.tend(); // has failed connections tried again
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct FrameWait {
    _prompt: PromptWakeUps,
}

impl FrameWait {
    /// For the calling thread, which is woken [promptly](PromptWakeUps) until this is dropped.
    pub fn in_this_thread() -> Self {
        Self { _prompt: PromptWakeUps::in_this_thread() }
    }

    /// Returns the next frame as soon as it is there; `None` if none came until `until_ns`
    /// (`CLOCK_MONOTONIC`).
    ///
    /// A frame that waits is returned even if that time is over. Signals do not end the wait: to end it on
    /// one, wait for some milliseconds at a time.
    pub fn next<'a, S: Service>(
        &self,
        subscriber: &'a mut FrameSubscriber<S>,
        until_ns: u64,
    ) -> Option<FrameRef<'a, S>> {
        let mut now_ns = Monotonic.now_ns();
        while subscriber.peek_next(now_ns).is_none() && now_ns < until_ns {
            now_ns = Monotonic.now_ns();
            self.sleep_until_ns(subscriber.next_look_ns(now_ns).min(until_ns));
            now_ns = Monotonic.now_ns();
        }
        subscriber.next(now_ns)
    }

    /// Sleeps until an instant of `CLOCK_MONOTONIC`, such as the earliest of several subscribers'
    /// [`next_look_ns`](FrameSubscriber::next_look_ns).
    pub fn sleep_until_ns(&self, look_ns: u64) {
        Monotonic.sleep_until_ns(look_ns);
    }
}
