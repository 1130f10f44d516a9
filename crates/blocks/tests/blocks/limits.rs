//! What the LGF document says of the limits of LimRateOfChangeAdvancedCI, sentence by sentence, for
//! every sequence of inputs.

use crate::arbitrary;
use crate::arbitrary::OBS;
use isochrone_blocks::lim_rate_of_change_advanced::{
    Inputs, LimRateOfChangeAdvancedCI, Outputs, State,
};
use isochrone_blocks::{Block, Cycle};
use proptest::prelude::*;

const PERIOD_NS: u64 = 100_000_000;

fn step(state: &mut State, inputs: &Inputs) -> Outputs {
    LimRateOfChangeAdvancedCI::step(state, inputs, &Cycle::new(0, PERIOD_NS, OBS))
}

/// Low and high limit, of which infinite ones are none.
#[derive(Clone, Copy, Debug)]
struct Limits {
    low: f64,
    high: f64,
}

impl Limits {
    fn of(inputs: &Inputs) -> Self {
        Self { low: inputs.set_low_lim, high: inputs.set_high_lim }
    }

    fn are_valid(self) -> bool {
        self.low <= self.high && self.low < f64::INFINITY && self.high > f64::NEG_INFINITY
    }

    fn hold(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    fn set(self, inputs: Inputs) -> Inputs {
        Inputs { set_low_lim: self.low, set_high_lim: self.high, ..inputs }
    }
}

fn limits() -> impl Strategy<Value = Limits> {
    let any = prop_oneof![4 => arbitrary::halves(), 1 => arbitrary::real()];
    let either = (any.boxed(), arbitrary::halves());
    either
        .prop_map(|(a, b)| Limits { low: a.min(b), high: a.max(b) })
        .prop_filter("valid", |limits| limits.are_valid())
}

/// Whether the limits follow the mode: all but manual mode and the two that put out a plain 0.0.
fn is_limited(i: &Inputs) -> bool {
    let rates = [
        i.set_pos_up_rate_lim,
        i.set_pos_down_rate_lim,
        i.set_neg_up_rate_lim,
        i.set_neg_down_rate_lim,
    ];
    match (i.reset, i.man_op) {
        (true, _) => i.en_default_out_value,
        (_, true) => false,
        _ => i.en_default_out_value || i.track || rates != [0.0; 4],
    }
}

/// Inputs of automatic mode, tracking or preset without an error.
fn working() -> impl Strategy<Value = Inputs> {
    let rates = [0.5..400.0f64, 0.5..400.0, 0.5..400.0, 0.5..400.0];
    (arbitrary::halves(), arbitrary::halves(), rates, arbitrary::seldom(), arbitrary::seldom())
        .prop_map(|(auto_value, default_out_value, rates, track, en_default_out_value)| Inputs {
            auto_value,
            default_out_value,
            track,
            en_default_out_value,
            set_pos_up_rate_lim: rates[0],
            set_pos_down_rate_lim: rates[1],
            set_neg_up_rate_lim: rates[2],
            set_neg_down_rate_lim: rates[3],
            ..Inputs::default()
        })
}

fn manual(value: f64) -> Inputs {
    Inputs { man_op: true, manual_value: value, ..Inputs::default() }
}

proptest! {
    /// "As soon as the value range between the low and high limits is reached, the high and low
    /// limits are reactivated."
    #[test]
    fn an_output_that_was_within_the_limits_leaves_them_in_manual_mode_only(
        limits in limits(),
        sequence in arbitrary::sequence(arbitrary::advanced()),
    ) {
        let mut state = State::default();
        // Nothing was manual yet, so the limits are active from the start.
        let mut reached = true;
        let mut last = 0.0;
        for inputs in sequence.into_iter().map(|inputs| limits.set(inputs)) {
            let outputs = step(&mut state, &inputs);
            let y = outputs.output_value;
            if inputs.man_op && !inputs.reset {
                reached = false;
            } else if reached && is_limited(&inputs) {
                let holds = outputs.error && y.to_bits() == f64::to_bits(last);
                prop_assert!(limits.hold(y) || holds, "{y} outside {limits:?} after {last}");
            }
            // The plain 0.0 of a block without rates may lie outside and is not limited.
            reached &= limits.hold(y) || is_limited(&inputs) || inputs.reset;
            // A restart activates them, unless its default is one that no output can have.
            let restarts = inputs.reset
                && (inputs.default_out_value.is_finite() || !inputs.en_default_out_value);
            reached |= restarts || limits.hold(y);
            last = y;
        }
    }

    #[test]
    fn limits_that_change_from_cycle_to_cycle_keep_an_output_that_is_within_the_new_ones(
        sequence in arbitrary::sequence(arbitrary::advanced()),
    ) {
        let (mut state, mut last) = (State::default(), 0.0);
        for inputs in &sequence {
            let y = step(&mut state, inputs).output_value;
            let limits = Limits::of(inputs);
            if limits.are_valid() && limits.hold(last) && is_limited(inputs) {
                prop_assert!(limits.hold(y), "{last} to {y} out of {limits:?}");
            }
            last = y;
        }
    }

    /// "In this operating mode … the high/low limitation … [is] ineffective. When changing from TRUE
    /// to FALSE, the output is ramped again": it does not jump to the limit.
    #[test]
    fn an_output_that_manual_mode_left_beyond_a_limit_is_ramped_until_the_range_is_reached(
        limits in limits(),
        beyond in 0.25..30.0f64,
        above in any::<bool>(),
        sequence in prop::collection::vec(working(), 1..20),
    ) {
        let by_hand = if above { limits.high + beyond } else { limits.low - beyond };
        prop_assume!(by_hand.is_finite() && !limits.hold(by_hand));
        let mut free = State::default();
        let mut limited = State::default();
        step(&mut free, &manual(by_hand));
        step(&mut limited, &manual(by_hand));
        let no_limits = Limits { low: f64::NEG_INFINITY, high: f64::INFINITY };
        for inputs in sequence {
            let expected = step(&mut free, &no_limits.set(inputs)).output_value;
            let y = step(&mut limited, &limits.set(inputs)).output_value;
            if limits.hold(expected) || (expected > limits.high) != above {
                prop_assert!(limits.hold(y), "{expected} reaches {limits:?}, {y} does not");
                break;
            }
            prop_assert_eq!(y.to_bits(), expected.to_bits());
        }
    }

    #[test]
    fn a_hand_back_from_manual_mode_within_or_at_a_limit_never_moves_beyond_it(
        limits in limits(),
        place in prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0],
        sequence in prop::collection::vec(working(), 1..20),
    ) {
        let by_hand = match place {
            0.0 => limits.low,
            1.0 => limits.high,
            _ => (limits.low + place * (limits.high - limits.low)).clamp(limits.low, limits.high),
        };
        prop_assume!(by_hand.is_finite());
        let mut state = State::default();
        prop_assert_eq!(step(&mut state, &manual(by_hand)).output_value, by_hand);
        for inputs in sequence {
            let y = step(&mut state, &limits.set(inputs)).output_value;
            prop_assert!(limits.hold(y), "{by_hand} by hand, then {y} out of {limits:?}");
        }
    }

    /// "High limit reached", "low limit reached".
    #[test]
    fn a_limit_flag_is_true_if_and_only_if_the_output_is_at_or_beyond_its_limit(
        sequence in arbitrary::sequence(arbitrary::advanced()),
    ) {
        let (mut state, mut last) = (State::default(), 0.0);
        for inputs in &sequence {
            let outputs = step(&mut state, inputs);
            let (y, limits) = (outputs.output_value, Limits::of(inputs));
            let flags = (outputs.high_lim, outputs.low_lim);
            if inputs.reset || !is_limited(inputs) || !limits.are_valid() {
                prop_assert_eq!(flags, (false, false));
            } else if inputs.en_default_out_value || inputs.track {
                let preset = inputs.en_default_out_value;
                let value = if preset { inputs.default_out_value } else { inputs.auto_value };
                let reached = (value >= limits.high, value <= limits.low);
                prop_assert_eq!(flags, if value.is_finite() { reached } else { (false, false) });
            } else if outputs.error {
                prop_assert_eq!(y.to_bits(), f64::to_bits(last));
                prop_assert_eq!(flags, (false, false));
            } else if limits.low < limits.high {
                prop_assert_eq!(flags, (y >= limits.high, y <= limits.low), "{} {:?}", y, limits);
            } else {
                // One value is both limits: it depends on the side from which it is reached.
                prop_assert!(flags.0 || flags.1);
            }
            last = y;
        }
    }

    /// "If enDefaultOutValue = TRUE is set, defaultOutValue is output": as in preset, within limits.
    #[test]
    fn a_restart_limits_its_default_as_the_preset_does_and_sets_no_flag(
        before in arbitrary::sequence(arbitrary::advanced()),
        limits in limits(),
        value in arbitrary::halves(),
    ) {
        let mut state = State::default();
        for inputs in &before {
            step(&mut state, inputs);
        }
        let preset = limits.set(Inputs {
            en_default_out_value: true,
            default_out_value: value,
            ..Inputs::default()
        });
        let restart = step(&mut state, &Inputs { reset: true, ..preset });
        let expected = step(&mut State::default(), &preset).output_value;
        prop_assert_eq!(restart.output_value.to_bits(), expected.to_bits());
        let flags = Outputs { output_value: expected, ..Outputs::default() };
        prop_assert_eq!(restart, flags);
    }
}
