//! What holds for every input of a ramp or a scale, finite or not. What holds for every block is in
//! `isochrone_blocks::testing`.

use crate::arbitrary;
use crate::arbitrary::OBS;
use isochrone_blocks::lim_rate_of_change::{self, LimRateOfChangeCI};
use isochrone_blocks::lim_rate_of_change_advanced::{self, LimRateOfChangeAdvancedCI};
use isochrone_blocks::scale_linear::{self, ScaleLinear};
use isochrone_blocks::{Block, Cycle};
use proptest::prelude::*;

/// A step from 0 is not rounded twice; one across it is, at most this much of its terms.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

proptest! {
    #[test]
    fn a_ramp_never_moves_by_more_than_its_step(
        sequence in arbitrary::sequence(arbitrary::ramp()),
        period_ns in arbitrary::period_ns(),
    ) {
        let (mut state, mut y) = (lim_rate_of_change::State::default(), 0.0f64);
        let cycle = Cycle::new(0, period_ns, OBS);
        for inputs in &sequence {
            let outputs = LimRateOfChangeCI::step(&mut state, inputs, &cycle);
            let next = outputs.delayed_value;
            if !inputs.en_default_out_value && outputs.error {
                prop_assert_eq!(next.to_bits(), y.to_bits());
            } else if !inputs.en_default_out_value {
                let step = inputs.set_change_rate * cycle.sample_time_s(inputs.call_ob).unwrap();
                prop_assert!(y - step <= next && next <= y + step, "{y} to {next} by {step}");
            }
            y = next;
        }
    }

    #[test]
    fn an_advanced_ramp_never_moves_by_more_than_the_larger_of_its_two_rates(
        sequence in arbitrary::sequence(arbitrary::advanced()),
        period_ns in arbitrary::period_ns(),
    ) {
        let (mut state, mut y) = (lim_rate_of_change_advanced::State::default(), 0.0f64);
        let cycle = Cycle::new(0, period_ns, OBS);
        for i in &sequence {
            let outputs = LimRateOfChangeAdvancedCI::step(&mut state, i, &cycle);
            let next = outputs.output_value;
            let rates = [
                i.set_pos_up_rate_lim, i.set_pos_down_rate_lim,
                i.set_neg_up_rate_lim, i.set_neg_down_rate_lim,
            ];
            let automatic = !(i.reset || i.man_op || i.en_default_out_value || i.track)
                && rates != [0.0; 4];
            if automatic && outputs.error {
                prop_assert_eq!(next.to_bits(), y.to_bits());
            }
            // A limit may move the output further than the ramp, but to the limit only.
            let at_limit = next == i.set_high_lim || next == i.set_low_lim;
            if automatic && !outputs.error && !at_limit {
                let rising = i.set_neg_down_rate_lim.max(i.set_pos_up_rate_lim);
                let falling = i.set_pos_down_rate_lim.max(i.set_neg_up_rate_lim);
                let sample_time_s = cycle.sample_time_s(i.call_ob).unwrap();
                let (up, down) = (rising * sample_time_s, falling * sample_time_s);
                if (y > 0.0) == (next > 0.0) || y == 0.0 || next == 0.0 {
                    prop_assert!(y - down <= next && next <= y + up, "{y} to {next}: {outputs:?}");
                } else {
                    let slack = ROUNDING * (y.abs() + up.max(down));
                    prop_assert!(y - down - slack <= next, "{y} to {next}: {outputs:?}");
                    prop_assert!(next <= y + up + slack, "{y} to {next}: {outputs:?}");
                }
            }
            y = next;
        }
    }

    #[test]
    fn at_most_one_rate_flag_is_true_and_none_where_the_target_or_the_limit_before_it_is_reached(
        sequence in arbitrary::sequence(arbitrary::advanced()),
    ) {
        let mut state = lim_rate_of_change_advanced::State::default();
        for inputs in &sequence {
            let outputs =
                LimRateOfChangeAdvancedCI::step(&mut state, inputs, &Cycle::new(0, 1_000_000, OBS));
            let rate_flags = [
                outputs.pos_up_rate_lim, outputs.pos_down_rate_lim,
                outputs.neg_up_rate_lim, outputs.neg_down_rate_lim,
            ];
            let set = rate_flags.iter().filter(|flag| **flag).count();
            prop_assert!(set <= 1);
            let (y, target) = (outputs.output_value, inputs.auto_value);
            let stopped_by_a_limit = (y == inputs.set_high_lim && target > y)
                || (y == inputs.set_low_lim && target < y);
            prop_assert!(set == 0 || !(y == target || stopped_by_a_limit));
        }
    }

    #[test]
    fn scale_linear_stays_within_its_limits_whenever_it_reports_no_error(
        sequence in prop::collection::vec(arbitrary::scale(), 1..100),
    ) {
        let mut state = scale_linear::State::default();
        for inputs in &sequence {
            let outputs = ScaleLinear::step(&mut state, inputs, &Cycle::new(0, 1_000_000, &[]));
            prop_assert!(outputs.error || (inputs.y_min <= outputs.y && outputs.y <= inputs.y_max));
        }
    }
}
