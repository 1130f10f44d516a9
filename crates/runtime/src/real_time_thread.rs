//! What a thread gives up for real time, and gets back before its ports end.

use std::ops::{Deref, DerefMut};

use isochrone_cyclic::{PriorityReturn, ThreadGrant, ThreadRequest, prepare_thread};
use isochrone_ipc::{FileOverrideGivenUp, give_up_file_override};

/// Ports in a thread that was prepared for real time.
///
/// The thread has its priority, and is without root's right to open files whatever their permissions
/// say: with it a half-made peer would hold up the cycle for ever. Both end before the ports do, when
/// this is dropped: ports end under the domain's lock, for which no real-time thread may wait, and
/// remove files in directories that another user may have made.
#[derive(Debug)]
pub struct RealTimeThread<P> {
    // Dropped in this order.
    _given_up: FileOverrideGivenUp,
    _priority: PriorityReturn,
    ports: P,
}

impl<P> RealTimeThread<P> {
    /// Prepares the calling thread, whose ports are open; call it last before the loop.
    pub fn prepare(request: ThreadRequest, ports: P) -> (Self, ThreadGrant) {
        // First of all, so that a panic gives the priority back too.
        let priority = PriorityReturn::default();
        let grant = prepare_thread(request);
        // Every thread: without a priority, too, a half-made peer would hold it up for ever.
        let given_up = give_up_file_override();
        (Self { _given_up: given_up, _priority: priority, ports }, grant)
    }
}

impl<P> Deref for RealTimeThread<P> {
    type Target = P;

    fn deref(&self) -> &P {
        &self.ports
    }
}

impl<P> DerefMut for RealTimeThread<P> {
    fn deref_mut(&mut self) -> &mut P {
        &mut self.ports
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sees what the thread has when it is dropped.
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
            let request = ThreadRequest { priority: Some(1), cpu: None };
            let (ports, grant) = RealTimeThread::prepare(request, Port(send));
            drop(ports);
            grant.scheduler
        });
        let granted = thread.join().unwrap();
        assert!(["fifo:1", "other"].contains(&granted.as_str()), "{granted}");
        assert_eq!(seen.recv().unwrap(), "other");
    }
}
