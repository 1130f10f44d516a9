//! A thread prepared for real time: what it gives up, and gets back before its ports end.

use std::ops::{Deref, DerefMut};

use isochrone_cyclic::{PreparedThread, ThreadGrant, ThreadRequest};
use isochrone_ipc::{ForRealTime, InRealTime};

/// Ports in a thread that was prepared for real time.
///
/// The thread has its priority, and lacks root's right to open files regardless of their permissions: with that
/// right, a half-made peer would hold up the cycle for ever. When this is dropped, both are undone before the ports
/// end: ports end under the domain's lock, for which no real-time thread may wait, and remove files in directories
/// that another user may have made.
///
/// Its ports are those of a [`RealTime`](isochrone_ipc::RealTime) participant, which connect without
/// waiting. Those of an ordinary one are refused:
///
/// ```compile_fail,E0308
/// # use isochrone_cyclic::ThreadRequest;
/// # use isochrone_ipc::{Depth, FrameSubscriber, IsolatedDomain, Participant};
/// # use isochrone_runtime::RealTimeThread;
/// # let domain = IsolatedDomain::new("rtthread").unwrap();
/// # let request = ThreadRequest::default();
/// let participant = Participant::join("level", &domain).unwrap();
/// let input = FrameSubscriber::open(&participant, "plant/a", 1, Depth::Newest).unwrap();
/// let thread = RealTimeThread::prepare(request, input);
/// ```
///
/// ```
/// # use isochrone_cyclic::ThreadRequest;
/// # use isochrone_ipc::{Depth, IsolatedDomain, Participant};
/// # use isochrone_runtime::RealTimeThread;
/// # let domain = IsolatedDomain::new("rtthread").unwrap();
/// # let request = ThreadRequest::default();
/// let participant = Participant::join("level", &domain).unwrap().for_real_time().unwrap();
/// let input = participant.subscriber("plant/a", 1, Depth::Newest).unwrap();
/// let (mut input, grant) = RealTimeThread::prepare(request, input);
/// assert!(input.newest(0).is_none());
/// ```
#[derive(Debug)]
pub struct RealTimeThread<P>(PreparedThread<InRealTime<P>>);

impl<P> RealTimeThread<P> {
    /// Prepares the calling thread, whose ports are open. Call it as the last step before the loop.
    pub fn prepare(request: ThreadRequest, ports: ForRealTime<P>) -> (Self, ThreadGrant) {
        // Entered without a priority, too: a half-made peer would hold up any thread for ever.
        let (thread, grant) = PreparedThread::prepare(request, ports.enter());
        (Self(thread), grant)
    }
}

impl<P> Deref for RealTimeThread<P> {
    type Target = P;

    fn deref(&self) -> &P {
        &self.0
    }
}

impl<P> DerefMut for RealTimeThread<P> {
    fn deref_mut(&mut self) -> &mut P {
        &mut self.0
    }
}

#[cfg(test)]
mod tests {
    use isochrone_cyclic::{Pinning, prepare_thread};

    use super::*;

    /// Records what the thread has at the time that it is dropped.
    struct Port(std::sync::mpsc::Sender<String>);

    impl Drop for Port {
        fn drop(&mut self) {
            let scheduler = prepare_thread(ThreadRequest::default()).scheduler;
            let _ = self.0.send(scheduler);
        }
    }

    #[test]
    fn ports_end_without_the_priority_of_their_thread() {
        let (send, seen) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || {
            let request = ThreadRequest { priority: Some(1), cpu: Pinning::Any };
            let port = ForRealTime::nothing().map(|()| Port(send));
            let (ports, grant) = RealTimeThread::prepare(request, port);
            drop(ports);
            grant.scheduler
        });
        let granted = thread.join().unwrap();
        assert!(["fifo:1", "other"].contains(&granted.as_str()), "{granted}");
        assert_eq!(seen.recv().unwrap(), "other");
    }
}
