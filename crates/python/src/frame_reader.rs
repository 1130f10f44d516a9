//! The frames of a service, as a program reads them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use isochrone::ipc::{LayoutKey, Receipt, SenderClock, SignalFrame, SignalReader, SignalSpec};
use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyBufferError;
use pyo3::prelude::*;

use crate::Ports;
use crate::errors::failed;
use crate::held::Held;
use crate::interruption::wait_in_steps;
use crate::joined::Member;
use crate::lent::Lent;

/// What a frame is in Python: its values, the object for its layout, the numbers of its header and receipt.
type Given<'py> = (Bound<'py, PyArray1<f64>>, Py<PyAny>, [u64; 12]);

struct Reader {
    port: SignalReader<'static, Ports>,
    /// Shared with the arrays that show a frame where it lies.
    token: Arc<()>,
}

/// A frame that was copied.
struct Copied {
    values: Vec<f64>,
    receipt: Receipt,
    sampled_ns: u64,
    key: LayoutKey,
    /// `None`: as that of the frame before.
    layout: Option<Described>,
}

/// What a layout is made of in Python.
#[derive(IntoPyObject)]
struct Described {
    names: Vec<String>,
    types: Vec<String>,
    units: Vec<String>,
    publisher: Option<String>,
    period_ns: Option<u64>,
    is_here: bool,
    error: Option<String>,
}

/// Reads the frames of one service.
#[pyclass(frozen, module = "isochrone._native")]
pub(crate) struct FrameReader {
    held: Held<Reader>,
    /// Makes the object for a layout.
    layout: Py<PyAny>,
    /// The layout of the frame before, and its object.
    known: Mutex<Option<(LayoutKey, Py<PyAny>)>>,
}

#[pymethods]
impl FrameReader {
    #[new]
    fn new(
        py: Python<'_>,
        member: Member,
        service: String,
        names: Vec<String>,
        layout: Py<PyAny>,
    ) -> PyResult<Self> {
        let what = format!("the subscriber of {service:?}");
        let port = member.open(py, move |participant| {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            SignalReader::open(participant, &service, &names).map_err(failed)
        })?;
        let held = Held::new(what, Reader { port, token: Arc::default() });
        Ok(Self { held, layout, known: Mutex::new(None) })
    }

    /// The next frame in line; `None`: none came in this time, in seconds.
    fn wait<'py>(&self, py: Python<'py>, timeout: Option<f64>) -> PyResult<Option<Given<'py>>> {
        let timeout = seconds(timeout)?;
        let found = wait_in_steps(py, timeout, |step| {
            self.reading(|reader| {
                let known = self.known_key();
                reader.port.wait(step).map(|frame| Copied::of(&frame, known))
            })
        })?;
        found.map(|copied| self.give(py, copied)).transpose()
    }

    /// The newest of the frames that wait; `None`: none does.
    fn newest<'py>(&self, py: Python<'py>) -> PyResult<Option<Given<'py>>> {
        let newest = self.reading(|reader| {
            let known = self.known_key();
            reader.port.newest_frame().map(|frame| Copied::of(&frame, known))
        })?;
        newest.map(|copied| self.give(py, copied)).transpose()
    }

    /// The next frame in line, with all of its values, where it lies; `None` as with `wait`. No other frame can be
    /// received until the array is gone.
    fn lend<'py>(slf: &Bound<'py, Self>, timeout: Option<f64>) -> PyResult<Option<Given<'py>>> {
        let (py, this) = (slf.py(), slf.get());
        let timeout = seconds(timeout)?;
        let found = wait_in_steps(py, timeout, |step| {
            this.reading(|reader| {
                let known = this.known_key();
                let token = Arc::clone(&reader.token);
                let frame = reader.port.wait(step)?;
                let place = (frame.channels().as_ptr() as usize, frame.channels().len());
                Some((Copied { values: Vec::new(), ..Copied::of(&frame, known) }, place, token))
            })
        })?;
        let Some((copied, (address, len), token)) = found else { return Ok(None) };
        let (_, layout, numbers) = this.give(py, copied)?;
        let lent = Lent { _token: token, _reader: slf.clone().into_any().unbind() };
        let lent = Bound::new(py, lent)?.into_any();
        #[expect(unsafe_code, reason = "an array of NumPy over memory that is not NumPy's")]
        // SAFETY: `address` and `len` are of the slice `channels` of the frame that the port gave last, either in the
        // sample that its subscriber holds or in its own vector. Both stay where they are, and nobody writes to them,
        // until the port is asked for another frame or dropped. `reading` and `close`, the only ways to the port,
        // refuse that while a clone of the token lives, and `lent`, which is the base of the array, has one; it also
        // keeps the reader.
        let array = unsafe {
            let values = std::slice::from_raw_parts(address as *const f64, len);
            PyArray1::borrow_from_array(&ArrayView1::from(values), lent)
        };
        array.readwrite().make_nonwriteable();
        Ok(Some((array, layout, numbers)))
    }

    /// Whether an array shows a frame where it lies.
    #[getter]
    fn is_lent(&self) -> PyResult<bool> {
        self.held.with(|reader| Arc::strong_count(&reader.token) > 1)
    }

    /// Leaves the service.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let is_lent = self.held.with(|reader| Arc::strong_count(&reader.token) > 1);
        match is_lent {
            Ok(true) => return Err(self.lent()),
            Err(error) if !error.is_instance_of::<crate::errors::Closed>(py) => return Err(error),
            Ok(false) | Err(_) => {}
        }
        let port = self.held.take()?;
        py.detach(|| drop(port));
        Ok(())
    }
}

impl FrameReader {
    /// Uses the port, unless a frame is lent.
    fn reading<R>(&self, act: impl FnOnce(&mut Reader) -> R) -> PyResult<R> {
        self.held.with(|reader| match Arc::strong_count(&reader.token) {
            1 => Ok(act(reader)),
            _ => Err(self.lent()),
        })?
    }

    fn known(&self) -> MutexGuard<'_, Option<(LayoutKey, Py<PyAny>)>> {
        // It is held for some instructions only.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn known_key(&self) -> Option<LayoutKey> {
        self.known().as_ref().map(|(key, _)| *key)
    }

    fn lent(&self) -> PyErr {
        PyBufferError::new_err(format!(
            "{}: an array still shows a frame where it lies; let go of it, or keep a copy (.copy())",
            self.held.what()
        ))
    }

    fn give<'py>(&self, py: Python<'py>, copied: Copied) -> PyResult<Given<'py>> {
        let Copied { values, receipt, sampled_ns, key, layout } = copied;
        let object = match layout {
            Some(described) => {
                let object = self.layout.call1(py, (described,))?;
                *self.known() = Some((key, object.clone_ref(py)));
                object
            }
            None => match &*self.known() {
                Some((known, object)) if *known == key => object.clone_ref(py),
                _ => return Err(failed(format!("{} was used by two threads", self.held.what()))),
            },
        };
        let header = receipt.header;
        let numbers = [
            header.sequence,
            header.cycle,
            header.release_ns,
            header.publish_ns,
            header.source_ns,
            header.missed,
            header.flags,
            header.term,
            receipt.received_ns,
            sampled_ns,
            receipt.lost,
            receipt.restarts,
        ];
        Ok((PyArray1::from_vec(py, values), object, numbers))
    }
}

impl Copied {
    fn of(frame: &SignalFrame<'_, Ports>, known: Option<LayoutKey>) -> Self {
        let receipt = frame.receipt();
        let values = match frame.values() {
            Ok(values) => values.map(|(_, value)| value).collect(),
            Err(_) => frame.channels().to_vec(),
        };
        let sampled_ns = receipt.credible().sampled_ns;
        let key = frame.layout();
        let layout = (known != Some(key)).then(|| Described::of(frame));
        Self { values, receipt, sampled_ns, key, layout }
    }
}

impl Described {
    fn of(frame: &SignalFrame<'_, Ports>) -> Self {
        let announced = frame.announced();
        let signals = announced.map_or(&[][..], |announced| &announced.layout.signals);
        let (wanted, error): (Vec<&str>, _) = match frame.values() {
            Ok(values) => (values.map(|(name, _)| name).collect(), None),
            Err(error) => (Vec::new(), Some(frame.obstacle().unwrap_or_else(|| error.to_string()))),
        };
        let specs: HashMap<&str, &SignalSpec> =
            signals.iter().map(|signal| (signal.name.as_str(), signal)).collect();
        let column = |of: fn(&SignalSpec) -> &String| {
            let found = wanted.iter().map(|name| specs.get(name).map(|signal| of(signal).clone()));
            found.map(Option::unwrap_or_default).collect()
        };
        Self {
            types: column(|signal| &signal.value_type),
            units: column(|signal| &signal.unit),
            names: wanted.iter().map(|name| (*name).to_owned()).collect(),
            publisher: announced.map(|announced| announced.publisher.clone()),
            period_ns: announced.and_then(|announced| announced.layout.period_ns),
            is_here: announced.is_none_or(|announced| announced.clock() == SenderClock::Shared),
            error,
        }
    }
}

/// A time to wait.
fn seconds(timeout: Option<f64>) -> PyResult<Option<Duration>> {
    let read = |seconds: f64| {
        Duration::try_from_secs_f64(seconds).map_err(|_| {
            let message =
                format!("timeout is {seconds:?}; give seconds from 0, or None to wait for ever");
            pyo3::exceptions::PyValueError::new_err(message)
        })
    };
    timeout.map(read).transpose()
}
