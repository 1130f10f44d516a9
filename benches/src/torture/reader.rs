//! A reader of a service in a thread of its own: as readers of isochrone see it, and everything that was sent.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Domain, FrameSubscriber, Participant, SubscriberCounters, ipc, raw_subscriber,
};

use super::frames::Got;
use super::scene::{PATIENCE, Scene};
use crate::Failure;

/// Between two looks: the buffer has room for 256 frames.
const LOOK: Duration = Duration::from_millis(1);
/// Of a frame: so many that all services here fit.
const CHANNELS: usize = 2;

/// Frames of one service, from the moment that it is open.
pub(super) struct Reader {
    read: Arc<Read>,
    thread: Option<JoinHandle<Result<(), String>>>,
}

#[derive(Default)]
struct Read {
    is_open: AtomicBool,
    stop: AtomicBool,
    seen: Mutex<Seen>,
}

/// What a reader has seen.
#[derive(Default)]
pub(super) struct Seen {
    /// What a reader of isochrone gets.
    pub(super) frames: Vec<Got>,
    /// What it counts.
    pub(super) counters: SubscriberCounters,
    /// Cycles that were sent more than once, by whomever.
    pub(super) twice: Vec<u64>,
}

impl Reader {
    /// Opens a service, and creates it if it is not there.
    pub(super) fn open(scene: &Scene, service: &'static str) -> Result<Self, Failure> {
        let read = Arc::<Read>::default();
        let (domain, shared) = (Domain::clone(scene.domain()), Arc::clone(&read));
        let run = move || read_all(&domain, service, &shared).map_err(|error| error.to_string());
        let mut reader = Self { read, thread: Some(thread::spawn(run)) };
        let is_open = scene.wait(PATIENCE, || {
            let has_failed = reader.thread.as_ref().is_none_or(JoinHandle::is_finished);
            (has_failed || reader.read.is_open.load(Ordering::Relaxed)).then_some(!has_failed)
        });
        if is_open == Some(true) { Ok(reader) } else { Err(reader.join().unwrap_err().into()) }
    }

    /// What it has seen so far.
    pub(super) fn seen(&self) -> MutexGuard<'_, Seen> {
        self.read.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The newest frame.
    pub(super) fn newest(&self) -> Option<Got> {
        self.seen().frames.last().copied()
    }

    /// Waits for a frame, among those since the one at this place.
    pub(super) fn wait_for(
        &self,
        scene: &Scene,
        since: usize,
        within: Duration,
        is_it: impl Fn(&Got) -> bool,
    ) -> Option<Got> {
        scene.wait(within, || self.seen().frames.iter().skip(since).find(|got| is_it(got)).copied())
    }

    /// How many frames it has had.
    pub(super) fn count(&self) -> usize {
        self.seen().frames.len()
    }

    fn join(&mut self) -> Result<(), String> {
        self.read.stop.store(true, Ordering::Relaxed);
        let joined = self.thread.take().map(JoinHandle::join);
        joined.unwrap_or(Ok(Ok(()))).unwrap_or_else(|_| Err("a reader panicked".into()))
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let _ = self.join();
    }
}

fn read_all(domain: &Domain, service: &str, read: &Read) -> Result<(), Failure> {
    let participant = Participant::<ipc::Service>::join("torture", domain)?;
    let mut frames = FrameSubscriber::open(&participant, service, CHANNELS, Depth::All)?;
    let sent = raw_subscriber(&participant, service, CHANNELS)?;
    let mut cycles: HashMap<u64, u64> = HashMap::new();
    read.is_open.store(true, Ordering::Relaxed);
    while !read.stop.load(Ordering::Relaxed) {
        frames.maintain();
        participant.tend();
        let mut seen = read.seen.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(frame) = frames.next(Monotonic.now_ns()) {
            seen.frames.push(Got::new(frame.header(), frame.values()));
        }
        seen.counters = frames.counters();
        while let Some(sample) = sent.receive()? {
            let got = Got::new(sample.user_header(), sample.payload());
            let times = cycles.entry(got.cycle).or_default();
            *times += u64::from(!got.is_last);
            if *times > 1 {
                seen.twice.push(got.cycle);
            }
        }
        drop(seen);
        thread::sleep(LOOK);
    }
    Ok(())
}
