//! LimRateOfChangeCI, mode by mode and error by error.

use isochrone_blocks::lim_rate_of_change::{Inputs, LimRateOfChangeCI, Outputs, State};
use isochrone_blocks::{Block, Cycle, Ob};

const PERIOD_NS: u64 = 100_000_000;
const OBS: &[(i16, u64)] = &[(35, 10_000_000), (123, 1_000_000_000), (32_767, 500_000_000)];

fn ramp(value: f64, rate: f64) -> Inputs {
    Inputs { value, set_change_rate: rate, ..Inputs::default() }
}

fn preset(value: f64) -> Inputs {
    Inputs { default_out_value: value, en_default_out_value: true, ..ramp(0.0, 1.0) }
}

fn step(state: &mut State, inputs: Inputs) -> Outputs {
    LimRateOfChangeCI::step(state, &inputs, &Cycle::new(0, PERIOD_NS, OBS))
}

/// A state whose output is `y`.
fn at(y: f64) -> State {
    let mut state = State::default();
    assert_eq!(step(&mut state, preset(y)).delayed_value, y);
    state
}

/// Output and status after a step.
fn after(state: &mut State, inputs: Inputs) -> (f64, u16) {
    let outputs = step(state, inputs);
    assert_eq!(outputs.error, outputs.status >= 0x8000, "{inputs:?}");
    (outputs.delayed_value, outputs.status)
}

fn first(inputs: Inputs) -> (f64, u16) {
    after(&mut State::default(), inputs)
}

#[test]
fn the_first_call_moves_one_step_away_from_zero() {
    assert_eq!(step(&mut State::default(), ramp(25.0, 10.0)).delayed_value, 1.0);
    assert_eq!(step(&mut State::default(), ramp(-25.0, 10.0)).delayed_value, -1.0);
}

#[test]
fn the_seeds_example_adds_10_1_and_0_1_at_1_s_100_ms_and_10_ms() {
    for (period_ns, expected) in [(1_000_000_000, 10.0), (100_000_000, 1.0), (10_000_000, 0.1)] {
        let cycle = Cycle::new(0, period_ns, &[]);
        let outputs = LimRateOfChangeCI::step(&mut State::default(), &ramp(1e3, 10.0), &cycle);
        assert_eq!(outputs.delayed_value, expected);
    }
}

#[test]
fn a_ramp_lands_on_its_target_exactly_and_stays() {
    let mut state = State::default();
    let path: Vec<f64> = (0..5).map(|_| step(&mut state, ramp(2.5, 10.0)).delayed_value).collect();
    assert_eq!(path, [1.0, 2.0, 2.5, 2.5, 2.5]);
    let path: Vec<f64> = (0..5).map(|_| step(&mut state, ramp(-0.5, 10.0)).delayed_value).collect();
    assert_eq!(path, [1.5, 0.5, -0.5, -0.5, -0.5]);
}

#[test]
fn steps_accumulate_as_single_additions_bit_for_bit() {
    let mut state = State::default();
    let mut expected = 0.0;
    for _ in 0..1000 {
        expected += 0.3 * (PERIOD_NS as f64 / 1e9);
        let y = step(&mut state, ramp(1e9, 0.3)).delayed_value;
        assert_eq!(y.to_bits(), expected.to_bits());
    }
}

#[test]
fn a_rate_of_zero_holds_the_output_without_an_error() {
    let mut state = at(3.0);
    for target in [10.0, -10.0, 3.0] {
        assert_eq!(after(&mut state, ramp(target, 0.0)), (3.0, 0));
    }
    assert_eq!(step(&mut state, ramp(9.0, -0.0)).status, 0);
}

#[test]
fn an_infinite_rate_is_no_limit() {
    assert_eq!(first(ramp(1e300, f64::INFINITY)), (1e300, 0));
}

#[test]
fn the_largest_step_does_not_overflow() {
    let mut state = at(f64::MAX);
    assert_eq!(step(&mut state, ramp(f64::MIN, f64::MAX)).delayed_value, f64::MAX - f64::MAX * 0.1);
    let mut state = at(f64::MAX);
    assert_eq!(step(&mut state, ramp(f64::MIN, f64::INFINITY)).delayed_value, f64::MIN);
}

#[test]
fn preset_jumps_and_the_ramp_starts_from_there() {
    let mut state = State::default();
    assert_eq!(step(&mut state, preset(7.0)).delayed_value, 7.0);
    assert_eq!(step(&mut state, ramp(0.0, 10.0)).delayed_value, 6.0);
}

#[test]
fn a_negative_rate_is_8200_and_holds_the_ramp() {
    let mut state = at(3.0);
    assert_eq!(after(&mut state, ramp(10.0, -1.0)), (3.0, 0x8200));
    assert_eq!(first(ramp(1.0, f64::NEG_INFINITY)).1, 0x8200);
    assert_eq!(first(ramp(1.0, -5e-324)).1, 0x8200);
}

#[test]
fn a_preset_with_a_negative_rate_is_reported_and_still_acts() {
    assert_eq!(first(Inputs { set_change_rate: -1.0, ..preset(7.0) }), (7.0, 0x8200));
}

#[test]
fn a_preset_with_a_wrong_ob_is_reported_and_still_acts() {
    for (ob, status) in [(36, 0x8601), (1, 0x8600)] {
        let inputs = Inputs { call_ob: Ob::Number(ob), ..preset(7.0) };
        assert_eq!(first(inputs), (7.0, status));
    }
}

#[test]
fn a_nan_rate_is_8f00_in_both_modes_and_holds_only_the_ramp() {
    let mut state = at(3.0);
    assert_eq!(after(&mut state, ramp(10.0, f64::NAN)), (3.0, 0x8F00));
    assert_eq!(
        after(&mut state, Inputs { set_change_rate: f64::NAN, ..preset(7.0) }),
        (7.0, 0x8F00)
    );
}

#[test]
fn a_signal_that_is_not_finite_is_8f00_and_holds_where_the_mode_uses_it() {
    for signal in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut state = at(3.0);
        assert_eq!(after(&mut state, ramp(signal, 1.0)), (3.0, 0x8F00));
        assert_eq!(after(&mut state, preset(signal)), (3.0, 0x8F00));
        // The signal of the other mode may be anything.
        assert_eq!(after(&mut state, Inputs { value: signal, ..preset(7.0) }), (7.0, 0));
        assert_eq!(
            after(&mut state, Inputs { default_out_value: signal, ..ramp(7.0, 1.0) }),
            (7.0, 0)
        );
    }
}

#[test]
fn of_several_errors_the_ob_comes_first_then_the_rate_then_the_signal() {
    let all = Inputs { call_ob: Ob::Number(38), ..ramp(f64::NAN, -1.0) };
    assert_eq!(first(all).1, 0x8601);
    assert_eq!(first(Inputs { call_ob: Ob::Number(39), ..all }).1, 0x8600);
    assert_eq!(first(Inputs { call_ob: Ob::Caller, ..all }).1, 0x8200);
    assert_eq!(first(ramp(f64::NAN, 1.0)).1, 0x8F00);
}

/// Output, status and subfunction status of a first step under this OB.
fn with_ob(number: i16) -> (f64, u16, u16) {
    let inputs = Inputs { call_ob: Ob::Number(number), ..ramp(100.0, 10.0) };
    let outputs = step(&mut State::default(), inputs);
    (outputs.delayed_value, outputs.status, outputs.subfunction_status)
}

#[test]
fn cyclic_ob_numbers_without_a_task_are_8601_with_subfunction_0() {
    for ob in (30..=38).chain([124, 1000, 32_766]).filter(|ob| *ob != 35) {
        assert_eq!(with_ob(ob), (0.0, 0x8601, 0), "OB {ob}");
    }
}

#[test]
fn all_other_numbers_are_8600_with_subfunction_8090() {
    for ob in [i16::MIN, -1, 0, 1, 29, 39, 122] {
        assert_eq!(with_ob(ob), (0.0, 0x8600, 0x8090), "OB {ob}");
    }
}

#[test]
fn call_ob_takes_the_period_of_the_task_that_it_names() {
    for (ob, y) in [(35, 0.1), (123, 10.0), (32_767, 5.0)] {
        assert_eq!(with_ob(ob), (y, 0, 0), "OB {ob}");
    }
}

#[test]
fn after_an_error_the_ramp_goes_on_from_the_value_that_was_held() {
    let mut state = at(3.0);
    step(&mut state, ramp(10.0, -1.0));
    step(&mut state, ramp(f64::NAN, 10.0));
    assert_eq!(after(&mut state, ramp(10.0, 10.0)), (4.0, 0));
}
