//! EXP, LN, SIN, ... against exact values, `tests/oracles/expressions/functions.py`.

use isochrone_blocks::PinType::Lreal;

use super::value;

const CASES: &str = include_str!("../../oracles/expressions/functions.txt");

/// The bits of all results of a function, FNV-1a of 64 bits: the same on every machine, and with every version.
const FROZEN: [(&str, u64); 12] = [
    ("EXP", 0x281C_DCB3_89F8_00C3),
    ("LN", 0xF185_D7F3_941A_544D),
    ("LOG", 0xA3CC_2723_FD8C_28AB),
    ("SIN", 0xE531_8376_C7FF_96B0),
    ("COS", 0x382B_4CAA_0CE1_0185),
    ("TAN", 0xF0B7_0113_4198_F319),
    ("ASIN", 0x57A3_F7F3_409A_752B),
    ("ACOS", 0x7031_1CFA_D698_A909),
    ("ATAN", 0xC047_9042_1FB5_02CF),
    ("ATAN2", 0x1498_CB3F_233E_75DB),
    ("EXPT", 0x5C10_DFA6_352E_C72F),
    ("SQRT", 0xCBF0_9CBF_0BC2_6638),
];

/// The function of each case, its result, the greatest double that is not above the exact value, and whether it is it.
fn results() -> impl Iterator<Item = (&'static str, f64, f64, bool)> {
    CASES.lines().map(|line| {
        let mut parts = line.split(' ');
        let function = parts.next().unwrap();
        let words: Vec<_> = parts.collect();
        let (below, arguments) = words.split_last().unwrap();
        let bits = |word: &&str| f64::from_bits(u64::from_str_radix(word, 16).unwrap());
        let text = format!("{function}({})", ["a", "b"][..arguments.len()].join(", "));
        let signals: Vec<_> = ["a", "b"]
            .into_iter()
            .zip(arguments)
            .map(|(name, it)| (name, Lreal, bits(it)))
            .collect();
        let (of, result) = value(&text, &signals);
        assert_eq!(of, Lreal);
        let result = result.unwrap_or_else(|status| panic!("{line}: {status:X}"));
        (function, result, bits(&below.trim_start_matches('=')), below.starts_with('='))
    })
}

#[test]
fn functions_are_within_one_unit_in_the_last_place() {
    let mut count = 0;
    for (function, result, below, is_exact) in results() {
        let is_near = result == below || !is_exact && result == below.next_up();
        assert!(is_near, "{function}: {result:?} and not {below:?}");
        count += 1;
    }
    assert!(count > 400);
}

#[test]
fn functions_have_the_same_bits_everywhere() {
    let found = FROZEN.map(|(function, _)| {
        let of_it = results().filter(|it| it.0 == function);
        let bytes = of_it.flat_map(|it| it.1.to_bits().to_le_bytes());
        let digest = bytes.fold(0xCBF2_9CE4_8422_2325, |digest: u64, byte| {
            (digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        });
        (function, digest)
    });
    assert_eq!(found, FROZEN);
}
