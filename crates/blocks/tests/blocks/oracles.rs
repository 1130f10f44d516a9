//! The blocks against oracles in Python that know only the documents, bit for bit.
//!
//! An oracle steps through random cases and leaves a digest of all outputs of each in `../oracles/BLOCK.txt`. Here
//! the blocks step through the same cases: what is changed here is changed in `../oracles/common.py`.

use crate::arbitrary::OBS;
use isochrone_blocks::{BlockType, CATALOGUE, Cycle, Ob, Pin, PinType, PinValue};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

const CASES: usize = 200;
const LONGEST_PERIOD_NS: i64 = 3_600_000_000_000;
const PERIODS_NS: [u64; 6] = [10_000, 333_333, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];
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
/// These have an oracle in `references`.
const HAVE_A_REFERENCE: [&str; 4] =
    ["LimRateOfChangeCI", "LimRateOfChangeAdvancedCI", "ScaleLinear", "SawTooth"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracles")
}

/// FNV-1a with 64 bits.
fn fnv(octets: &[u8], digest: u64) -> u64 {
    octets.iter().fold(digest, |digest, octet| {
        (digest ^ u64::from(*octet)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

const FNV_START: u64 = 0xCBF2_9CE4_8422_2325;

/// Numbers that look random (SplitMix64).
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// From the first to the last, both included.
    fn between(&mut self, first: i64, last: i64) -> i64 {
        first + (self.next() % (last.abs_diff(first) + 1)) as i64
    }

    fn is_one_in(&mut self, many: i64) -> bool {
        self.between(1, many) == 1
    }

    fn one_of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.between(0, values.len() as i64 - 1) as usize]
    }

    fn real(&mut self, usual: &[f64], is_wild: bool) -> f64 {
        match self.between(0, 15) {
            0 if is_wild => f64::from_bits(self.next()),
            0..=2 if is_wild => self.one_of(&TROUBLE),
            0..=8 if !usual.is_empty() => self.one_of(usual),
            0..=10 if !usual.is_empty() => self.one_of(usual) * self.between(0, 300) as f64 * 0.01,
            0..=12 => self.between(-40, 40) as f64 * 0.5,
            13..=14 if usual.is_empty() => self.between(-20_000_000, 20_000_000) as f64 * 1e-6,
            _ if usual.is_empty() => 0.0,
            _ => self.one_of(usual),
        }
    }

    fn whole(&mut self, usual: &[f64], is_wild: bool, (least, most): (f64, f64)) -> f64 {
        let (first, last) = (least as i64, most as i64);
        match self.between(0, 7) {
            0 if is_wild => self.between(first, last) as f64,
            1 if is_wild => self.one_of(&[least, most]),
            2 if is_wild => self.between(last - 3, last) as f64,
            0..=6 if !usual.is_empty() => self.one_of(usual),
            _ => (self.between(-50, 50) as f64).clamp(least, most),
        }
    }

    fn ob(&mut self, is_wild: bool) -> Ob {
        match self.between(0, 7) {
            0 if is_wild => Ob::Number(self.between(i16::MIN.into(), i16::MAX.into()) as i16),
            0..=2 if is_wild => Ob::Number(self.one_of(&[30, 35, 123, 36, 1, 0])),
            3 => Ob::Task { period_ns: self.one_of(&PERIODS_NS) },
            _ => Ob::Caller,
        }
    }

    fn value(&mut self, pin: &Pin, usual: &[f64], is_wild: bool) -> f64 {
        match (pin.pin_type, pin.pin_type.range()) {
            _ if pin.names_task => self.ob(is_wild).slot(),
            (PinType::Bool, _) if usual.is_empty() || self.is_one_in(8) => {
                self.between(0, 1) as f64
            }
            (PinType::Bool, _) => self.one_of(usual),
            (_, None) => self.real(usual, is_wild),
            (_, Some(range)) => self.whole(usual, is_wild, range),
        }
    }
}

/// What an oracle left: the pins as its document has them, what they usually hold, and a digest for each case.
struct Page {
    pins: String,
    usual: Vec<Vec<f64>>,
    digests: Vec<u64>,
}

impl Page {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let mut page = Self { pins: String::new(), usual: Vec::new(), digests: Vec::new() };
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["in", name, pin_type, ref usual @ ..] => {
                    page.usual.push(usual.iter().map(|word| word.parse().unwrap()).collect());
                    writeln!(page.pins, "in {name} {pin_type}").unwrap();
                }
                ["out", name, pin_type] => writeln!(page.pins, "out {name} {pin_type}").unwrap(),
                _ => page.digests.push(u64::from_str_radix(line, 16).unwrap()),
            }
        }
        page
    }
}

/// The pins of a block as a page of an oracle lists them.
fn pins(block_type: &BlockType) -> String {
    let mut pins = String::new();
    for pin in block_type.inputs {
        let pin_type = if pin.names_task { "OB" } else { pin.pin_type.as_str() };
        writeln!(pins, "in {} {pin_type}", pin.name).unwrap();
    }
    for pin in block_type.outputs {
        writeln!(pins, "out {} {}", pin.name, pin.pin_type).unwrap();
    }
    pins
}

/// Steps a new instance through a case. Calls `seen` with each cycle and the slots after it, and returns the digest.
fn run(
    block_type: &BlockType,
    usual: &[Vec<f64>],
    number: usize,
    mut seen: impl FnMut(&Cycle<'_>, &[f64]),
) -> u64 {
    let mut draws = Draws(fnv(block_type.name.as_bytes(), FNV_START).wrapping_add(number as u64));
    let is_wild = draws.is_one_in(2);
    let mut period_ns = draws.one_of(&PERIODS_NS);
    if is_wild && draws.is_one_in(4) {
        period_ns = draws.between(10_000, LONGEST_PERIOD_NS) as u64;
    }
    let mut index = if draws.is_one_in(3) { draws.between(0, 1 << 40) as u64 } else { 0 };
    let cycles = draws.between(20, 200);
    let calm = draws.one_of(&[2, 4, 10, 30]);

    let pins: Vec<_> = block_type.inputs.iter().zip(usual).collect();
    let mut slots = vec![0.0; block_type.slots()];
    for ((pin, usual), slot) in pins.iter().zip(&mut slots) {
        *slot = draws.value(pin, usual, is_wild);
    }
    let mut words = vec![0; block_type.state_words];
    let mut digest = FNV_START;
    for _ in 0..cycles {
        let cycle = Cycle::new(index, period_ns, OBS);
        block_type.step_bank(&mut slots, &mut words, &cycle);
        for output in &slots[pins.len()..] {
            digest = fnv(&output.to_le_bytes(), digest);
        }
        seen(&cycle, &slots);
        index += 1;
        if draws.is_one_in(16) {
            index += if is_wild { 1 << draws.between(0, 30) } else { draws.between(1, 20) } as u64;
        }
        for ((pin, usual), slot) in pins.iter().zip(&mut slots) {
            if draws.is_one_in(calm) {
                *slot = draws.value(pin, usual, is_wild);
            }
        }
    }
    digest
}

/// A value as `make.py --case` prints it.
fn text(pin: &Pin, slot: f64) -> String {
    match Ob::from_slot(slot) {
        Ob::Caller if pin.names_task => "caller".into(),
        Ob::Task { period_ns } if pin.names_task => format!("{period_ns}ns"),
        _ if pin.pin_type == PinType::Lreal => format!("{slot:e}"),
        _ => slot.to_string(),
    }
}

/// A case as `make.py --case` prints it.
fn trace(block_type: &BlockType, usual: &[Vec<f64>], number: usize) -> String {
    let mut trace = String::new();
    run(block_type, usual, number, |cycle, slots| {
        write!(trace, "{} x {} ns:", cycle.index(), cycle.period_ns()).unwrap();
        for (place, (pin, slot)) in
            block_type.inputs.iter().chain(block_type.outputs).zip(slots).enumerate()
        {
            let arrow = if place == block_type.inputs.len() { " ->" } else { "" };
            write!(trace, "{arrow} {}={}", pin.name, text(pin, *slot)).unwrap();
        }
        trace.push('\n');
    });
    trace
}

#[test]
fn every_block_computes_in_random_cases_what_an_oracle_in_python_computes() {
    for block_type in CATALOGUE {
        let name = block_type.name;
        let path = folder().join(format!("{name}.txt"));
        if HAVE_A_REFERENCE.contains(&name) && !path.exists() {
            continue;
        }
        assert!(
            path.exists(),
            "{name} has no digests of an oracle: write one in {0}, as `Hysteresis` in lgf.py, and run {0}/make.py {name}",
            folder().display()
        );
        let page = Page::read(&path);
        assert_eq!(pins(block_type), page.pins, "the pins of {name}: the block's, the oracle's");
        assert_eq!(page.digests.len(), CASES, "{name}");
        let differing: Vec<usize> = (0..CASES)
            .filter(|case| run(block_type, &page.usual, *case, |_, _| {}) != page.digests[*case])
            .collect();
        if let Some(first) = differing.first() {
            panic!(
                "{name}: {} of {CASES} cases differ, such as {differing:?}. Compare the trace of the first with what \
                 `crates/blocks/tests/oracles/make.py --case {first} {name}` prints:\n{}",
                differing.len(),
                trace(block_type, &page.usual, *first)
            );
        }
    }
}

#[test]
fn every_page_of_an_oracle_is_about_a_block_of_the_catalogue() {
    for entry in fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        // Those of expressions are about no block.
        let is_page = path.extension().is_some_and(|extension| extension == "txt");
        if is_page && !name.starts_with("expr") {
            assert!(CATALOGUE.iter().any(|block| block.name == name), "no block {name}");
        }
    }
}
