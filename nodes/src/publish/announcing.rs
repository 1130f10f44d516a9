//! Telling readers what the frames are, beside the thread that sends them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::Duration;

use isochrone_ipc::{FrameLayout, LayoutAnnouncer, OpenError, Participant, ipc};

use crate::failure::Failure;

/// From the announcement of the layout to the first frame: a node looks for layouts every 20 ms.
pub(super) const HEAD_START_NS: u64 = 50_000_000;
/// How often a reader that came is looked for.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// The thread that tells what the frames are, however seldom those are sent, and makes good failed
/// connections. It ends when this is dropped.
pub(super) struct Announcing<'scope> {
    is_over: Arc<AtomicBool>,
    /// `None`: it has ended.
    thread: Option<ScopedJoinHandle<'scope, ()>>,
}

impl<'scope> Announcing<'scope> {
    pub(super) fn start(
        scope: &'scope Scope<'scope, '_>,
        participant: &'scope Participant<ipc::Service>,
        service: &'scope str,
        layout: &'scope FrameLayout,
    ) -> Result<Self, Failure> {
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let (ready, is_ready) = channel::<Result<(), OpenError>>();
        let announce = move || {
            // A port belongs to the thread that opens it.
            let opened = LayoutAnnouncer::open(participant, service, "publish", layout);
            let mut announcer = match opened {
                Ok(announcer) => announcer,
                Err(error) => return drop(ready.send(Err(error))),
            };
            let _ = ready.send(Ok(()));
            while !over.load(Ordering::Relaxed) {
                announcer.tend(participant);
                participant.tend();
                thread::park_timeout(LOOK_INTERVAL);
            }
        };
        let thread = thread::Builder::new().name("announce".to_owned());
        let thread = thread.spawn_scoped(scope, announce).map_err(Failure::thread)?;
        let announcing = Self { is_over, thread: Some(thread) };
        let gone = |_| Failure::found("the thread that announces the layout ended in its start");
        is_ready.recv().map_err(gone)?.map_err(Failure::found)?;
        Ok(announcing)
    }
}

impl Drop for Announcing<'_> {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // The previous thread has ended before another layout is announced; a panic is reported at the end of the
            // scope.
            let _ = thread.join();
        }
    }
}
