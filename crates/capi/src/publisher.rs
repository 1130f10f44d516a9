//! Writing frames.
#![allow(unsafe_code)] // the C interface

use std::ffi::c_char;
use std::ptr::null_mut;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    FrameLayout, FramePublisher, OpenError, SignalSpec, Stamp, check_service_name, ipc,
    refuse_own_service,
};
use isochrone_model::Flags;

use crate::arguments::{Place, array, optional, optional_text, text};
use crate::handles::{self, Port};
use crate::joined::Tended;
use crate::participant::{isochrone_participant, joined};
use crate::status::{
    Failure, ISOCHRONE_ERROR_FRAME, ISOCHRONE_ERROR_SERVICE, ISOCHRONE_ERROR_WRITER, act,
    isochrone_status,
};

/// The types that a node's inputs can have.
const TYPES: [&str; 5] = ["LREAL", "INT", "BOOL", "TIME", "WORD"];

/// The writer of a service. It belongs to the thread that opened it.
pub struct isochrone_publisher {
    _private: (),
}

/// A value of a frame: its name, and what it is.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct isochrone_signal {
    /// Such as "level.y".
    pub name: *const c_char,
    /// "LREAL", "INT", "BOOL", "TIME" or "WORD". NULL is LREAL when a publisher is opened, and unknown in what a
    /// subscriber learned.
    pub r#type: *const c_char,
    /// Such as "m"; NULL: none.
    pub unit: *const c_char,
}

/// What the sender of a frame knows about it. All zero is fine for a program without cycles.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct isochrone_stamp {
    /// Index of the cycle, those that were left out included.
    pub cycle: u64,
    /// When the cycle was due, in ns of CLOCK_MONOTONIC.
    pub release_ns: u64,
    /// Time of the oldest sample behind the values: source_ns of the frames that they are computed from; 0: none.
    pub source_ns: u64,
    /// Cycles left out since the start.
    pub missed: u64,
    /// What the values are worth: ISOCHRONE_STALE and so on; 0: nothing to say.
    pub flags: u64,
}

pub(crate) struct Publisher {
    port: FramePublisher<ipc::Service>,
    _announced: Tended,
}

impl Port for Publisher {
    type Handle = isochrone_publisher;
    const NOUN: &str = "publisher";
}

/// Opens a service for writing, and announces its signals to all who read it. A service has one writer: where another
/// lives, here or behind a link, ISOCHRONE_ERROR_WRITER names its node and process.
///
/// signals: the values of each frame, in their order; they are copied.
/// period_ns: the time between two frames; 0 if they come at no fixed rate. Readers that sleep wake up by it.
/// publisher: receives the handle; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_publisher_open(
    participant: *mut isochrone_participant,
    service: *const c_char,
    signals: *const isochrone_signal,
    count: usize,
    period_ns: u64,
    publisher: *mut *mut isochrone_publisher,
) -> isochrone_status {
    // SAFETY: these are the pointers that the interface asks for.
    act(|| unsafe { open(participant, service, (signals, count), period_ns, publisher, false) })
}

/// As isochrone_publisher_open(), and takes the service over from a living writer that is not of isochrone, such as one
/// that uses iceoryx2 alone. Readers follow this publisher at once. One of isochrone, or behind a link, is refused still.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_publisher_take_over(
    participant: *mut isochrone_participant,
    service: *const c_char,
    signals: *const isochrone_signal,
    count: usize,
    period_ns: u64,
    publisher: *mut *mut isochrone_publisher,
) -> isochrone_status {
    // SAFETY: these are the pointers that the interface asks for.
    act(|| unsafe { open(participant, service, (signals, count), period_ns, publisher, true) })
}

/// # Safety
/// The pointers are NULL or what the interface asks for.
unsafe fn open(
    participant: *mut isochrone_participant,
    service: *const c_char,
    (signals, count): (*const isochrone_signal, usize),
    period_ns: u64,
    publisher: *mut *mut isochrone_publisher,
    takes_over: bool,
) -> Result<(), Failure> {
    // SAFETY: as the caller promises.
    let (service, signals, place) = unsafe {
        let place = Place::new(publisher, "publisher")?;
        place.set(null_mut());
        (text(service, "service")?, array(signals, count, "signals")?, place)
    };
    // SAFETY: and so are those in the signals.
    let signals = signals.iter().map(|signal| unsafe { spec(signal) });
    let signals = signals.collect::<Result<_, _>>()?;
    let layout = FrameLayout { signals, period_ns: (period_ns > 0).then_some(period_ns) };
    let named = check_service_name(service).and_then(|()| refuse_own_service(service));
    named.map_err(|error| failure(&error.into()))?;
    let joined = joined(participant)?;
    let open = || {
        let participant = &joined.participant;
        participant.ordinary().refuse_far_writers(&[service])?;
        let port = if takes_over {
            participant.take_over(service, &layout)?
        } else {
            participant.publisher(service, &layout)?
        };
        Ok((port, joined.announce(service, &layout)?))
    };
    let (port, announced) = open().map_err(|error| failure(&error))?;
    place.set(handles::open(port.map(|port| Publisher { port, _announced: announced }))?);
    Ok(())
}

/// Gives the place for the values of the next frame, as many as there are signals, in shared memory. What is written
/// there is sent in place.
///
/// In a cycle, call it in the slack, after isochrone_publisher_send(): it allocates, and connects to readers that joined.
/// Until the frame is sent, further calls give the same place with what was written. A new frame is all zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_publisher_loan(
    publisher: *mut isochrone_publisher,
    values: *mut *mut f64,
) -> isochrone_status {
    act(|| {
        // SAFETY: this is the pointer that the interface asks for.
        let place = unsafe { Place::new(values, "values") }?;
        place.set(null_mut());
        handles::with(publisher, |Publisher { port, .. }| {
            port.prepare();
            let values = port.values_mut().ok_or_else(|| {
                Failure::fixed(
                    ISOCHRONE_ERROR_FRAME,
                    c"no frame can be loaned: readers hold too many; see that they give frames back",
                )
            })?;
            place.set(values.as_mut_ptr());
            Ok(())
        })
    })
}

/// Sends the frame that was loaned. Its values must not be touched afterwards. Without one, the number of this frame is
/// left out, so that readers count it as lost.
///
/// It neither waits nor allocates, and makes no system call unless a reader has just joined or left.
///
/// stamp: NULL is one that is all zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_publisher_send(
    publisher: *mut isochrone_publisher,
    stamp: *const isochrone_stamp,
) -> isochrone_status {
    act(|| {
        // SAFETY: this is the pointer that the interface asks for.
        let stamp = unsafe { optional(stamp) }.map(Stamp::from).unwrap_or_default();
        handles::with(publisher, |Publisher { port, .. }| {
            if port.send(stamp, || Monotonic.now_ns()) {
                return Ok(());
            }
            Err(Failure::fixed(
                ISOCHRONE_ERROR_FRAME,
                c"no frame was sent: call isochrone_publisher_loan before each isochrone_publisher_send",
            ))
        })
    })
}

/// Ends a publisher. NULL is allowed. Readers take its last values for good until they are too old: send a frame with
/// ISOCHRONE_STOPPED first, to tell them at once.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_publisher_close(
    publisher: *mut isochrone_publisher,
) -> isochrone_status {
    act(|| handles::close::<Publisher>(publisher))
}

/// # Safety
/// Its pointers are NULL or texts.
unsafe fn spec(signal: &isochrone_signal) -> Result<SignalSpec, Failure> {
    // SAFETY: as the caller promises.
    let (name, value_type, unit) = unsafe {
        (
            text(signal.name, "the name of a signal")?,
            optional_text(signal.r#type, "the type of a signal")?.unwrap_or("LREAL"),
            optional_text(signal.unit, "the unit of a signal")?.unwrap_or_default(),
        )
    };
    if !TYPES.contains(&value_type) {
        let types = TYPES.join(", ");
        return Err(Failure::argument(format!(
            "signal {name:?}: there is no type {value_type:?}; give one of {types}"
        )));
    }
    Ok(SignalSpec::new(name, value_type).in_unit(unit))
}

/// The failure of opening a port.
pub(crate) fn failure(error: &OpenError) -> Failure {
    let status = match error {
        OpenError::SecondPublisher { .. }
        | OpenError::PlainWriter { .. }
        | OpenError::FarWriter { .. } => ISOCHRONE_ERROR_WRITER,
        _ => ISOCHRONE_ERROR_SERVICE,
    };
    Failure::new(status, error)
}

impl From<isochrone_stamp> for Stamp {
    fn from(stamp: isochrone_stamp) -> Self {
        let isochrone_stamp { cycle, release_ns, source_ns, missed, flags } = stamp;
        Self { cycle, release_ns, source_ns, missed, flags: Flags::from_bits(flags) }
    }
}
