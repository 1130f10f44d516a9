//! The frames that a program publishes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone::cyclic::{Clock, Monotonic};
use isochrone::ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, Participant, SignalSpec, Stamp,
};
use isochrone::model::Flags;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::Ports;
use crate::errors::failed;
use crate::held::Held;
use crate::joined::Member;

/// From the announcement of the layout to the first frame: a node looks for layouts every 20 ms.
const HEAD_START: Duration = Duration::from_millis(50);
/// How often a reader that came is looked for.
const LOOK: Duration = Duration::from_millis(20);

/// The port, and the thread that tells readers what the frames are.
struct Writer {
    publisher: FramePublisher<Ports>,
    channels: usize,
    sequence: u64,
    _announcing: Announcing,
}

/// Publishes the frames of one service.
#[pyclass(frozen, module = "isochrone._native")]
pub(crate) struct FrameWriter(Held<Writer>);

#[pymethods]
impl FrameWriter {
    #[new]
    fn new(
        py: Python<'_>,
        member: Member,
        service: String,
        signals: Vec<(String, String, String)>,
        period_ns: Option<u64>,
        publisher: String,
    ) -> PyResult<Self> {
        let spec = |(name, value_type, unit)| SignalSpec { name, value_type, unit };
        let layout = FrameLayout { signals: signals.into_iter().map(spec).collect(), period_ns };
        let what = format!("the publisher of {service:?}");
        let writer = member.open(py, move |participant| {
            let opened = FramePublisher::open(&participant, &service, &layout).map_err(failed)?;
            let channels = layout.signals.len();
            let announcing = Announcing::start(participant, &service, &publisher, &layout)?;
            thread::sleep(HEAD_START);
            Ok(Writer { publisher: opened, channels, sequence: 0, _announcing: announcing })
        })?;
        Ok(Self(Held::new(what, writer)))
    }

    /// Sends a frame, and returns its sequence number.
    fn send(
        &self,
        values: PyReadonlyArray1<'_, f64>,
        flags: u64,
        cycle: u64,
        release_ns: u64,
        source_ns: u64,
        missed: u64,
    ) -> PyResult<u64> {
        let values = values.as_slice()?;
        let flags = Flags::from_bits(flags);
        self.0.with(|writer| {
            let Writer { publisher, channels, sequence, .. } = writer;
            if values.len() != *channels {
                return Err(failed(format!("{} values for {channels} signals", values.len())));
            }
            if !publisher.prepare() {
                return Err(failed(format!(
                    "{} has no memory for another frame: a reader holds more than two",
                    self.0.what()
                )));
            }
            if let Some(frame) = publisher.values_mut() {
                frame.copy_from_slice(values);
            }
            let stamp = Stamp { cycle, release_ns, source_ns, missed, flags };
            let sent = *sequence;
            *sequence += 1;
            if !publisher.send(stamp, || Monotonic.now_ns()) {
                let what = self.0.what();
                return Err(failed(format!(
                    "{what}: iceoryx2 delivered the frame to no reader, or not to all"
                )));
            }
            // What takes long is done before the next frame is due.
            publisher.prepare();
            Ok(sent)
        })?
    }

    /// How many readers the service has.
    #[getter]
    fn readers(&self) -> PyResult<usize> {
        self.0.with(|writer| writer.publisher.subscribers())
    }

    /// Leaves the service; whether that had not been done before.
    fn close(&self, py: Python<'_>) -> PyResult<bool> {
        let writer = self.0.take()?;
        Ok(py.detach(|| writer.map(drop)).is_some())
    }
}

/// The thread that announces what the frames are, however seldom those are sent, and makes good failed connections. It
/// ends when this is dropped.
struct Announcing {
    is_over: Arc<AtomicBool>,
    /// `None`: it has ended.
    thread: Option<JoinHandle<()>>,
}

impl Announcing {
    fn start(
        participant: Arc<Participant<Ports>>,
        service: &str,
        publisher: &str,
        layout: &FrameLayout,
    ) -> PyResult<Self> {
        let opened = LayoutAnnouncer::open(&participant, service, publisher, layout);
        let mut announcer = opened.map_err(failed)?;
        let is_over = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&is_over);
        let announce = move || {
            while !over.load(Ordering::Relaxed) {
                announcer.tend(&participant);
                participant.tend();
                thread::park_timeout(LOOK);
            }
        };
        let thread = thread::Builder::new().name("announce".to_owned()).spawn(announce);
        let thread = thread.map_err(|cause| failed(format!("cannot start a thread: {cause}")))?;
        Ok(Self { is_over, thread: Some(thread) })
    }
}

impl Drop for Announcing {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It does nothing that could panic but for iceoryx2, and there is nobody to tell.
            let _ = thread.join();
        }
    }
}
