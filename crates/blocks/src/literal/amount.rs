//! A number and a unit of time, in nanoseconds.

/// Units of durations, from short to long.
pub const UNITS: [(&str, u64); 7] = [
    ("ns", 1),
    ("us", 1_000),
    ("µs", 1_000),
    ("ms", 1_000_000),
    ("s", 1_000_000_000),
    ("min", 60_000_000_000),
    ("h", 3_600_000_000_000),
];

/// Why this number of a unit is not a time in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AmountError {
    /// It is not digits, or digits on both sides of a point.
    NoNumber,
    /// There are fractions of a nanosecond.
    NotWhole,
    /// It does not fit.
    TooLong,
}

/// This many of a unit, in decimal digits, in nanoseconds.
pub fn amount_ns(number: &str, unit_ns: u64) -> Result<u64, AmountError> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || number.ends_with('.') || !digits(whole) || !digits(fraction) {
        return Err(AmountError::NoNumber);
    }
    // Decimal digits, not floating point: "0.1us" is exactly 100 ns.
    let whole: u64 = whole.parse().map_err(|_| AmountError::TooLong)?;
    let mut total_ns = whole.checked_mul(unit_ns).ok_or(AmountError::TooLong)?;
    let mut place_ns = unit_ns;
    for digit in fraction.trim_end_matches('0').bytes() {
        if !place_ns.is_multiple_of(10) {
            return Err(AmountError::NotWhole);
        }
        place_ns /= 10;
        let part_ns = u64::from(digit - b'0') * place_ns;
        total_ns = total_ns.checked_add(part_ns).ok_or(AmountError::TooLong)?;
    }
    Ok(total_ns)
}
