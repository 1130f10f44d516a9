//! What an expression is worth.

use isochrone_blocks::PinType::{Bool, Int, Lreal, Time, Word};
use isochrone_blocks::status::{
    CONVERSION, DIVISION_BY_ZERO, NOT_FINITE, OUT_OF_DOMAIN, SELECTION,
};

use super::{Signals, value};

const SIGNALS: Signals<'static> = &[
    ("x", Lreal, 2.5),
    ("y", Lreal, -4.0),
    ("nan", Lreal, f64::NAN),
    ("inf", Lreal, f64::INFINITY),
    ("huge", Lreal, 1e308),
    ("i", Int, 7.0),
    ("j", Int, -2.0),
    ("zero", Int, 0.0),
    ("most", Int, 32767.0),
    ("on", Bool, 1.0),
    ("off", Bool, 0.0),
    ("t", Time, 1500.0),
    ("longest", Time, 2147483647.0),
    ("state", Word, 33280.0),
    ("tank.level", Lreal, 1.75),
    ("pump-1.y@prev", Lreal, 3.0),
    ("AND", Bool, 1.0),
    ("max", Lreal, 9.0),
];

#[test]
fn comments_stand_wherever_spaces_do_and_in_each_other() {
    for (text, expected) in [
        ("(**)x(* level *)", 2.5),
        ("x (* a (* b *) (* c *) *) + (* + 1 *) 1", 3.5),
        ("x /* a /* b */ (* c */ + 1", 3.5),
        ("max (* of two *) (x (* the first *), y)", 2.5),
        ("max (* a signal *) + 1", 10.0),
        ("x // - 1\n + 1 // - 2", 3.5),
        ("x (* é *) * 2", 5.0),
        ("\"pump-1.y@prev\" (* \" *) / 2", 1.5),
    ] {
        assert_eq!(value(text, SIGNALS), (Lreal, Ok(expected)), "{text}");
    }
}

#[test]
fn operators_bind_in_the_order_of_the_standard() {
    for (text, expected) in [
        ("-2 ** 2", 4.0),
        ("2 ** -1", 0.5),
        ("2 ** 3 ** 2", 64.0),
        ("-x * 2.0", -5.0),
        ("2 * 3 ** 2", 18.0),
        ("10 - 4 - 3", 3.0),
        ("100 / 10 / 5", 2.0),
        ("100 / 10 * 5", 50.0),
        ("17 MOD 10 * 2", 14.0),
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("+x", 2.5),
    ] {
        assert_eq!(value(text, SIGNALS).1, Ok(expected), "{text}");
    }
    for (text, expected) in [
        ("1 + 2 < 2 * 2", true),
        ("1 < 2 = on", true),
        ("on = 1 < 2", true),
        ("off = 1 > 2 = on", true),
        ("NOT on = on", false),
        ("NOT (on = off)", true),
        ("on OR off AND off", true),
        ("(on OR off) AND off", false),
        ("on OR on XOR on", true),
        ("(on OR on) XOR on", false),
        ("on XOR on AND off", true),
        ("on & NOT off", true),
        ("NOT off AND on", true),
        ("x > 1.0 AND y < 0.0 OR off", true),
        ("i = 7 AND j <> 7", true),
    ] {
        assert_eq!(value(text, SIGNALS), (Bool, Ok(f64::from(u8::from(expected)))), "{text}");
    }
}

#[test]
fn names_are_the_longest_match_or_stand_in_quotes() {
    for (text, expected) in [
        ("tank.level*2", 3.5),
        ("\"pump-1.y@prev\" - 1", 2.0),
        ("max", 9.0),
        ("\"max\"-max", 0.0),
        ("MAX(max, 1)", 9.0),
        ("max(max, 10)", 10.0),
    ] {
        assert_eq!(value(text, SIGNALS).1, Ok(expected), "{text}");
    }
    assert_eq!(value("not \"AND\" Or tRUE", SIGNALS), (Bool, Ok(1.0)));
}

#[test]
fn literals_are_those_of_the_standard() {
    for (text, of, expected) in [
        ("16#8F_00", Lreal, 36608.0),
        ("16#7F", Int, 127.0),
        ("2#1010_0000", Int, 160.0),
        ("-8#17", Int, -15.0),
        ("1_000", Int, 1000.0),
        ("-32768", Int, -32768.0),
        ("40000", Lreal, 40000.0),
        ("1.5e-3", Lreal, 0.0015),
        ("1E3", Lreal, 1000.0),
        ("INT#-16#10", Int, -16.0),
        ("LREAL#2", Lreal, 2.0),
        ("WORD#16#8200", Word, 33280.0),
        ("BOOL#1", Bool, 1.0),
        ("Bool#false", Bool, 0.0),
        ("T#2s500ms", Time, 2500.0),
        ("time#-1.5s", Time, -1500.0),
        ("T#1h_30m", Time, 5_400_000.0),
        ("500ms", Time, 500.0),
    ] {
        assert_eq!(value(text, SIGNALS), (of, Ok(expected)), "{text}");
    }
}

#[test]
fn numbers_have_the_type_of_what_they_meet() {
    for (text, of, expected) in [
        ("x + 1", Lreal, 3.5),
        ("x + i", Lreal, 9.5),
        ("i / 2", Int, 3.0),
        ("i / 2.0", Lreal, 3.5),
        ("j / 3 + i", Int, 7.0),
        ("1 / 2", Int, 0.0),
        ("40000 * 2", Lreal, 80000.0),
        ("state = 16#8200", Bool, 1.0),
        ("state AND 16#FF00", Word, 33280.0),
        ("NOT state", Word, 32255.0),
        ("state XOR WORD#1 OR WORD#2", Word, 33283.0),
        ("SEL(on, 1, 2.5)", Lreal, 2.5),
        ("MIN(i, 3)", Int, 3.0),
        ("i ** 2", Lreal, 49.0),
    ] {
        assert_eq!(value(text, SIGNALS), (of, Ok(expected)), "{text}");
    }
}

#[test]
fn int_wraps_and_its_division_truncates() {
    for (text, expected) in [
        ("most + 1", -32768.0),
        ("-32768 - i", 32761.0),
        ("most * 2", -2.0),
        ("-(-32768)", -32768.0),
        ("-32768 / -1", -32768.0),
        ("-32768 MOD -1", 0.0),
        ("ABS(-32768)", -32768.0),
        ("-7 / 2", -3.0),
        ("7 / -2", -3.0),
        ("-7 MOD 2", -1.0),
        ("7 MOD -2", 1.0),
        ("i MOD zero", 0.0),
    ] {
        assert_eq!(value(text, SIGNALS), (Int, Ok(expected)), "{text}");
    }
}

#[test]
fn times_are_added_compared_and_scaled() {
    for (text, of, expected) in [
        ("t + T#1s", Time, 2500.0),
        ("t - T#2s", Time, -500.0),
        ("t * 2", Time, 3000.0),
        ("t * x", Time, 3750.0),
        ("T#1ms * 2.5", Time, 2.0),
        ("t / i", Time, 214.0),
        ("t / 7.0", Time, 214.0),
        ("t / 1000.0", Time, 2.0),
        ("-t", Time, -1500.0),
        ("t >= T#1.5s", Bool, 1.0),
        ("LIMIT(T#0s, t, T#1s)", Time, 1000.0),
        ("TIME_TO_LREAL(t) / 1000.0", Lreal, 1.5),
        ("TIME_TO_INT(t)", Int, 1500.0),
        ("LREAL_TO_TIME(x)", Time, 2.0),
        ("INT_TO_TIME(i)", Time, 7.0),
    ] {
        assert_eq!(value(text, SIGNALS), (of, Ok(expected)), "{text}");
    }
}

#[test]
fn functions_compute_what_the_standard_says() {
    for (text, of, expected) in [
        ("ABS(y)", Lreal, 4.0),
        ("ABS(j)", Int, 2.0),
        ("SQRT(IN := 6.25)", Lreal, 2.5),
        ("EXPT(2, 10)", Lreal, 1024.0),
        ("LOG(1000)", Lreal, 3.0),
        ("ATAN2(Y := 0, X := 1)", Lreal, 0.0),
        ("MAX(1, 5, 3)", Int, 5.0),
        ("MIN(IN2 := 5.0, IN1 := x, IN3 := 3)", Lreal, 2.5),
        ("LIMIT(0, x, 1)", Lreal, 1.0),
        ("LIMIT(MX := 10, MN := 3, IN := x)", Lreal, 3.0),
        ("LIMIT(5, 1, 3)", Int, 3.0),
        ("SEL(off, x, y)", Lreal, 2.5),
        ("SEL(G := on, IN1 := y, IN0 := x)", Lreal, -4.0),
        ("MUX(2, 10, 20, 30)", Int, 30.0),
        ("MUX(IN0 := x, IN1 := y, K := zero)", Lreal, 2.5),
        ("MUX(zero, on, off)", Bool, 1.0),
        ("TRUNC(-2.7)", Int, -2.0),
        ("LREAL_TRUNC_INT(2.7)", Int, 2.0),
        ("LREAL_TO_INT(2.5)", Int, 2.0),
        ("LREAL_TO_INT(3.5)", Int, 4.0),
        ("LREAL_TO_INT(-0.4)", Int, 0.0),
        ("INT_TO_LREAL(i) / 2", Lreal, 3.5),
        ("WORD_TO_INT(state)", Int, -32256.0),
        ("INT_TO_WORD(-1)", Word, 65535.0),
        ("BOOL_TO_INT(on) + 1", Int, 2.0),
        ("BOOL_TO_LREAL(on)", Lreal, 1.0),
        ("BOOL_TO_WORD(off)", Word, 0.0),
    ] {
        assert_eq!(value(text, SIGNALS), (of, Ok(expected)), "{text}");
    }
}

#[test]
fn an_error_that_reaches_the_result_is_its_status() {
    for (text, status) in [
        ("x / 0", DIVISION_BY_ZERO),
        ("i / zero", DIVISION_BY_ZERO),
        ("t / zero", DIVISION_BY_ZERO),
        ("0.0 ** -1", DIVISION_BY_ZERO),
        ("nan", NOT_FINITE),
        ("inf - inf", NOT_FINITE),
        ("nan > 1.0", NOT_FINITE),
        ("nan > 1.0 AND off", NOT_FINITE),
        ("on OR nan > 1.0", NOT_FINITE),
        ("huge * 10", NOT_FINITE),
        ("EXP(1000)", NOT_FINITE),
        ("MAX(x, nan)", NOT_FINITE),
        ("SQRT(y)", OUT_OF_DOMAIN),
        ("LN(0)", OUT_OF_DOMAIN),
        ("LOG(y)", OUT_OF_DOMAIN),
        ("ASIN(x)", OUT_OF_DOMAIN),
        ("y ** 0.5", OUT_OF_DOMAIN),
        ("LREAL_TO_INT(32767.5)", CONVERSION),
        ("TRUNC(huge)", CONVERSION),
        ("longest + T#1ms", CONVERSION),
        ("longest * 2", CONVERSION),
        ("TIME_TO_INT(longest)", CONVERSION),
        ("MUX(2, 1, 2)", SELECTION),
        ("MUX(j, 1, 2)", SELECTION),
        // The first of several, from left to right.
        ("x / 0 + SQRT(y)", DIVISION_BY_ZERO),
        ("SQRT(y) + x / 0", OUT_OF_DOMAIN),
    ] {
        assert_eq!(value(text, SIGNALS).1, Err(status), "{text}");
    }
}

#[test]
fn what_sel_and_mux_do_not_select_is_no_error() {
    for (text, expected) in [
        ("SEL(zero <> 0, 0.0, x / zero)", 0.0),
        ("SEL(on, SQRT(y), x)", 2.5),
        ("MUX(1, nan, x, inf)", 2.5),
    ] {
        assert_eq!(value(text, SIGNALS).1, Ok(expected), "{text}");
    }
    assert_eq!(value("SEL(nan > 0, x, x)", SIGNALS).1, Err(NOT_FINITE));
}

#[test]
fn slots_that_hold_no_value_of_their_type_are_errors() {
    for (of, slot, expected) in [
        (Int, f64::NAN, Err(NOT_FINITE)),
        (Int, 40000.0, Err(CONVERSION)),
        (Time, 0.5, Err(CONVERSION)),
        (Word, -1.0, Err(CONVERSION)),
        (Bool, f64::NAN, Err(NOT_FINITE)),
        (Bool, 3.0, Ok(1.0)),
        (Int, -0.0, Ok(0.0)),
    ] {
        let (found, result) = value("a", &[("a", of, slot)]);
        assert_eq!((found, result.map(f64::to_bits)), (of, expected.map(f64::to_bits)), "{slot}");
    }
}
