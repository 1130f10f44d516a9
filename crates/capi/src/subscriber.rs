//! Following a service.
#![allow(unsafe_code)] // the C interface

use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};
use std::time::Duration;

use isochrone_ipc::{
    Announcement, Depth, LayoutKey, SignalError, SignalFrame, SignalReader, ToldLayouts, ipc,
};

use crate::arguments::{Place, array, text};
use crate::handles::{self, Port};
use crate::joined::Tended;
use crate::participant::{isochrone_participant, joined};
use crate::publisher::{failure, isochrone_signal};
use crate::status::{
    Failure, ISOCHRONE_ERROR_SIGNAL, ISOCHRONE_NOTHING, ISOCHRONE_OK, act, c_string, call,
    isochrone_status,
};

/// How many channels a frame is taken for, where the subscriber creates the service.
const CHANNELS: usize = 1_000;

/// A reader of a service. It belongs to the thread that opened it.
pub struct isochrone_subscriber {
    _private: (),
}

/// A frame that was received. All times are in ns of CLOCK_MONOTONIC.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct isochrone_frame {
    /// The values of the wanted signals in the order in which they were named; of all signals, where the publisher wrote
    /// them, if none was named. Valid until the next call with this subscriber.
    pub values: *const f64,
    /// How many values there are.
    pub count: usize,
    /// What they are worth: ISOCHRONE_STALE and so on; 0: nothing is known to be wrong.
    pub flags: u64,
    /// From when on the values age: isochrone_now_ns() - sampled_ns is how old they are. When the frame was sent, or when
    /// it came if the sender has another clock.
    pub sampled_ns: u64,
    /// When the frame was received.
    pub received_ns: u64,
    /// Time of the oldest sample behind the values, to be passed on in the stamp of what is computed from them.
    pub source_ns: u64,
    /// When the sender's cycle was due; 0 if it has none.
    pub release_ns: u64,
    /// When the frame was sent, by the sender's clock.
    pub publish_ns: u64,
    /// 0, 1, 2 and so on of one publisher.
    pub sequence: u64,
    /// The sender's cycle, those that it left out included.
    pub cycle: u64,
    /// Cycles that the sender has left out since its start.
    pub missed: u64,
    /// Frames that were lost between the one received before and this one.
    pub lost: u64,
    /// How often the publisher was started again or replaced in between.
    pub restarts: u64,
}

pub(crate) struct Subscriber {
    reader: SignalReader<'static, ipc::Service>,
    names: Vec<String>,
    /// The values of the wanted signals in the frame that was given last.
    wanted: Vec<f64>,
    /// What the values of frames of this layout are.
    signals: Option<(LayoutKey, Vec<Words>)>,
    _told: Tended,
}

/// Of a signal, for C.
struct Words {
    name: CString,
    value_type: CString,
    unit: CString,
}

impl Port for Subscriber {
    type Handle = isochrone_subscriber;
    const NOUN: &str = "subscriber";
}

type Reader = SignalReader<'static, ipc::Service>;

impl Subscriber {
    /// What a call of the reader gives, for C.
    fn give(
        &mut self,
        place: &Place<isochrone_frame>,
        take: impl FnOnce(&mut Reader) -> Option<SignalFrame<'_, ipc::Service>>,
    ) -> Result<isochrone_status, Failure> {
        let Self { reader, names, wanted, signals, .. } = self;
        let Some(frame) = take(reader) else { return Ok(ISOCHRONE_NOTHING) };
        let key = frame.layout();
        if signals.as_ref().is_none_or(|(known, _)| *known != key) {
            let announced = frame.announced();
            *signals = Some((key, announced.map_or(Vec::new(), |known| words(known, names))));
        }
        let mut of_c = plain(&frame);
        let found = if names.is_empty() {
            let channels = frame.channels();
            (of_c.values, of_c.count) = (channels.as_ptr(), channels.len());
            Ok(())
        } else {
            frame.values().map(|values| {
                wanted.clear();
                wanted.extend(values.map(|(_, value)| value));
                (of_c.values, of_c.count) = (wanted.as_ptr(), wanted.len());
            })
        };
        place.set(of_c);
        found
            .map(|()| ISOCHRONE_OK)
            .map_err(|error: SignalError| Failure::new(ISOCHRONE_ERROR_SIGNAL, error))
    }
}

/// A frame without its values.
fn plain(frame: &SignalFrame<'_, ipc::Service>) -> isochrone_frame {
    let (header, receipt) = (frame.header(), frame.receipt());
    let times = receipt.credible();
    isochrone_frame {
        values: null(),
        count: 0,
        flags: header.flags,
        sampled_ns: times.sampled_ns,
        received_ns: receipt.received_ns,
        source_ns: times.source_ns,
        release_ns: header.release_ns,
        publish_ns: header.publish_ns,
        sequence: header.sequence,
        cycle: header.cycle,
        missed: header.missed,
        lost: receipt.lost,
        restarts: receipt.restarts,
    }
}

/// The words for the signals that are given: the wanted ones, or all.
fn words(announced: &Announcement, names: &[String]) -> Vec<Words> {
    let all = &announced.layout.signals;
    let find = |name: &String| all.iter().find(|signal| signal.name == *name);
    let given: Vec<_> = if names.is_empty() {
        all.iter().collect()
    } else {
        names.iter().filter_map(find).collect()
    };
    let of_c = |signal: &isochrone_ipc::SignalSpec| Words {
        name: c_string(&signal.name),
        value_type: c_string(&signal.value_type),
        unit: c_string(&signal.unit),
    };
    given.into_iter().map(of_c).collect()
}

/// Opens a service for reading. Publisher and subscriber may start in any order.
///
/// names: the wanted signals, whose values each frame then gives in this order. They are found by the names that the
/// publisher announces, also when it starts again with other signals. NULL with a count of 0: all signals as they are.
/// subscriber: receives the handle; NULL on failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_subscriber_open(
    participant: *mut isochrone_participant,
    service: *const c_char,
    names: *const *const c_char,
    count: usize,
    subscriber: *mut *mut isochrone_subscriber,
) -> isochrone_status {
    act(|| {
        // SAFETY: these are the pointers that the interface asks for.
        let (service, names, place) = unsafe {
            let place = Place::new(subscriber, "subscriber")?;
            place.set(null_mut());
            (text(service, "service")?, array(names, count, "names")?, place)
        };
        // SAFETY: and so are those in the array.
        let names = names.iter().map(|name| unsafe { text(*name, "a name") });
        let names: Vec<&str> = names.collect::<Result<_, _>>()?;
        let joined = joined(participant)?;
        let told = ToldLayouts::default();
        let channels = names.len().max(CHANNELS);
        // First the layouts, which a publisher that sees the reader and ends has announced to all who listen.
        let tended = joined.hear(service, &told).map_err(|error| failure(&error))?;
        let port = joined.participant.subscriber(service, channels, Depth::All);
        let port = port.map_err(|error| failure(&error))?;
        let subscriber = port.map(|port| Subscriber {
            reader: SignalReader::told(port, service, &names, told),
            wanted: Vec::with_capacity(names.len()),
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            signals: None,
            _told: tended,
        });
        place.set(handles::open(subscriber)?);
        Ok(())
    })
}

/// Gives the newest frame and leaves out those before it: for what needs the present value. ISOCHRONE_NOTHING: none has
/// come since the last one that was given.
///
/// It never waits. While the publisher keeps its signals, it neither allocates nor makes a system call.
///
/// ISOCHRONE_ERROR_SIGNAL: the frame lacks a wanted signal, or has no names. All but its values is there then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_subscriber_newest(
    subscriber: *mut isochrone_subscriber,
    frame: *mut isochrone_frame,
) -> isochrone_status {
    // SAFETY: this is the pointer that the interface asks for.
    unsafe { give(subscriber, frame, Reader::newest_frame) }
}

/// Gives the next frame in line: for what needs every one. As isochrone_subscriber_newest() otherwise. Up to 256 frames
/// wait; what the oldest of more were is told as `lost`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_subscriber_next(
    subscriber: *mut isochrone_subscriber,
    frame: *mut isochrone_frame,
) -> isochrone_status {
    // SAFETY: this is the pointer that the interface asks for.
    unsafe { give(subscriber, frame, Reader::next_frame) }
}

/// Sleeps until there is a frame, and gives the next one in line. ISOCHRONE_NOTHING: none came in this time.
///
/// It sleeps until the next frame is due by the period that the publisher announces; nobody has to wake it. A signal does
/// not end it: to end on one, wait for a short time and look.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_subscriber_wait(
    subscriber: *mut isochrone_subscriber,
    timeout_ns: u64,
    frame: *mut isochrone_frame,
) -> isochrone_status {
    let timeout = Duration::from_nanos(timeout_ns);
    // SAFETY: this is the pointer that the interface asks for.
    unsafe { give(subscriber, frame, |reader| reader.wait(timeout)) }
}

/// Connects to publishers that joined, and takes what they announce: for the slack of a cycle, as it allocates then. The
/// other calls do it every 10 ms if this is not called.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_subscriber_maintain(
    subscriber: *mut isochrone_subscriber,
) -> isochrone_status {
    act(|| {
        handles::with(subscriber, |subscriber: &mut Subscriber| {
            subscriber.reader.maintain();
            Ok(())
        })
    })
}

/// What the values of the frame that was given last are: the signal of values[index]. Its texts are valid until a frame
/// with other signals is given, and never NULL; an unknown type is empty, and so is no unit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isochrone_subscriber_signal(
    subscriber: *mut isochrone_subscriber,
    index: usize,
    signal: *mut isochrone_signal,
) -> isochrone_status {
    act(|| {
        // SAFETY: this is the pointer that the interface asks for.
        let place = unsafe { Place::new(signal, "signal") }?;
        place.set(isochrone_signal { name: null(), r#type: null(), unit: null() });
        handles::with(subscriber, |Subscriber { signals, reader, .. }| {
            let words = signals.as_ref().and_then(|(_, words)| words.get(index));
            let Words { name, value_type, unit } = words.ok_or_else(|| {
                let service = reader.service();
                let sentence = format!(
                    "the last frame of service {service:?} has no signal with index {index} whose name is known"
                );
                Failure::new(ISOCHRONE_ERROR_SIGNAL, sentence)
            })?;
            place.set(isochrone_signal {
                name: name.as_ptr(),
                r#type: value_type.as_ptr(),
                unit: unit.as_ptr(),
            });
            Ok(())
        })
    })
}

/// Ends a subscriber. NULL is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_subscriber_close(
    subscriber: *mut isochrone_subscriber,
) -> isochrone_status {
    act(|| handles::close::<Subscriber>(subscriber))
}

/// # Safety
/// `frame` is NULL or may be written to.
unsafe fn give(
    subscriber: *mut isochrone_subscriber,
    frame: *mut isochrone_frame,
    take: impl FnOnce(&mut Reader) -> Option<SignalFrame<'_, ipc::Service>>,
) -> isochrone_status {
    call(|| {
        // SAFETY: as the caller promises.
        let place = unsafe { Place::new(frame, "frame") }?;
        handles::with(subscriber, |subscriber: &mut Subscriber| subscriber.give(&place, take))
    })
}
