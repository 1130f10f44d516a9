//! Inputs that a plant may send on its worst day.

use isochrone_blocks::{
    Ob, lim_rate_of_change, lim_rate_of_change_advanced, saw_tooth, scale_linear,
};
use proptest::prelude::*;

/// OBs of a node: numbers and periods.
pub(crate) const OBS: &[(i16, u64)] = &[(30, 1_000_000), (35, 10_000_000), (123, 333_333)];

/// Any bits, with those that make trouble and those that meet each other more often than not.
pub(crate) fn real() -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => prop::sample::select(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
        1 => prop::num::f64::ANY,
        2 => prop::sample::select(&[
            0.0, -0.0, 5e-324, -5e-324, f64::MIN_POSITIVE, 1e-310, -1e-310, f64::MAX, f64::MIN, 1e308, 0.1,
        ]),
        6 => halves(),
        4 => -20.0..20.0,
    ]
}

/// Values that meet each other more often than not.
pub(crate) fn halves() -> impl Strategy<Value = f64> {
    (-40i8..=40).prop_map(|halves| f64::from(halves) * 0.5)
}

/// Mostly legal rates.
pub(crate) fn rate() -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => real(),
        2 => prop::sample::select(&[0.0, -0.0, f64::INFINITY, 1e-320, f64::MAX]),
        4 => (0u8..=40).prop_map(f64::from),
        4 => 0.0..500.0,
    ]
}

pub(crate) fn seldom() -> impl Strategy<Value = bool> {
    prop::bool::weighted(0.15)
}

pub(crate) fn ob() -> impl Strategy<Value = Ob> {
    prop_oneof![
        6 => Just(Ob::Caller),
        1 => period_ns().prop_map(|period_ns| Ob::Task { period_ns }),
        3 => prop::sample::select(&[30, 35, 123, 31, 39, 0]).prop_map(Ob::Number),
        1 => any::<i16>().prop_map(Ob::Number),
    ]
}

pub(crate) fn period_ns() -> impl Strategy<Value = u64> {
    prop_oneof![
        prop::sample::select(&[10_000, 1_000_000, 100_000_000, 3_600_000_000_000]),
        10_000u64..=3_600_000_000_000,
    ]
}

/// Inputs that stay for a few cycles each.
pub(crate) fn sequence<T: Clone + std::fmt::Debug>(
    inputs: impl Strategy<Value = T>,
) -> impl Strategy<Value = Vec<T>> {
    prop::collection::vec((inputs, 1usize..12), 1..25).prop_map(|runs| {
        runs.into_iter().flat_map(|(inputs, cycles)| std::iter::repeat_n(inputs, cycles)).collect()
    })
}

pub(crate) fn ramp() -> impl Strategy<Value = lim_rate_of_change::Inputs> {
    (real(), rate(), real(), seldom(), ob()).prop_map(
        |(value, set_change_rate, default_out_value, en_default_out_value, call_ob)| {
            lim_rate_of_change::Inputs {
                value,
                set_change_rate,
                default_out_value,
                en_default_out_value,
                call_ob,
            }
        },
    )
}

pub(crate) fn advanced() -> impl Strategy<Value = lim_rate_of_change_advanced::Inputs> {
    let rates =
        prop_oneof![9 => [rate(), rate(), rate(), rate()], 1 => Just([0.0, -0.0, 0.0, 0.0])];
    let limits = prop_oneof![
        3 => (0.0..20.0, -20.0..0.0),
        3 => (halves(), halves()).prop_map(|(a, b)| (f64::max(a, b), f64::min(a, b))),
        2 => (Just(f64::INFINITY), Just(f64::NEG_INFINITY)),
        2 => (real(), real()),
    ];
    let modes = (seldom(), seldom(), seldom(), seldom());
    ([real(), real(), real()], rates, limits, modes, ob()).prop_map(
        |([auto_value, manual_value, default_out_value], rates, (high, low), modes, call_ob)| {
            let [
                set_pos_up_rate_lim,
                set_pos_down_rate_lim,
                set_neg_up_rate_lim,
                set_neg_down_rate_lim,
            ] = rates;
            lim_rate_of_change_advanced::Inputs {
                auto_value,
                manual_value,
                set_pos_up_rate_lim,
                set_pos_down_rate_lim,
                set_neg_up_rate_lim,
                set_neg_down_rate_lim,
                set_high_lim: high,
                set_low_lim: low,
                default_out_value,
                en_default_out_value: modes.0,
                track: modes.1,
                man_op: modes.2,
                reset: modes.3,
                call_ob,
            }
        },
    )
}

pub(crate) fn scale() -> impl Strategy<Value = scale_linear::Inputs> {
    let y_limits = prop_oneof![3 => (-20.0..0.0, 0.0..20.0), 2 => (real(), real())];
    ([real(), real(), real(), real(), real()], y_limits).prop_map(
        |([x, x1, y1, x2, y2], (y_min, y_max))| scale_linear::Inputs {
            x,
            x1,
            y1,
            x2,
            y2,
            y_min,
            y_max,
        },
    )
}

pub(crate) fn saw() -> impl Strategy<Value = saw_tooth::Inputs> {
    let time_range = prop_oneof![-2i32..200, any::<i32>()];
    let number_steps = prop_oneof![-2i16..20, any::<i16>()];
    (any::<i16>(), time_range, any::<i16>(), number_steps, any::<bool>(), seldom()).prop_map(
        |(start_value, time_range, increment_range, number_steps, endless_steps, reset)| {
            saw_tooth::Inputs {
                start_value,
                time_range,
                increment_range,
                number_steps,
                endless_steps,
                reset,
            }
        },
    )
}
