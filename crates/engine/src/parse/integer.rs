//! Integers of TOML.

use toml::de::DeInteger;

/// The number of an integer in any notation, if it fits.
pub(super) fn parse_integer(integer: &DeInteger<'_>) -> Option<i64> {
    i64::from_str_radix(integer.as_str(), integer.radix()).ok()
}
