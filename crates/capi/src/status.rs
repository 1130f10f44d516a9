//! How a call went, as a code and a sentence.
#![allow(unsafe_code)] // the C interface

use std::any::Any;
use std::borrow::Cow;
use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a call went. What is below 0 is an error, and isochrone_last_error() says in a sentence what is wrong and what to
/// do about it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum isochrone_status {
    /// Done.
    ISOCHRONE_OK = 0,
    /// There is no frame yet. No error, and without a sentence.
    ISOCHRONE_NOTHING = 1,
    /// A pointer is NULL that must not be, a text is not UTF-8, or a number is out of range.
    ISOCHRONE_ERROR_ARGUMENT = -1,
    /// The handle was closed, or is none.
    ISOCHRONE_ERROR_CLOSED = -2,
    /// The handle belongs to another thread.
    ISOCHRONE_ERROR_THREAD = -3,
    /// The domain cannot be found or joined.
    ISOCHRONE_ERROR_DOMAIN = -4,
    /// The service cannot be opened.
    ISOCHRONE_ERROR_SERVICE = -5,
    /// Somebody else writes the service.
    ISOCHRONE_ERROR_WRITER = -6,
    /// No frame could be loaned or sent.
    ISOCHRONE_ERROR_FRAME = -7,
    /// A frame lacks a signal that was asked for, or its publisher announces no names.
    ISOCHRONE_ERROR_SIGNAL = -8,
    /// The node does not run, or gave no answer.
    ISOCHRONE_ERROR_NODE = -9,
    /// The node refused the call; the answer has its reasons.
    ISOCHRONE_ERROR_REFUSED = -10,
    /// A fault of this library. Close the handle that was used.
    ISOCHRONE_ERROR_INTERNAL = -11,
}

pub use isochrone_status::*;

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: isochrone_status,
    sentence: Cow<'static, CStr>,
}

impl Failure {
    pub(crate) fn new(status: isochrone_status, sentence: impl Display) -> Self {
        Self { status, sentence: Cow::Owned(c_string(&sentence.to_string())) }
    }

    pub(crate) fn argument(sentence: impl Display) -> Self {
        Self::new(ISOCHRONE_ERROR_ARGUMENT, sentence)
    }

    /// Of a call in a cycle, which does not allocate for it.
    pub(crate) fn fixed(status: isochrone_status, sentence: &'static CStr) -> Self {
        Self { status, sentence: Cow::Borrowed(sentence) }
    }
}

thread_local! {
    static LAST: RefCell<Cow<'static, CStr>> = const { RefCell::new(Cow::Borrowed(c"")) };
}

/// The sentence of the last error in the calling thread; empty if there was none. It stays valid until the next error
/// in this thread. Never NULL.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_last_error() -> *const c_char {
    // A thread that ends may have no place for it any more.
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
}

/// The body of a function of the interface: its failure becomes a code and the thread's sentence, and so does a panic.
pub(crate) fn call(body: impl FnOnce() -> Result<isochrone_status, Failure>) -> isochrone_status {
    let outcome = catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|panic| {
        let what = message(&*panic);
        Err(Failure::new(
            ISOCHRONE_ERROR_INTERNAL,
            format!("isochrone itself failed: {what}; report it"),
        ))
    });
    outcome.unwrap_or_else(|Failure { status, sentence }| {
        let _ = LAST.try_with(|last| last.replace(sentence));
        status
    })
}

/// As [`call`], where there is nothing more to say than that it was done.
pub(crate) fn act(body: impl FnOnce() -> Result<(), Failure>) -> isochrone_status {
    call(|| body().map(|()| ISOCHRONE_OK))
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("it panicked")
}

/// A text for C, which ends at the first NUL.
pub(crate) fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last_error() -> String {
        LAST.with(|last| last.borrow().to_str().unwrap().to_owned())
    }

    #[test]
    fn a_panic_ends_in_a_code_and_its_words_at_the_boundary() {
        let status = call(|| panic!("no {}", 7));
        assert_eq!(status, ISOCHRONE_ERROR_INTERNAL);
        assert_eq!(last_error(), "isochrone itself failed: no 7; report it");
    }

    #[test]
    fn each_thread_has_the_sentence_of_its_own_last_error() {
        let refused = |what: &'static str| act(move || Err(Failure::argument(what)));
        assert_eq!(last_error(), "");
        assert_eq!(refused("first"), ISOCHRONE_ERROR_ARGUMENT);
        std::thread::spawn(move || {
            assert_eq!(last_error(), "");
            let _ = refused("of another thread\0");
            assert_eq!(last_error(), "of another thread\u{fffd}");
        })
        .join()
        .unwrap();
        assert_eq!(act(|| Ok(())), ISOCHRONE_OK);
        assert_eq!(last_error(), "first");
    }
}
