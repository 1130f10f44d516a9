//! The steps of a program, and what each makes of its operands.
//!
//! A register holds a finite value of its step's type, or an error: a NaN that carries the status word. Every step
//! looks at what it made before it keeps it, so a NaN can be nothing else.

use crate::PinType;
use crate::status::{CONVERSION, DIVISION_BY_ZERO, NOT_FINITE, OK, OUT_OF_DOMAIN, SELECTION};

/// A step; its operands are the registers of steps before it, and its result goes into the register with its own
/// number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    Constant(f64),
    /// A signal, by its slot.
    Input(PinType, u16),
    /// The value of another register.
    Copy(u16),
    Real(Real, u16),
    NegateInt(u16),
    NegateTime(u16),
    AbsInt(u16),
    NotBool(u16),
    NotWord(u16),
    /// To INT or TIME, to the nearest, of two to the even one.
    RoundTo(PinType, u16),
    /// To INT.
    Truncate(u16),
    WordToInt(u16),
    IntToWord(u16),
    Add(u16, u16),
    Subtract(u16, u16),
    Multiply(u16, u16),
    Divide(u16, u16),
    Power(u16, u16),
    Atan2(u16, u16),
    AddInt(u16, u16),
    SubtractInt(u16, u16),
    MultiplyInt(u16, u16),
    DivideInt(u16, u16),
    ModuloInt(u16, u16),
    AddTime(u16, u16),
    SubtractTime(u16, u16),
    /// A TIME by an INT or an LREAL.
    MultiplyTime(u16, u16),
    DivideTimeByInt(u16, u16),
    DivideTimeByReal(u16, u16),
    And(u16, u16),
    Or(u16, u16),
    Xor(u16, u16),
    Equal(u16, u16),
    NotEqual(u16, u16),
    Less(u16, u16),
    AtMost(u16, u16),
    Greater(u16, u16),
    AtLeast(u16, u16),
    Max(u16, u16),
    Min(u16, u16),
    /// The condition, and what it is when it is FALSE and TRUE.
    Select(u16, u16, u16),
    /// One of this many registers right before this step, by the number in another.
    Choose(u16, u16),
}

/// A function from LREAL to LREAL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Real {
    Negate,
    Abs,
    Sqrt,
    Ln,
    Log,
    Exp,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
}

/// The error of a status word, for a register.
#[inline]
const fn error(status: u16) -> f64 {
    f64::from_bits(f64::NAN.to_bits() & !0xFFFF | status as u64)
}

/// The status word of an error.
#[inline]
pub(super) fn status(error: f64) -> u16 {
    match error.to_bits() as u16 {
        OK => NOT_FINITE,
        status => status,
    }
}

/// The result of a step on LREAL, or the error that it stands for.
#[inline]
fn finite(value: f64, operands: [f64; 2]) -> f64 {
    if value.is_finite() { value } else { first_error(operands).unwrap_or(error(NOT_FINITE)) }
}

/// The first of the operands that is an error.
#[inline]
fn first_error(operands: [f64; 2]) -> Option<f64> {
    operands.into_iter().find(|operand| operand.is_nan())
}

/// What two operands make that are no errors.
#[inline]
fn of_two(a: f64, b: f64, make: impl FnOnce(f64, f64) -> f64) -> f64 {
    if a.is_nan() {
        a
    } else if b.is_nan() {
        b
    } else {
        make(a, b)
    }
}

#[inline]
fn of_one(a: f64, make: impl FnOnce(f64) -> f64) -> f64 {
    if a.is_nan() { a } else { make(a) }
}

#[inline]
fn ints(a: f64, b: f64, make: impl FnOnce(i16, i16) -> i16) -> f64 {
    of_two(a, b, |a, b| f64::from(make(a as i16, b as i16)))
}

#[inline]
fn words(a: f64, b: f64, make: impl FnOnce(u16, u16) -> u16) -> f64 {
    of_two(a, b, |a, b| f64::from(make(a as u16, b as u16)))
}

#[inline]
fn truth(a: f64, b: f64, make: impl FnOnce(f64, f64) -> bool) -> f64 {
    of_two(a, b, |a, b| f64::from(u8::from(make(a, b))))
}

/// A whole number, if the type holds it.
#[inline]
fn fit(of: PinType, value: f64) -> f64 {
    // The sum makes a negative zero a positive one.
    if of.holds(value) { value + 0.0 } else { error(CONVERSION) }
}

/// A signal as it stands in its slot.
#[inline]
fn input(of: PinType, value: f64) -> f64 {
    match of {
        PinType::Lreal if value.is_finite() => value,
        PinType::Bool if !value.is_nan() => f64::from(u8::from(value != 0.0)),
        _ if !value.is_finite() => error(NOT_FINITE),
        _ => fit(of, value),
    }
}

fn real(function: Real, x: f64) -> f64 {
    let outside = match function {
        Real::Sqrt => x < 0.0,
        Real::Ln | Real::Log => x <= 0.0,
        Real::Asin | Real::Acos => x.abs() > 1.0,
        _ => false,
    };
    if outside {
        return error(OUT_OF_DOMAIN);
    }
    let y = match function {
        Real::Negate => -x,
        Real::Abs => x.abs(),
        Real::Sqrt => libm::sqrt(x),
        Real::Ln => libm::log(x),
        Real::Log => libm::log10(x),
        Real::Exp => libm::exp(x),
        Real::Sin => libm::sin(x),
        Real::Cos => libm::cos(x),
        Real::Tan => libm::tan(x),
        Real::Asin => libm::asin(x),
        Real::Acos => libm::acos(x),
        Real::Atan => libm::atan(x),
    };
    finite(y, [x, x])
}

fn power(base: f64, exponent: f64) -> f64 {
    if base == 0.0 && exponent < 0.0 {
        return error(DIVISION_BY_ZERO);
    }
    let power = libm::pow(base, exponent);
    if power.is_nan() { error(OUT_OF_DOMAIN) } else { finite(power, [0.0; 2]) }
}

/// A quotient; `divide` is not called with 0.
#[inline]
fn quotient(a: f64, b: f64, divide: impl FnOnce(f64, f64) -> f64) -> f64 {
    of_two(a, b, |a, b| if b == 0.0 { error(DIVISION_BY_ZERO) } else { divide(a, b) })
}

impl Step {
    /// Its result, from the slots of the signals and the registers of the steps before.
    #[inline]
    pub(super) fn result(&self, inputs: &[f64], registers: &[f64]) -> f64 {
        // What is missing is an error, so that no index can panic.
        let at = |index: u16| registers.get(usize::from(index)).copied().unwrap_or(f64::NAN);
        match *self {
            Self::Constant(value) => value,
            Self::Input(of, slot) => {
                input(of, inputs.get(usize::from(slot)).copied().unwrap_or(f64::NAN))
            }
            Self::Copy(a) => at(a),
            Self::Real(function, a) => of_one(at(a), |x| real(function, x)),
            Self::NegateInt(a) => of_one(at(a), |a| f64::from((a as i16).wrapping_neg())),
            Self::NegateTime(a) => of_one(at(a), |a| fit(PinType::Time, -a)),
            Self::AbsInt(a) => of_one(at(a), |a| f64::from((a as i16).wrapping_abs())),
            Self::NotBool(a) => of_one(at(a), |a| 1.0 - a),
            Self::NotWord(a) => of_one(at(a), |a| f64::from(!(a as u16))),
            Self::RoundTo(of, a) => of_one(at(a), |a| fit(of, libm::rint(a))),
            Self::Truncate(a) => of_one(at(a), |a| fit(PinType::Int, libm::trunc(a))),
            Self::WordToInt(a) => of_one(at(a), |a| f64::from(a as u16 as i16)),
            Self::IntToWord(a) => of_one(at(a), |a| f64::from(a as i16 as u16)),
            Self::Add(a, b) => finite(at(a) + at(b), [at(a), at(b)]),
            Self::Subtract(a, b) => finite(at(a) - at(b), [at(a), at(b)]),
            Self::Multiply(a, b) => finite(at(a) * at(b), [at(a), at(b)]),
            Self::Divide(a, b) => quotient(at(a), at(b), |a, b| finite(a / b, [a, b])),
            Self::Power(a, b) => of_two(at(a), at(b), power),
            Self::Atan2(a, b) => of_two(at(a), at(b), libm::atan2),
            Self::AddInt(a, b) => ints(at(a), at(b), i16::wrapping_add),
            Self::SubtractInt(a, b) => ints(at(a), at(b), i16::wrapping_sub),
            Self::MultiplyInt(a, b) => ints(at(a), at(b), i16::wrapping_mul),
            Self::DivideInt(a, b) => {
                quotient(at(a), at(b), |a, b| f64::from((a as i16).wrapping_div(b as i16)))
            }
            // The standard: a MOD 0 is 0.
            Self::ModuloInt(a, b) => {
                ints(at(a), at(b), |a, b| if b == 0 { 0 } else { a.wrapping_rem(b) })
            }
            Self::AddTime(a, b) => of_two(at(a), at(b), |a, b| fit(PinType::Time, a + b)),
            Self::SubtractTime(a, b) => of_two(at(a), at(b), |a, b| fit(PinType::Time, a - b)),
            Self::MultiplyTime(a, b) => {
                of_two(at(a), at(b), |a, b| fit(PinType::Time, libm::rint(a * b)))
            }
            Self::DivideTimeByInt(a, b) => {
                quotient(at(a), at(b), |a, b| fit(PinType::Time, libm::trunc(a / b)))
            }
            Self::DivideTimeByReal(a, b) => {
                quotient(at(a), at(b), |a, b| fit(PinType::Time, libm::rint(a / b)))
            }
            Self::And(a, b) => words(at(a), at(b), |a, b| a & b),
            Self::Or(a, b) => words(at(a), at(b), |a, b| a | b),
            Self::Xor(a, b) => words(at(a), at(b), |a, b| a ^ b),
            Self::Equal(a, b) => truth(at(a), at(b), |a, b| a == b),
            Self::NotEqual(a, b) => truth(at(a), at(b), |a, b| a != b),
            Self::Less(a, b) => truth(at(a), at(b), |a, b| a < b),
            Self::AtMost(a, b) => truth(at(a), at(b), |a, b| a <= b),
            Self::Greater(a, b) => truth(at(a), at(b), |a, b| a > b),
            Self::AtLeast(a, b) => truth(at(a), at(b), |a, b| a >= b),
            Self::Max(a, b) => of_two(at(a), at(b), |a, b| if b > a { b } else { a }),
            Self::Min(a, b) => of_two(at(a), at(b), |a, b| if b < a { b } else { a }),
            Self::Select(g, a, b) => of_one(at(g), |g| at(if g == 0.0 { a } else { b })),
            Self::Choose(k, count) => of_one(at(k), |k| {
                let first = registers.len().checked_sub(usize::from(count));
                let row = first.and_then(|first| registers.get(first..)).unwrap_or_default();
                let index = if k < 0.0 { usize::MAX } else { k as usize };
                row.get(index).copied().unwrap_or(error(SELECTION))
            }),
        }
    }
}
