//! What values are worth.
#![allow(unsafe_code)] // the C interface

use std::ffi::{CStr, c_char};

use isochrone_model::Flags;

/// A source is older than its limit.
pub const ISOCHRONE_STALE: u64 = 1;
/// A source reads a default instead of a sample.
pub const ISOCHRONE_SUBSTITUTE: u64 = 2;
/// The newest sample of a source could not be taken; the one before stays.
pub const ISOCHRONE_REJECTED: u64 = 4;
/// A force acts on a signal, or upstream of it.
pub const ISOCHRONE_FORCED: u64 = 8;
/// The frame that a source came from was in doubt.
pub const ISOCHRONE_UPSTREAM: u64 = 16;
/// A block upstream of a signal reports an error.
pub const ISOCHRONE_ERROR: u64 = 32;
/// The sender's last frame: it ends.
pub const ISOCHRONE_STOPPED: u64 = 64;
/// An input began with its value of an earlier run, and no sample has come for it yet.
pub const ISOCHRONE_RESTORED: u64 = 128;
/// Any of those with which values are in doubt: STALE, SUBSTITUTE, REJECTED, UPSTREAM, ERROR and RESTORED.
pub const ISOCHRONE_IN_DOUBT: u64 = 183;

/// The flags for the stamp of what is computed from a frame with these flags: UPSTREAM if that was in doubt, and FORCED
/// if it was.
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_flags_handed_on(flags: u64) -> u64 {
    Flags::from_bits(flags).handed_on().bits()
}

/// The version of this library, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn isochrone_version() -> *const c_char {
    const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "\0");
    CStr::from_bytes_with_nul(VERSION.as_bytes()).unwrap_or_default().as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flags_are_those_of_the_contract() {
        let ours = [
            ISOCHRONE_STALE,
            ISOCHRONE_SUBSTITUTE,
            ISOCHRONE_REJECTED,
            ISOCHRONE_FORCED,
            ISOCHRONE_UPSTREAM,
            ISOCHRONE_ERROR,
            ISOCHRONE_STOPPED,
            ISOCHRONE_RESTORED,
        ];
        assert_eq!(ours, Flags::ALL.map(|(flag, _)| flag.bits()));
        for bit in (0..64).map(|bit| 1 << bit) {
            let is_in_doubt = Flags::from_bits(bit).is_in_doubt();
            assert_eq!(ISOCHRONE_IN_DOUBT & bit != 0, is_in_doubt, "{bit}");
        }
    }
}
