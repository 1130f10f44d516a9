//! Sequences of inputs that a plant may send on its worst day, the same in every run.

use alloc::vec;
use alloc::vec::Vec;

use crate::{Block, Cycle, Ob, Pin, PinType, Slots};

/// OBs of a node: numbers and periods.
const OBS: &[(i16, u64)] = &[(30, 1_000_000), (35, 10_000_000), (123, 333_333)];
/// An hour, the longest period of a task.
const LONGEST_PERIOD_NS: u64 = 3_600_000_000_000;

/// Numbers that look random (SplitMix64).
pub(super) struct Draws(u64);

impl Draws {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// From the first to the last, both included.
    pub(super) fn between(&mut self, first: i64, last: i64) -> i64 {
        let span = last.abs_diff(first).saturating_add(1);
        first.saturating_add_unsigned(self.next() % span)
    }

    fn is_one_in(&mut self, many: i64) -> bool {
        self.between(1, many) == 1
    }

    fn one_of(&mut self, values: &[f64]) -> f64 {
        let last = values.len().saturating_sub(1) as i64;
        values.get(self.between(0, last) as usize).copied().unwrap_or_default()
    }

    /// Any bits, those that make trouble, those that meet each other more often than not, and those near what a
    /// block works with.
    fn real(&mut self, typical: f64) -> f64 {
        const TROUBLE: [f64; 14] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            0.0,
            -0.0,
            5e-324,
            -5e-324,
            f64::MIN_POSITIVE,
            1e-310,
            f64::MAX,
            f64::MIN,
            1e308,
            -1e308,
            0.1,
        ];
        let value = match self.between(0, 15) {
            0 => f64::from_bits(self.next()),
            1..=3 => self.one_of(&TROUBLE),
            4..=8 => self.between(-40, 40) as f64 * 0.5,
            9..=11 => self.between(-20_000_000, 20_000_000) as f64 * 1e-6,
            12 => typical * self.between(-100, 300) as f64 * 0.01,
            _ => typical,
        };
        // What is above zero at work, such as a rate or a time, is seldom below it.
        if typical > 0.0 && !self.is_one_in(8) { value.abs() } else { value }
    }

    fn whole(&mut self, typical: f64, (least, most): (f64, f64)) -> f64 {
        match self.between(0, 3) {
            0 => self.between(least as i64, most as i64) as f64,
            1 | 2 => (self.between(-50, 50) as f64).clamp(least, most),
            _ => typical,
        }
    }

    fn ob(&mut self) -> f64 {
        match self.between(0, 7) {
            0 => self.between(i16::MIN.into(), i16::MAX.into()) as f64,
            1 | 2 => self.one_of(&[30.0, 35.0, 123.0, 36.0, 1.0, 0.0]),
            3 => Ob::Task { period_ns: self.period_ns() }.slot(),
            _ => Ob::Caller.slot(),
        }
    }

    fn period_ns(&mut self) -> u64 {
        let longest = LONGEST_PERIOD_NS as i64;
        let any = self.between(10_000, longest) as u64;
        let usual = [10_000, 1_000_000, 10_000_000, 100_000_000, LONGEST_PERIOD_NS];
        let place = self.between(0, usual.len() as i64) as usize;
        usual.get(place).copied().unwrap_or(any)
    }

    fn value(&mut self, pin: &Pin, typical: f64) -> f64 {
        match pin.pin_type.range() {
            _ if pin.names_task => self.ob(),
            None => self.real(typical),
            Some(_) if pin.pin_type == PinType::Bool => {
                f64::from(u8::from((typical != 0.0) != self.is_one_in(6)))
            }
            Some(range) => self.whole(typical, range),
        }
    }
}

/// [`Block::typical`], slot by slot.
pub(super) fn typical<B: Block>() -> Vec<f64> {
    let mut slots = vec![0.0; B::Inputs::LEN];
    B::typical().write(&mut slots);
    slots
}

/// A sequence of cycles and their inputs.
pub(super) struct Sequence {
    pub(super) draws: Draws,
    pub(super) cycles: u64,
    period_ns: u64,
    index: u64,
    typical: Vec<f64>,
}

impl Sequence {
    pub(super) fn new<B: Block>(case: u64) -> Self {
        let mut draws = Draws(case);
        let first = if draws.is_one_in(3) { draws.between(0, 1 << 40) as u64 } else { 0 };
        Self {
            cycles: draws.between(1, 80) as u64,
            period_ns: draws.period_ns(),
            index: first,
            typical: typical::<B>(),
            draws,
        }
    }

    /// The next cycle; now and then, an overrun skipped some before it.
    pub(super) fn next_cycle(&mut self) -> Cycle<'static> {
        let cycle = self.cycle_after(0);
        let skipped = if self.draws.is_one_in(16) { self.draws.between(1, 1000) } else { 0 };
        self.index += 1 + skipped.unsigned_abs();
        cycle
    }

    /// A cycle so many after the next one.
    pub(super) fn cycle_after(&self, cycles: u64) -> Cycle<'static> {
        Cycle::new(self.index + cycles, self.period_ns, OBS)
    }

    /// The inputs of an instance in the next cycle: mostly those that it has, or one of them is another.
    pub(super) fn draw<B: Block>(&mut self, inputs: &mut [f64]) {
        let one_in = match self.draws.between(0, 7) {
            0 => 1,
            1 | 2 => 3,
            _ => return,
        };
        for ((pin, typical), input) in B::INPUTS.iter().zip(&self.typical).zip(inputs) {
            if self.draws.is_one_in(one_in) {
                *input = self.draws.value(pin, *typical);
            }
        }
    }
}
