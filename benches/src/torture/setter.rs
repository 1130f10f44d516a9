//! An operator who sets a variable to one number after another, and notes which were acknowledged.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_control::{Client, SetParams};
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Domain, Participant, ipc};

use super::scene::Scene;

/// Between two sets.
const PAUSE: Duration = Duration::from_millis(5);
/// A holder that is killed answers nothing.
const ANSWERED_WITHIN: Duration = Duration::from_millis(500);

/// Sets `mark` until it is dropped.
pub(super) struct Setter {
    stop: Arc<AtomicBool>,
    acknowledged: Arc<Mutex<Vec<(f64, u64)>>>,
    thread: Option<JoinHandle<()>>,
}

impl Setter {
    /// Begins.
    pub(super) fn start(scene: &Scene, node: &'static str) -> Self {
        let (stop, acknowledged) = (Arc::<AtomicBool>::default(), Arc::default());
        let (is_due, list, domain) =
            (Arc::clone(&stop), Arc::clone(&acknowledged), Domain::clone(scene.domain()));
        let thread = thread::spawn(move || set_all(&domain, node, &is_due, &list));
        Self { stop, acknowledged, thread: Some(thread) }
    }

    /// The numbers that were acknowledged, and when, in ns of `CLOCK_MONOTONIC`.
    pub(super) fn acknowledged(&self) -> Vec<(f64, u64)> {
        self.acknowledged.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Setter {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().map(JoinHandle::join);
    }
}

fn set_all(domain: &Domain, node: &str, is_due: &AtomicBool, list: &Mutex<Vec<(f64, u64)>>) {
    let Ok(participant) = Participant::<ipc::Service>::join("torture", domain) else { return };
    let mut number = 0.0;
    let mut client = None;
    while !is_due.load(Ordering::Relaxed) {
        participant.tend();
        let connected = client
            .take()
            .map_or_else(|| Client::connect_to_act(&participant, node, ANSWERED_WITHIN), Ok);
        if let Ok(mut connected) = connected {
            number += 1.0;
            let values = [("mark", number)].into_iter().collect();
            // Unless it is answered, whether it was done is nobody's promise.
            if connected.call(&SetParams { values, ..SetParams::default() }).is_ok() {
                let mut list = list.lock().unwrap_or_else(PoisonError::into_inner);
                list.push((number, Monotonic.now_ns()));
                client = Some(connected);
            }
        }
        thread::sleep(PAUSE);
    }
}
