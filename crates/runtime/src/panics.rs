//! Panics of blocks, in the threads of tasks.

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

/// A panic of a block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Panic {
    /// What the panic said.
    pub message: String,
    /// File, line and column of the source; `None` unless [`hold_panic_messages`] was called.
    pub place: Option<String>,
}

thread_local! {
    /// Whether this thread is running cycles.
    static IN_CYCLES: Cell<bool> = const { Cell::new(false) };
    /// Where in the source it panicked.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps the messages of blocks that panic for [`finish`](crate::Running::finish), with the place in
/// the source, instead of writing them to stderr at once. All other panics are reported as before.
///
/// Without it a task whose block panics first writes to stderr. If stderr is a pipe that nobody
/// empties, that holds up the task, and with it the end of the node. For the start of a program: it
/// wraps the panic hook that is set then.
pub fn hold_panic_messages() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if IN_CYCLES.get() {
                PLACE.set(info.location().map(ToString::to_string));
            } else {
                before(info);
            }
        }));
    });
}

/// Runs cycles of a task, and returns when they have ended. After a panic the engine must not be stepped again.
///
/// # Errors
/// A block panicked; [`TaskEngine::stepping`](isochrone_engine::TaskEngine::stepping) says which.
pub fn catch_panic(cycles: impl FnOnce()) -> Result<(), Panic> {
    IN_CYCLES.set(true);
    let ended = panic::catch_unwind(AssertUnwindSafe(cycles));
    IN_CYCLES.set(false);
    ended.map_err(|panic| Panic { message: message(&*panic), place: PLACE.take() })
}

/// What a panic said.
pub(crate) fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}
