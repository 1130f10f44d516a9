//! Status words. `16#0000` to `16#7FFF` inform, `16#8000` and above are errors.

/// No error.
pub const OK: u16 = 0x0000;
/// The output was limited to `yMin`.
pub const LIMITED_LOW: u16 = 0x6001;
/// The output was limited to `yMax`.
pub const LIMITED_HIGH: u16 = 0x6002;
/// A setting was rounded to what the block can do.
pub const ROUNDED: u16 = 0x6003;
/// The output was limited by a rate of change.
pub const LIMITED_RATE: u16 = 0x6004;
/// A negative rate of change, or a high limit below the low limit: see the block.
pub const RANGE: u16 = 0x8200;
/// A negative rate of change in a block that uses `8200` for its limits.
pub const NEGATIVE_RATE: u16 = 0x8202;
/// A time is negative, or another parameter is outside its range: see the block.
pub const TIME: u16 = 0x8203;
/// An expression divides by zero.
pub const DIVISION_BY_ZERO: u16 = 0x8210;
/// A function of an expression has no value for its input: the square root of a negative number.
pub const OUT_OF_DOMAIN: u16 = 0x8211;
/// A value of an expression does not fit the type that it becomes.
pub const CONVERSION: u16 = 0x8212;
/// The selector of a MUX in an expression is the number of none of its inputs.
pub const SELECTION: u16 = 0x8213;
/// `callOB` is not the number of a cyclic-interrupt OB; `subfunctionStatus` gives details.
pub const QRY_CINT: u16 = 0x8600;
/// `callOB` names a cyclic-interrupt OB that no task has.
pub const OB_UNAVAILABLE: u16 = 0x8601;
/// A value that is needed is NaN or infinite.
pub const NOT_FINITE: u16 = 0x8F00;
/// A measured value is NaN or infinite: its sensor failed.
pub const SENSOR: u16 = 0x8F01;
/// `subfunctionStatus` beside [`QRY_CINT`]: wrong OB number.
pub const WRONG_OB_NUMBER: u16 = 0x8090;

/// Meaning of [`QRY_CINT`] in the catalogue.
pub(crate) const QRY_CINT_DOC: &str = "callOB is not a cyclic-interrupt OB number \
    (30 to 38, 123 to 32767); subfunctionStatus is 16#8090";
/// Meaning of [`OB_UNAVAILABLE`] in the catalogue.
pub(crate) const OB_UNAVAILABLE_DOC: &str = "no task has the OB number at callOB";

/// First status word that is an error.
pub const FIRST_ERROR: u16 = 0x8000;

/// Whether a status word is an error.
#[inline]
pub const fn is_error(status: u16) -> bool {
    status >= FIRST_ERROR
}

/// The first finding, in the order of severity in which they are passed.
#[inline]
pub(crate) fn first(ob: Result<f64, u16>, findings: [(bool, u16); 3]) -> u16 {
    let [a, b, c] = findings;
    match ob {
        Err(status) => status,
        Ok(_) if a.0 => a.1,
        Ok(_) if b.0 => b.1,
        Ok(_) if c.0 => c.1,
        Ok(_) => OK,
    }
}

/// What is wrong with limits that may be infinite on their own side: [`RANGE`], [`NOT_FINITE`] or [`OK`].
#[inline]
pub(crate) fn of_limits(min: f64, max: f64) -> u16 {
    if min > max {
        RANGE
    } else if min.is_nan() || max.is_nan() || min == f64::INFINITY || max == f64::NEG_INFINITY {
        NOT_FINITE
    } else {
        OK
    }
}

/// The value of `subfunctionStatus` for a `status`.
#[inline]
pub(crate) const fn subfunction(status: u16) -> u16 {
    if status == QRY_CINT { WRONG_OB_NUMBER } else { OK }
}

/// Whether an output of this name holds the status word.
pub(crate) const fn is_status(name: &str) -> bool {
    matches!(name.as_bytes(), b"status")
}
