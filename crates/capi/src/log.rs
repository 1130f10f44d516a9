//! What the library remarks beside the results of calls.
#![allow(unsafe_code)] // the C interface

use std::ffi::{c_char, c_void};
use std::fmt::{Debug, Write};

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::{Event, Level, Metadata, Subscriber, subscriber};

use crate::status::{Failure, act, c_string, isochrone_status};

/// How much a remark matters.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum isochrone_level {
    /// Something does not work.
    ISOCHRONE_LEVEL_ERROR = 1,
    /// Something may not work, such as a process that is stopped and holds up others.
    ISOCHRONE_LEVEL_WARNING = 2,
    /// What is opened and joined.
    ISOCHRONE_LEVEL_INFO = 3,
}

use isochrone_level::*;

/// Receives a remark, a line of text that is valid during the call. It comes from any thread, also one of the library,
/// and must not call the library.
pub type isochrone_log_sink =
    Option<extern "C" fn(level: isochrone_level, message: *const c_char, context: *mut c_void)>;

/// Says who receives what the library remarks, for the whole program and once. Without it, nobody does. No call of a
/// cycle remarks anything.
///
/// context: is passed to the sink as it is.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_log_to(
    sink: isochrone_log_sink,
    context: *mut c_void,
) -> isochrone_status {
    act(|| {
        let sink = sink.ok_or_else(|| Failure::argument("the sink is NULL"))?;
        let log = Log { sink, context: context.expose_provenance() };
        let taken = |_| Failure::argument("this program has a log already; say once where it goes");
        subscriber::set_global_default(log).map_err(taken)
    })
}

/// The context as a number, as any thread passes it on.
struct Log {
    sink: extern "C" fn(isochrone_level, *const c_char, *mut c_void),
    context: usize,
}

impl Subscriber for Log {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.is_event() && *metadata.level() <= Level::INFO
    }

    fn event(&self, event: &Event<'_>) {
        let level = match *event.metadata().level() {
            Level::ERROR => ISOCHRONE_LEVEL_ERROR,
            Level::WARN => ISOCHRONE_LEVEL_WARNING,
            _ => ISOCHRONE_LEVEL_INFO,
        };
        let mut message = Message(String::new());
        event.record(&mut message);
        let context = std::ptr::with_exposed_provenance_mut(self.context);
        (self.sink)(level, c_string(&message.0).as_ptr(), context);
    }

    // There are no spans.
    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The text of an event.
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            let _ = write!(self.0, "{value:?}");
        }
    }
}
