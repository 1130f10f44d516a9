//! LimRateOfChangeAdvancedCI, mode by mode and error by error.

use isochrone_blocks::lim_rate_of_change_advanced::{
    Inputs, LimRateOfChangeAdvancedCI, Outputs, State,
};
use isochrone_blocks::{Block, BlockType, Cycle, Ob, Slots};

const PERIOD_NS: u64 = 100_000_000;
/// Automatic mode with four different rates and wide limits: steps of 1, 2, 3 and 4.
pub(crate) fn auto(value: f64) -> Inputs {
    Inputs {
        auto_value: value,
        set_pos_up_rate_lim: 10.0,
        set_pos_down_rate_lim: 20.0,
        set_neg_up_rate_lim: 30.0,
        set_neg_down_rate_lim: 40.0,
        set_high_lim: 1000.0,
        set_low_lim: -1000.0,
        ..Inputs::default()
    }
}

pub(crate) fn limits(low: f64, high: f64, inputs: Inputs) -> Inputs {
    Inputs { set_low_lim: low, set_high_lim: high, ..inputs }
}

pub(crate) fn manual(value: f64) -> Inputs {
    Inputs { man_op: true, manual_value: value, ..auto(0.0) }
}

pub(crate) fn preset(value: f64) -> Inputs {
    Inputs { en_default_out_value: true, default_out_value: value, ..auto(0.0) }
}

pub(crate) fn track(value: f64) -> Inputs {
    Inputs { track: true, ..auto(value) }
}

pub(crate) fn step(state: &mut State, inputs: Inputs) -> Outputs {
    LimRateOfChangeAdvancedCI::step(state, &inputs, &Cycle::new(0, PERIOD_NS, &[(35, 1_000_000)]))
}

/// A state whose output is `y`, with the limits armed.
pub(crate) fn at(y: f64) -> State {
    let mut state = State::default();
    let inputs = Inputs { reset: true, ..preset(y) };
    assert_eq!(step(&mut state, inputs).output_value, y);
    state
}

/// The flags that are TRUE, by name.
fn flags(outputs: &Outputs) -> Vec<&'static str> {
    [
        (outputs.pos_up_rate_lim, "posUp"),
        (outputs.pos_down_rate_lim, "posDown"),
        (outputs.neg_up_rate_lim, "negUp"),
        (outputs.neg_down_rate_lim, "negDown"),
        (outputs.high_lim, "high"),
        (outputs.low_lim, "low"),
    ]
    .into_iter()
    .filter_map(|(flag, name)| flag.then_some(name))
    .collect()
}

#[track_caller]
pub(crate) fn assert_step(state: &mut State, inputs: Inputs, y: f64, set: &[&str], status: u16) {
    let outputs = step(state, inputs);
    assert_eq!((outputs.output_value, outputs.status), (y, status), "{outputs:?}");
    assert_eq!(flags(&outputs), set);
    assert_eq!(outputs.error, status >= 0x8000);
}

#[test]
fn each_range_and_direction_has_its_own_rate_and_flag() {
    assert_step(&mut at(10.0), auto(100.0), 11.0, &["posUp"], 0);
    assert_step(&mut at(10.0), auto(1.0), 8.0, &["posDown"], 0);
    assert_step(&mut at(-10.0), auto(-100.0), -13.0, &["negUp"], 0);
    assert_step(&mut at(-10.0), auto(-1.0), -6.0, &["negDown"], 0);
}

#[test]
fn from_zero_upwards_is_pos_up_and_downwards_neg_up() {
    for zero in [0.0, -0.0] {
        assert_step(&mut at(zero), auto(5.0), 1.0, &["posUp"], 0);
        assert_step(&mut at(zero), auto(-5.0), -3.0, &["negUp"], 0);
    }
}

#[test]
fn a_target_that_is_reached_sets_no_flag() {
    assert_step(&mut at(10.0), auto(11.0), 11.0, &[], 0);
    assert_step(&mut at(10.0), auto(10.5), 10.5, &[], 0);
    assert_step(&mut at(10.0), auto(10.0), 10.0, &[], 0);
    assert_step(&mut at(1.0), auto(0.0), 0.0, &[], 0);
    assert_step(&mut at(-1.0), auto(0.0), 0.0, &[], 0);
}

#[test]
fn a_zero_crossing_spends_the_rest_of_the_time_at_the_second_rate() {
    let t = 0.1;
    let falling = 30.0 * (t - 1.0 / 20.0);
    assert_step(&mut at(1.0), auto(-100.0), -falling, &["negUp"], 0);
    let rising = 10.0 * (t - 1.0 / 40.0);
    assert_step(&mut at(-1.0), auto(100.0), rising, &["posUp"], 0);
}

#[test]
fn a_zero_crossing_lands_on_a_near_target_exactly_without_a_flag() {
    assert_step(&mut at(1.0), auto(-0.25), -0.25, &[], 0);
    assert_step(&mut at(-1.0), auto(0.25), 0.25, &[], 0);
}

#[test]
fn a_step_that_ends_on_zero_leaves_no_rest_and_keeps_the_first_flag() {
    assert_step(&mut at(2.0), auto(-100.0), 0.0, &["posDown"], 0);
    assert_step(&mut at(-4.0), auto(100.0), 0.0, &["negDown"], 0);
}

#[test]
fn behind_zero_a_second_rate_of_zero_stops_the_output_there() {
    let up = Inputs { set_pos_up_rate_lim: 0.0, ..auto(100.0) };
    assert_step(&mut at(-1.0), up, 0.0, &["posUp"], 0);
    let down = Inputs { set_neg_up_rate_lim: 0.0, ..auto(-100.0) };
    let mut state = at(1.0);
    assert_step(&mut state, down, 0.0, &["negUp"], 0);
    assert!(step(&mut state, down).output_value.is_sign_positive());
}

#[test]
fn infinite_rates_jump_and_cross_zero_without_losing_time() {
    let fast = Inputs { set_neg_down_rate_lim: f64::INFINITY, ..auto(100.0) };
    assert_step(&mut at(-500.0), fast, 1.0, &["posUp"], 0);
    let all = f64::INFINITY;
    let inputs = Inputs {
        set_pos_up_rate_lim: all,
        set_pos_down_rate_lim: all,
        set_neg_up_rate_lim: all,
        set_neg_down_rate_lim: all,
        ..auto(-700.0)
    };
    assert_step(&mut at(500.0), inputs, -700.0, &[], 0);
}

#[test]
fn without_any_rate_the_output_is_zero_and_normal_operation_is_disabled() {
    let disabled = Inputs { set_high_lim: 9.0, set_low_lim: 5.0, ..Inputs::default() };
    let mut state = at(7.0);
    assert_step(&mut state, Inputs { auto_value: 8.0, ..disabled }, 0.0, &[], 0);
    assert_step(&mut state, Inputs { auto_value: f64::NAN, ..disabled }, 0.0, &[], 0);
}

#[test]
fn disabled_operation_needs_limits_and_a_sample_time() {
    let disabled = Inputs::default();
    assert_step(&mut at(7.0), limits(1.0, -1.0, disabled), 7.0, &[], 0x8200);
    assert_step(&mut at(7.0), Inputs { call_ob: Ob::Number(1), ..disabled }, 7.0, &[], 0x8600);
}

#[test]
fn tracking_follows_at_once_within_the_limits() {
    let mut state = State::default();
    assert_step(&mut state, track(500.0), 500.0, &[], 0);
    assert_step(&mut state, track(5000.0), 1000.0, &["high"], 0);
    assert_step(&mut state, track(-5000.0), -1000.0, &["low"], 0);
}

#[test]
fn a_preset_jumps_within_the_limits_and_the_ramp_starts_from_there() {
    let mut state = State::default();
    assert_step(&mut state, preset(5000.0), 1000.0, &["high"], 0);
    assert_step(&mut state, preset(50.0), 50.0, &[], 0);
    assert_step(&mut state, auto(0.0), 48.0, &["posDown"], 0);
}

#[test]
fn the_modes_yield_in_the_order_of_the_specification() {
    let all = Inputs {
        reset: true,
        man_op: true,
        manual_value: 1.0,
        en_default_out_value: true,
        default_out_value: 2.0,
        track: true,
        ..auto(3.0)
    };
    assert_step(&mut at(9.0), all, 2.0, &[], 0);
    assert_step(&mut at(9.0), Inputs { en_default_out_value: false, ..all }, 0.0, &[], 0);
    assert_step(&mut at(9.0), Inputs { reset: false, ..all }, 1.0, &[], 0);
    let preset = Inputs { reset: false, man_op: false, ..all };
    assert_step(&mut at(9.0), preset, 2.0, &[], 0);
    assert_step(&mut at(9.0), Inputs { en_default_out_value: false, ..preset }, 3.0, &[], 0);
}

#[test]
fn an_active_limit_takes_the_place_of_the_rate_flag() {
    assert_step(&mut at(7.5), limits(-8.0, 8.0, auto(100.0)), 8.0, &["high"], 0);
    assert_step(&mut at(-7.5), limits(-8.0, 8.0, auto(-100.0)), -8.0, &["low"], 0);
    // A ramp that ends on the limit is stopped by it if the target lies beyond.
    assert_step(&mut at(7.0), limits(-8.0, 8.0, auto(100.0)), 8.0, &["high"], 0);
    assert_step(&mut at(-5.0), limits(-8.0, 8.0, auto(-100.0)), -8.0, &["low"], 0);
    assert_step(&mut at(-1.0), limits(-8.0, -0.0, auto(100.0)), 0.0, &["high"], 0);
}

#[test]
fn a_rate_flag_stands_beside_the_limit_that_a_ramp_reaches_from_beyond_or_leaves() {
    let within = |inputs| limits(-8.0, 8.0, inputs);
    let mut state = State::default();
    step(&mut state, within(manual(10.0)));
    assert_step(&mut state, within(auto(0.0)), 8.0, &["posDown", "high"], 0);
    assert_step(&mut state, within(auto(0.0)), 6.0, &["posDown"], 0);
    let stuck = Inputs { set_pos_down_rate_lim: 0.0, ..auto(0.0) };
    assert_step(&mut at(8.0), within(stuck), 8.0, &["posDown", "high"], 0);
}

#[test]
fn a_limit_is_reached_at_it_whatever_brings_the_output_there() {
    let within = |inputs| limits(-8.0, 8.0, inputs);
    for go in [auto as fn(f64) -> Inputs, track, preset] {
        assert_step(&mut at(8.0), within(go(8.0)), 8.0, &["high"], 0);
        assert_step(&mut at(-8.0), within(go(-8.0)), -8.0, &["low"], 0);
    }
    assert_step(&mut at(8.0), limits(8.0, 8.0, track(8.0)), 8.0, &["high", "low"], 0);
}

#[test]
fn infinite_limits_are_no_limits() {
    let open = limits(f64::NEG_INFINITY, f64::INFINITY, track(1e300));
    assert_step(&mut State::default(), open, 1e300, &[], 0);
}

#[test]
fn limits_that_only_an_infinity_lies_between_are_8f00() {
    for limit in [f64::INFINITY, f64::NEG_INFINITY] {
        assert_step(&mut at(3.0), limits(limit, limit, track(1.0)), 3.0, &[], 0x8F00);
    }
}

#[test]
fn manual_mode_ignores_ramps_and_limits() {
    let inputs = limits(-8.0, 8.0, manual(500.0));
    assert_step(&mut State::default(), inputs, 500.0, &[], 0);
    assert_step(&mut State::default(), limits(8.0, -8.0, inputs), 500.0, &[], 0x8200);
}

#[test]
fn after_manual_mode_the_limits_stay_off_until_the_range_is_reached() {
    let within = |inputs| limits(-8.0, 8.0, inputs);
    let mut state = State::default();
    step(&mut state, within(manual(11.0)));
    assert_step(&mut state, within(auto(100.0)), 12.0, &["posUp", "high"], 0);
    assert_step(&mut state, within(auto(0.0)), 10.0, &["posDown", "high"], 0);
    assert_step(&mut state, within(auto(0.0)), 8.0, &["posDown", "high"], 0);
    assert_step(&mut state, within(auto(100.0)), 8.0, &["high"], 0);
}

#[test]
fn a_manual_value_within_the_range_has_reached_it() {
    for (by_hand, y) in [(7.5, 8.0), (8.0, 8.0), (-8.0, -4.0), (0.0, 1.0)] {
        let mut state = State::default();
        step(&mut state, limits(-8.0, 8.0, manual(by_hand)));
        let outputs = step(&mut state, limits(-8.0, 8.0, auto(100.0)));
        assert_eq!((outputs.output_value, outputs.high_lim), (y, y == 8.0));
    }
}

#[test]
fn a_step_across_the_range_reaches_it() {
    for (by_hand, to, y, flag) in [(50.0, -60.0, -8.0, "low"), (-50.0, 60.0, 8.0, "high")] {
        let mut state = State::default();
        step(&mut state, limits(-8.0, 8.0, manual(by_hand)));
        assert_step(&mut state, limits(-8.0, 8.0, track(to)), y, &[flag], 0);
        assert_step(&mut state, limits(-8.0, 8.0, track(2.0 * to)), y, &[flag], 0);
    }
}

#[test]
fn limits_that_move_over_the_output_are_reached_too() {
    let mut state = State::default();
    step(&mut state, limits(-8.0, 8.0, manual(11.0)));
    assert_step(&mut state, limits(-8.0, 8.0, auto(100.0)), 12.0, &["posUp", "high"], 0);
    assert_step(&mut state, limits(-8.0, 12.0, auto(100.0)), 12.0, &["high"], 0);
    assert_step(&mut state, limits(-8.0, 8.0, auto(100.0)), 8.0, &["high"], 0);
}

#[test]
fn an_error_that_holds_the_output_leaves_the_limits_off() {
    let mut state = State::default();
    step(&mut state, limits(-8.0, 8.0, manual(11.0)));
    assert_step(&mut state, limits(8.0, -8.0, auto(0.0)), 11.0, &[], 0x8200);
    assert_step(&mut state, limits(-8.0, 8.0, auto(100.0)), 12.0, &["posUp", "high"], 0);
}

#[test]
fn preset_and_tracking_pass_and_arm_disarmed_limits_like_the_ramp() {
    for go in [preset as fn(f64) -> Inputs, track] {
        let mut state = State::default();
        step(&mut state, limits(-8.0, 8.0, manual(50.0)));
        assert_step(&mut state, limits(-8.0, 8.0, go(60.0)), 60.0, &["high"], 0);
        assert_step(&mut state, limits(-8.0, 8.0, go(8.0)), 8.0, &["high"], 0);
        assert_step(&mut state, limits(-8.0, 8.0, go(60.0)), 8.0, &["high"], 0);
    }
}

#[test]
fn a_restart_arms_the_limits_and_its_default_is_limited_without_a_flag() {
    let within = |inputs| limits(-8.0, 8.0, inputs);
    let restart = |inputs| Inputs { reset: true, ..inputs };
    let mut state = State::default();
    step(&mut state, within(manual(50.0)));
    assert_step(&mut state, restart(within(preset(60.0))), 8.0, &[], 0);
    assert_step(&mut state, restart(within(preset(-60.0))), -8.0, &[], 0);
    step(&mut state, within(manual(50.0)));
    assert_step(&mut state, restart(limits(20.0, 30.0, auto(60.0))), 0.0, &[], 0);
    assert_step(&mut state, within(track(100.0)), 8.0, &["high"], 0);
}

#[test]
fn a_restart_does_not_need_limits() {
    let restart = Inputs { reset: true, ..preset(60.0) };
    for (low, high, status) in
        [(8.0, -8.0, 0x8200), (f64::NAN, 8.0, 0x8F00), (-8.0, f64::NAN, 0x8F00)]
    {
        assert_step(&mut at(7.0), limits(low, high, restart), 60.0, &[], status);
    }
}

#[test]
fn a_restart_acts_in_spite_of_everything_that_it_does_not_need() {
    let broken = Inputs {
        reset: true,
        auto_value: f64::NAN,
        manual_value: f64::NAN,
        default_out_value: f64::NAN,
        set_pos_up_rate_lim: f64::NAN,
        call_ob: Ob::Number(0),
        ..limits(1.0, -1.0, auto(0.0))
    };
    assert_step(&mut at(7.0), broken, 0.0, &[], 0x8600);
}

#[test]
fn a_caution_is_needed_as_long_as_the_output_is_beyond_a_limit_that_is_off() {
    const TYPE: BlockType = BlockType::of::<LimRateOfChangeAdvancedCI>();
    let mut slots = vec![0.0; TYPE.slots()];
    let mut state = vec![0; TYPE.state_words];
    let mut needs_caution = |inputs: Inputs| {
        let count = TYPE.inputs.len();
        Slots::write(inputs, &mut slots[..count]);
        TYPE.step_bank(&mut slots, &mut state, &Cycle::new(0, PERIOD_NS, &[]));
        TYPE.needs_caution(&slots)
    };
    let limited = Inputs { set_high_lim: 10.0, set_low_lim: -10.0, ..auto(100.0) };
    let manual = |y| Inputs { man_op: true, manual_value: y, ..limited };
    assert!(!needs_caution(limited), "on the way");
    assert!(!needs_caution(manual(20.0)), "manual mode has no limits");
    assert!(needs_caution(limited), "ramps away");
    assert!(needs_caution(Inputs { auto_value: 0.0, ..limited }), "and back");
    assert!(!needs_caution(Inputs { set_high_lim: -20.0, ..limited }), "an error says more");
    assert!(!needs_caution(Inputs { reset: true, ..limited }));
    assert!(!needs_caution(manual(10.0)));
    assert!(!needs_caution(limited), "at the limit, which holds");
    assert!(!needs_caution(manual(-20.0)));
    assert!(needs_caution(Inputs { auto_value: -100.0, ..limited }));
}
