//! Texts that nobody writes, and values that nobody sends.

use isochrone_blocks::PinType;
use isochrone_blocks::expr::{Expression, parse};

/// What texts are made of: all that the language has, and some that it has not.
const PARTS: [&str; 76] = [
    "x",
    "i",
    "on",
    "t",
    "w",
    "\"p-1@prev\"",
    "a.b",
    "0",
    "1",
    "-1",
    "2.5",
    "1e300",
    "32767",
    "16#8200",
    "2#101",
    "40000",
    "T#2s",
    "T#-24d",
    "TRUE",
    "false",
    "INT#7",
    "WORD#16#FF",
    "LREAL#1",
    "BOOL#1",
    "(",
    ")",
    ",",
    "+",
    "-",
    "*",
    "/",
    " MOD ",
    "**",
    "<",
    ">",
    "<=",
    ">=",
    "=",
    "<>",
    " AND ",
    "&",
    " OR ",
    " XOR ",
    " NOT ",
    "ABS(",
    "SQRT(",
    "LN(",
    "EXP(",
    "SIN(",
    "ATAN2(",
    "EXPT(",
    "MAX(",
    "MIN(",
    "LIMIT(",
    "SEL(",
    "MUX(",
    "TRUNC(",
    "LREAL_TO_INT(",
    "LREAL_TO_TIME(",
    "INT_TO_WORD(",
    "TIME_TO_INT(",
    "BOOL_TO_INT(",
    "IN := ",
    "IN0:=",
    "K := ",
    ":=",
    "==",
    "&&",
    "#",
    "\"",
    "'",
    "ö",
    "€",
    "\u{0}",
    " ",
    "..",
];

const SEEDS: [&str; 12] = [
    "LIMIT(MN := 0.0, IN := sp - pv, MX := 10.0)",
    "level.y > 1.6 AND NOT stop",
    "SEL(span = 0, (x - low) / span, 0.0)",
    "MUX(K := i, IN0 := a, IN1 := \"pump-1.y@prev\", IN2 := 3.5)",
    "-2 ** 2 + SQRT(ABS(x)) * EXP(-t1 / 16#10)",
    "t * 2 + T#1m30s >= TIME#500ms OR on XOR (w AND 16#00FF) = WORD#3",
    "LREAL_TO_INT(x * 100.0) MOD 7 / i",
    "MAX(a, b, c, 1_000) - MIN(a, -b)",
    "NOT on = (off & TRUE)",
    "ATAN2(Y := y, X := x) ** 0.5 + LN(x) - LOG(x)",
    "INT_TO_WORD(i) XOR NOT w",
    "(((a + b) * (c - d)) / ((e + 1) * (f - 1.5e-3)))",
];

struct Random(u64);

impl Random {
    /// splitmix64
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }
}

/// A text like a good one: parts put in, taken out and doubled.
fn mutated(random: &mut Random) -> String {
    let mut text: Vec<char> = random.one_of(&SEEDS).chars().collect();
    for _ in 0..=random.below(3) {
        let at = random.below(text.len() + 1);
        let end = (at + random.below(8)).min(text.len());
        match random.below(4) {
            0 => drop(text.drain(at..end)),
            1 => {
                let copy = text[at..end].to_vec();
                let to = random.below(text.len() + 1);
                text.splice(to..to, copy);
            }
            _ => drop(text.splice(at..at, random.one_of(&PARTS).chars())),
        }
    }
    text.into_iter().collect()
}

fn of_parts(random: &mut Random) -> String {
    (0..=random.below(12)).map(|_| random.one_of(&PARTS)).collect()
}

/// Tries the program with every type, and its results with values from all corners. How many programs there were.
fn try_all(text: &str, expression: &Expression, random: &mut Random) -> usize {
    const EXTREMES: [f64; 20] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        -0.5,
        2.0,
        7.0,
        32767.0,
        -32768.0,
        65535.0,
        2147483647.0,
        -2147483648.0,
        1e308,
        -1e308,
        5e-324,
        1e-5,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    let mut programs = 0;
    for _ in 0..8 {
        let types: Vec<_> =
            expression.names().iter().map(|_| random.one_of(&PinType::ALL)).collect();
        let program = match expression.program(&types) {
            Ok(program) => program,
            Err(mistake) => {
                assert!(text.get(mistake.span.clone()).is_some(), "{text}: {mistake:?}");
                assert!(!mistake.message.is_empty());
                continue;
            }
        };
        programs += 1;
        for _ in 0..20 {
            let inputs: Vec<_> = types.iter().map(|_| random.one_of(&EXTREMES)).collect();
            let mut registers = vec![random.one_of(&EXTREMES); program.registers()];
            match program.evaluate(&inputs, &mut registers) {
                Ok(value) => {
                    assert!(value.is_finite(), "{text} of {inputs:?}: {value}");
                    assert!(program.result().holds(value), "{text} of {inputs:?}: {value}");
                    let is_whole = program.result() != PinType::Lreal;
                    assert!(!(is_whole && value == 0.0 && value.is_sign_negative()), "{text}: -0");
                }
                Err(status) => assert!(
                    matches!(status, 0x8210..=0x8213 | 0x8F00),
                    "{text} of {inputs:?}: {status:X}"
                ),
            }
            // Registers and slots that are missing, too.
            let _ = program.evaluate(&[], &mut registers);
            let _ = program.evaluate(&inputs, &mut registers[..program.steps() / 2]);
            assert!(program.evaluate(&inputs, &mut []).is_err());
        }
    }
    programs
}

#[test]
fn every_text_is_a_program_or_a_mistake_in_it_and_every_program_is_total() {
    let mut random = Random(61131);
    let (mut mistakes, mut programs) = (0, 0);
    for count in 0..10_000 {
        let text = if count % 2 == 0 { mutated(&mut random) } else { of_parts(&mut random) };
        match parse(&text) {
            Ok(expression) => programs += try_all(&text, &expression, &mut random),
            Err(mistake) => {
                mistakes += 1;
                assert!(text.get(mistake.span.clone()).is_some(), "{text}: {mistake:?}");
                assert!(!mistake.message.is_empty(), "{text}");
            }
        }
    }
    assert!(mistakes > 3000 && programs > 1000, "{mistakes} mistakes, {programs} programs");
}

#[test]
fn a_name_is_where_it_is_said_to_be() {
    for text in SEEDS {
        let expression = parse(text).unwrap();
        for it in expression.names() {
            assert_eq!(text[it.span.clone()].trim_matches('"'), it.name, "{text}");
        }
    }
    let expression = parse("b + \"a\" * a - b + \"b\"").unwrap();
    let names: Vec<_> = expression.names().iter().map(|it| (&*it.name, it.span.clone())).collect();
    assert_eq!(names, [("b", 0..1), ("a", 4..7)]);
}
