//! The frames that a program publishes.

use std::thread;
use std::time::Duration;

use isochrone::cyclic::{Clock, Monotonic};
use isochrone::ipc::{
    Announcing, FrameLayout, FramePublisher, SignalSpec, Stamp, check_service_name,
    refuse_own_service,
};
use isochrone::model::Flags;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::Ports;
use crate::errors::failed;
use crate::held::Held;
use crate::joined::Member;

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
        check_service_name(&service).and_then(|()| refuse_own_service(&service)).map_err(failed)?;
        let writer = member.open(py, move |participant| {
            participant.refuse_far_writers(&[&service]).map_err(failed)?;
            let opened = FramePublisher::open(&participant, &service, &layout).map_err(failed)?;
            let channels = layout.signals.len();
            let announcing = Announcing::start(&participant, &service, &publisher, &layout);
            let announcing = announcing.map_err(failed)?;
            thread::sleep(Duration::from_nanos(Announcing::HEAD_START_NS));
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
