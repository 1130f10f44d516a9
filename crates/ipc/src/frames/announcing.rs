//! Telling readers what the frames are, beside the thread that sends them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::{AnnouncingError, FrameLayout, LayoutAnnouncer, Participant, Service};

/// How often a reader that came is looked for.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// The thread that tells what the frames are, however seldom those are sent, and makes good failed
/// connections. It ends when this is dropped.
#[derive(Debug)]
pub struct Announcing {
    is_over: Arc<AtomicBool>,
    /// `None`: it has ended.
    thread: Option<JoinHandle<()>>,
}

impl Announcing {
    /// From the announcement of the layout to the first frame: a node looks for layouts every 20 ms.
    pub const HEAD_START_NS: u64 = 50_000_000;

    /// Starts to announce the layout of `service` as that of `publisher`; returns when readers can hear it.
    ///
    /// # Errors
    /// As [`LayoutAnnouncer::open`], or there is no thread to be had.
    pub fn start<S: Service + 'static>(
        participant: &Arc<Participant<S>>,
        service: &str,
        publisher: &str,
        layout: &FrameLayout,
    ) -> Result<Self, AnnouncingError>
    where
        Participant<S>: Send + Sync,
    {
        let is_over = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&is_over);
        let (ready, is_ready) = channel();
        let participant = Arc::clone(participant);
        let (service, publisher) = (service.to_owned(), publisher.to_owned());
        let layout = layout.clone();
        let announce = move || {
            // A port belongs to the thread that opens it.
            let opened = LayoutAnnouncer::open(&participant, &service, &publisher, &layout);
            let mut announcer = match opened {
                Ok(announcer) => announcer,
                Err(error) => return drop(ready.send(Err(error))),
            };
            let _ = ready.send(Ok(()));
            while !over.load(Ordering::Relaxed) {
                announcer.tend(&participant);
                participant.tend();
                thread::park_timeout(LOOK_INTERVAL);
            }
            // For a reader that came just now: it may have been given frames.
            announcer.tend_at_end(&participant);
        };
        let thread = thread::Builder::new().name("announce".to_owned());
        let thread = Some(thread.spawn(announce).map_err(AnnouncingError::Thread)?);
        let announcing = Self { is_over, thread };
        is_ready.recv().map_err(|_| AnnouncingError::Ended)??;
        Ok(announcing)
    }
}

impl Drop for Announcing {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // The previous thread has ended before another layout is announced; of a panic it has spoken itself.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{IsolatedDomain, LayoutWatcher, SignalSpec, ipc};

    use super::*;

    #[test]
    fn a_reader_that_comes_later_hears_what_the_frames_are() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let participant = Arc::new(Participant::<ipc::Service>::join("a", &domain).unwrap());
        let layout = FrameLayout { signals: vec![SignalSpec::new("y", "LREAL")], period_ns: None };
        let announcing = Announcing::start(&participant, "x", "pump", &layout).unwrap();
        let mut watcher = LayoutWatcher::open(&participant, "x").unwrap();
        while !watcher.look(&participant) {
            thread::sleep(Duration::from_millis(5));
        }
        let heard = watcher.newest().unwrap();
        assert_eq!((heard.publisher.as_str(), heard.layout.signals.len()), ("pump", 1));
        drop(announcing);
        assert_eq!(Arc::strong_count(&participant), 1, "the thread has ended");
    }

    #[test]
    fn a_reader_that_comes_just_before_the_end_hears_it_still() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let participant = Arc::new(Participant::<ipc::Service>::join("a", &domain).unwrap());
        let layout = FrameLayout { signals: vec![SignalSpec::new("y", "LREAL")], period_ns: None };
        for turn in 0..20 {
            let announcing = Announcing::start(&participant, "x", "pump", &layout).unwrap();
            let mut watcher = LayoutWatcher::open(&participant, "x").unwrap();
            drop(announcing);
            assert!(watcher.look(&participant), "turn {turn}");
        }
    }

    #[test]
    fn a_layout_that_cannot_be_is_refused_by_its_own_error() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let participant = Arc::new(Participant::<ipc::Service>::join("a", &domain).unwrap());
        let none = FrameLayout { signals: Vec::new(), period_ns: None };
        let refused = Announcing::start(&participant, "x", "pump", &none).unwrap_err();
        assert!(refused.to_string().contains("the frame has no signal"), "{refused}");
        assert!(matches!(refused, AnnouncingError::Open(_)));
    }
}
