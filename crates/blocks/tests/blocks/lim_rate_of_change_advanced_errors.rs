//! LimRateOfChangeAdvancedCI, error by error.

use isochrone_blocks::Ob;
use isochrone_blocks::lim_rate_of_change_advanced::Inputs;

use crate::lim_rate_of_change_advanced::{
    assert_step, at, auto, limits, manual, preset, step, track,
};

const NOT_FINITE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

#[test]
fn a_signal_that_is_not_finite_holds_the_mode_that_uses_it_and_no_other() {
    for bad in NOT_FINITE {
        let restart = Inputs { reset: true, ..preset(bad) };
        for inputs in [auto(bad), track(bad), manual(bad), preset(bad), restart] {
            assert_step(&mut at(3.0), inputs, 3.0, &[], 0x8F00);
        }
        let others = Inputs { manual_value: bad, default_out_value: bad, ..auto(100.0) };
        assert_step(&mut at(3.0), others, 4.0, &["posUp"], 0);
        assert_step(&mut at(3.0), Inputs { auto_value: bad, ..preset(5.0) }, 5.0, &[], 0);
        assert_step(&mut at(3.0), Inputs { auto_value: bad, ..manual(5.0) }, 5.0, &[], 0);
    }
}

/// `inputs` with the `index`th rate replaced.
fn with_rate(index: usize, rate: f64, mut inputs: Inputs) -> Inputs {
    *[
        &mut inputs.set_pos_up_rate_lim,
        &mut inputs.set_pos_down_rate_lim,
        &mut inputs.set_neg_up_rate_lim,
        &mut inputs.set_neg_down_rate_lim,
    ][index] = rate;
    inputs
}

#[test]
fn any_bad_rate_is_reported_in_every_mode_and_holds_the_automatic_one() {
    for index in 0..4 {
        for (rate, status) in [(-1.0, 0x8202), (f64::NEG_INFINITY, 0x8202), (f64::NAN, 0x8F00)] {
            let bad = |inputs| with_rate(index, rate, inputs);
            assert_step(&mut at(3.0), bad(auto(100.0)), 3.0, &[], status);
            assert_step(&mut at(3.0), bad(track(9.0)), 9.0, &[], status);
            assert_step(&mut at(3.0), bad(preset(9.0)), 9.0, &[], status);
            assert_step(&mut at(3.0), bad(manual(9.0)), 9.0, &[], status);
            let restart = Inputs { reset: true, ..auto(1.0) };
            assert_step(&mut at(3.0), bad(restart), 0.0, &[], status);
        }
    }
}

#[test]
fn bad_limits_hold_every_mode_that_the_limits_follow() {
    for (low, high, status) in
        [(1.0, -1.0, 0x8200), (f64::NAN, 1.0, 0x8F00), (-1.0, f64::NAN, 0x8F00)]
    {
        let bad = |inputs| limits(low, high, inputs);
        for inputs in [auto(100.0), track(9.0), preset(9.0)] {
            assert_step(&mut at(3.0), bad(inputs), 3.0, &[], status);
        }
        assert_step(&mut at(3.0), bad(manual(9.0)), 9.0, &[], status);
    }
}

#[test]
fn an_unknown_ob_holds_the_ramp_but_not_tracking_and_preset() {
    for (ob, status, sub) in [(36, 0x8601, 0), (0, 0x8600, 0x8090)] {
        let bad = |inputs| Inputs { call_ob: Ob::Number(ob), ..inputs };
        assert_step(&mut at(3.0), bad(auto(100.0)), 3.0, &[], status);
        assert_step(&mut at(3.0), bad(track(9000.0)), 1000.0, &["high"], status);
        assert_step(&mut at(3.0), bad(preset(9.0)), 9.0, &[], status);
        assert_eq!(step(&mut at(3.0), bad(auto(1.0))).subfunction_status, sub);
    }
}

#[test]
fn of_several_errors_the_ob_comes_first_then_limits_then_rates_then_values() {
    let values = auto(f64::NAN);
    let rates = Inputs { set_neg_up_rate_lim: -1.0, set_pos_up_rate_lim: f64::NAN, ..values };
    let inverted = limits(1.0, -1.0, rates);
    let ob = Inputs { call_ob: Ob::Number(30), ..inverted };
    let wrong = Inputs { call_ob: Ob::Number(-5), ..inverted };
    for (inputs, status) in
        [(wrong, 0x8600), (ob, 0x8601), (inverted, 0x8200), (rates, 0x8202), (values, 0x8F00)]
    {
        assert_step(&mut at(3.0), inputs, 3.0, &[], status);
    }
}
