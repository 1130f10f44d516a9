//! What C passes: texts, arrays and places for results.
#![allow(unsafe_code)] // pointers of C

use std::ffi::{CStr, c_char};
use std::slice;

use crate::status::Failure;

/// A text that may not be NULL.
///
/// # Safety
/// `pointer` is NULL or points to a text that ends with NUL and stays as it is for `'a`.
pub(crate) unsafe fn text<'a>(pointer: *const c_char, what: &str) -> Result<&'a str, Failure> {
    // SAFETY: as the caller promises.
    let text = unsafe { optional_text(pointer, what) }?;
    text.ok_or_else(|| null(what))
}

/// A text; `None` for NULL.
///
/// # Safety
/// As for [`text`].
pub(crate) unsafe fn optional_text<'a>(
    pointer: *const c_char,
    what: &str,
) -> Result<Option<&'a str>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: it is not NULL, and the caller promises the rest.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map(Some).map_err(|_| Failure::argument(format!("{what} is not UTF-8")))
}

/// An array; NULL is one without elements.
///
/// # Safety
/// `pointer` is NULL or points to `count` elements that stay as they are for `'a`.
pub(crate) unsafe fn array<'a, T>(
    pointer: *const T,
    count: usize,
    what: &str,
) -> Result<&'a [T], Failure> {
    match (pointer.is_null(), count) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(null(what)),
        // SAFETY: it is not NULL, and the caller promises the rest.
        (false, count) => Ok(unsafe { slice::from_raw_parts(pointer, count) }),
    }
}

/// A structure; `None` for NULL.
///
/// # Safety
/// `pointer` is NULL or points to a `T`.
pub(crate) unsafe fn optional<T: Copy>(pointer: *const T) -> Option<T> {
    // SAFETY: as the caller promises.
    unsafe { pointer.as_ref() }.copied()
}

/// A place for a result.
pub(crate) struct Place<T>(*mut T);

impl<T> Place<T> {
    /// # Safety
    /// `pointer` is NULL or may be written to as long as the place is used.
    pub(crate) unsafe fn new(pointer: *mut T, what: &str) -> Result<Self, Failure> {
        if pointer.is_null() { Err(null(what)) } else { Ok(Self(pointer)) }
    }

    pub(crate) fn set(&self, value: T) {
        // SAFETY: it is not NULL, and who made it promised the rest. Results are plain data: what was there needs no
        // drop.
        unsafe { self.0.write(value) };
    }
}

fn null(what: &str) -> Failure {
    Failure::argument(format!("{what} is NULL"))
}
