//! Signals, filters and the dead time: what a golden case cannot say.

use isochrone_blocks::lgf::difference_quotient::{self, DifferenceQuotientFB};
use isochrone_blocks::lgf::floating_average::{self, FloatingAverage};
use isochrone_blocks::lgf::hysteresis::{self, Hysteresis};
use isochrone_blocks::lgf::integration::{self, Integration};
use isochrone_blocks::lgf::low_pass::{self, LowPassCI};
use isochrone_blocks::lgf::non_linear_interpolation::{self, NonLinearInterpolation};
use isochrone_blocks::lgf::sinus::{self, SinusCI};
use isochrone_blocks::lgf::triangle::{self, TriangleCI};
use isochrone_blocks::plants::dead_time::{self, DeadTime};
use isochrone_blocks::{Block, Cycle, Declaration, status};
use proptest::prelude::*;

const MS: u64 = 1_000_000;

/// An instance of a block with a buffer.
struct Buffered<B: Block> {
    state: B::State,
    buffer: Vec<u64>,
}

impl<B: Block> Buffered<B> {
    fn new() -> Self {
        Self { state: B::State::default(), buffer: vec![0; <B as Declaration>::BUFFER] }
    }

    fn step(&mut self, inputs: &B::Inputs, cycle: u64, period_ns: u64) -> B::Outputs {
        let cycle = Cycle::new(cycle, period_ns, &[]);
        B::step_buffered(&mut self.state, &mut self.buffer, inputs, &cycle)
    }
}

/// Any number that a plant measures.
fn measured() -> impl Strategy<Value = f64> {
    prop_oneof![4 => -1e6..1e6f64, 1 => -1e-6..1e-6f64, 1 => -1e30..1e30f64]
}

#[test]
fn the_functions_of_libm_are_within_a_unit_in_the_last_place_of_the_exact_results() {
    let cases = include_str!("../libm/exact.txt");
    assert_eq!(cases.lines().count(), 200);
    for line in cases.lines() {
        let mut parts = line.split(' ');
        let name = parts.next().unwrap();
        let mut bits = || u64::from_str_radix(parts.next().unwrap(), 16).unwrap();
        let (argument, exact) = (f64::from_bits(bits()), bits());
        let found = match name {
            "exp" => libm::exp(argument),
            "sin" => libm::sin(argument),
            _ => libm::cos(argument),
        };
        assert!(found.to_bits().abs_diff(exact) <= 1, "{name}({argument:?}) is {found:?}");
    }
}

#[test]
fn a_sine_is_the_same_after_1e12_cycles_as_in_the_first_period() {
    // 700 ms are no multiple of 3 ms: the place in the period is another in each of 700 cycles.
    let inputs = sinus::Inputs { amplitude: 3.0, offset: 1.0, period: 700, ..Default::default() };
    let value = |state: &mut sinus::State, cycle| {
        SinusCI::step(state, &inputs, &Cycle::new(cycle, 3 * MS, &[])).value
    };
    let (mut early, mut late) = (sinus::State::default(), sinus::State::default());
    value(&mut late, 0);
    let periods = 1_000_000_000_000 / 700 * 700;
    for cycle in 0..1400 {
        let (early, late) = (value(&mut early, cycle), value(&mut late, periods + cycle));
        assert_eq!(early.to_bits(), late.to_bits(), "cycle {cycle}");
    }
}

#[test]
fn a_sine_of_584_years_between_two_calls_is_where_it_should_be() {
    let inputs = sinus::Inputs { period: 1000, ..Default::default() };
    let mut state = sinus::State::default();
    let hour = 3_600_000 * MS;
    for (cycle, value) in [(0, 0.0), (u64::MAX - 1, 0.0), (u64::MAX, 0.0), (u64::MAX, 0.0)] {
        let outputs = SinusCI::step(&mut state, &inputs, &Cycle::new(cycle, hour, &[]));
        assert_eq!((outputs.value, outputs.status), (value, status::OK));
    }
}

#[test]
fn a_sine_meets_its_crest_its_trough_and_its_axis_exactly() {
    let mut state = sinus::State::default();
    let inputs = sinus::Inputs { amplitude: 0.7, offset: 0.1, period: 4, ..Default::default() };
    for (cycle, expected) in [0.1, 0.1 + 0.7, 0.1, 0.1 - 0.7, 0.1].into_iter().enumerate() {
        let cycle = Cycle::new(cycle as u64, MS, &[]);
        assert_eq!(SinusCI::step(&mut state, &inputs, &cycle).value, expected);
    }
}

#[test]
fn a_step_through_a_low_pass_is_the_exponential_function_at_any_sample_time() {
    for (period_ms, time_constant) in [(1, 1.0), (100, 0.5), (1000, 0.25), (10, 3600.0)] {
        let mut state = low_pass::State::default();
        let mut inputs = low_pass::Inputs { time_constant, ..Default::default() };
        for calls in 0..=1000 {
            inputs.value = if calls == 0 { 0.0 } else { 1.0 };
            let cycle = Cycle::new(calls, period_ms * MS, &[]);
            let found = LowPassCI::step(&mut state, &inputs, &cycle).filtered_value;
            let t = calls as f64 * period_ms as f64 / 1e3;
            let exact = -libm::expm1(-t / time_constant);
            assert!((found - exact).abs() < 1e-9, "{found} not {exact} after {t} s");
        }
    }
}

#[test]
fn a_low_pass_that_is_slow_has_all_digits_of_its_small_steps() {
    for (period_ns, time_constant) in [(7_000, 100.0), (1_000_000, 1e6), (100_000_000, 1e4)] {
        let mut state = low_pass::State::default();
        let mut inputs = low_pass::Inputs { time_constant, ..Default::default() };
        LowPassCI::step(&mut state, &inputs, &Cycle::new(0, period_ns, &[]));
        inputs.value = 1.0;
        let found = LowPassCI::step(&mut state, &inputs, &Cycle::new(1, period_ns, &[]));
        // The power series of 1 - exp(-x).
        let x = period_ns as f64 / 1e9 / time_constant;
        let exact = x - x * x / 2.0 + x * x * x / 6.0;
        assert!((found.filtered_value / exact - 1.0).abs() < 1e-15, "{found:?}, not {exact}");
    }
}

#[test]
fn an_integral_of_small_areas_loses_nothing() {
    let (mut state, mut plain) = (integration::State::default(), 0.0f64);
    let inputs = integration::Inputs { enable: true, value: 1.0, reset: false };
    let calls = 2_000_000;
    let mut integral = 0.0;
    for cycle in 0..=calls {
        integral = Integration::step(&mut state, &inputs, &Cycle::new(cycle, MS, &[])).integral;
        plain += if cycle == 0 { 0.0 } else { 0.001 };
    }
    assert_eq!(integral, 2000.0);
    assert_ne!(plain, 2000.0, "a plain sum would do");
}

#[test]
fn cycles_that_were_skipped_are_part_of_an_integral() {
    let mut state = integration::State::default();
    let inputs = integration::Inputs { enable: true, value: 2.0, reset: false };
    let mut integral = |cycle: u64| {
        Integration::step(&mut state, &inputs, &Cycle::new(cycle, 500 * MS, &[])).integral
    };
    assert_eq!([integral(7), integral(8), integral(18)], [0.0, 1.0, 11.0]);
}

#[test]
fn a_parabola_is_differentiated_exactly_two_values_ago() {
    let mut state = difference_quotient::State::default();
    for cycle in 0..20u64 {
        let t = cycle as f64 * 0.5;
        let inputs = difference_quotient::Inputs {
            enable: true,
            value: 3.0 * t * t - t,
            cyclic_execution: true,
            ..Default::default()
        };
        let outputs =
            DifferenceQuotientFB::step(&mut state, &inputs, &Cycle::new(cycle, 500 * MS, &[]));
        if cycle >= 4 {
            assert_eq!(outputs.derivated_value, 6.0 * (t - 1.0) - 1.0);
        }
    }
}

#[test]
fn a_change_of_the_window_forgets_the_values_and_holds_the_average() {
    let mut average = Buffered::<FloatingAverage>::new();
    let mut inputs =
        floating_average::Inputs { cyclic_execution: true, window_size: 3, ..Default::default() };
    for value in [1.0, 2.0, 6.0] {
        inputs.value = value;
        average.step(&inputs, 0, MS);
    }
    (inputs.cyclic_execution, inputs.window_size) = (false, 2);
    let held = average.step(&inputs, 0, MS);
    assert_eq!((held.average, held.window_size_reached), (3.0, false));
    (inputs.cyclic_execution, inputs.value) = (true, 8.0);
    assert_eq!(average.step(&inputs, 0, MS).average, 8.0);
    assert!(average.step(&inputs, 0, MS).window_size_reached);
}

#[test]
fn a_block_whose_buffer_is_missing_says_so_or_passes_its_signal_on() {
    let cycle = Cycle::new(0, MS, &[]);
    let inputs = floating_average::Inputs { window_size: 1, ..Default::default() };
    let average = FloatingAverage::step(&mut Default::default(), &inputs, &cycle);
    assert_eq!(average.status, status::RANGE);
    let inputs = dead_time::Inputs { u: 3.0, dead_time: 0.0 };
    assert_eq!(DeadTime::step(&mut Default::default(), &inputs, &cycle).y, 3.0);
}

#[test]
fn a_dead_time_repeats_the_last_sample_for_cycles_that_were_skipped() {
    let mut line = Buffered::<DeadTime>::new();
    let mut y = |u, cycle| line.step(&dead_time::Inputs { u, dead_time: 0.003 }, cycle, MS).y;
    assert_eq!([y(1.0, 10), y(2.0, 11), y(3.0, 15), y(4.0, 16)], [1.0, 1.0, 2.0, 2.0]);
    assert_eq!([y(5.0, 18), y(6.0, 5000), y(7.0, 5003)], [3.0, 5.0, 6.0]);
}

#[test]
fn a_dead_time_that_is_no_number_of_periods_or_too_long_is_reported() {
    let mut line = Buffered::<DeadTime>::new();
    for (dead_time, expected) in [
        (1.023, status::OK),
        (1.0234, status::LIMITED_HIGH),
        (1e300, status::LIMITED_HIGH),
        (0.0004, status::ROUNDED),
        (0.0, status::OK),
        (-1e-12, status::TIME),
        (f64::INFINITY, status::NOT_FINITE),
    ] {
        let outputs = line.step(&dead_time::Inputs { u: 1.0, dead_time }, 0, MS);
        assert_eq!(outputs.status, expected, "{dead_time}");
    }
}

proptest! {
    #[test]
    fn the_average_of_a_constant_is_the_constant(
        value in measured(), window_size in 1i16..=100, before in measured(), calls in 1u64..300,
    ) {
        let mut average = Buffered::<FloatingAverage>::new();
        let mut inputs =
            floating_average::Inputs { cyclic_execution: true, window_size, value: before, ..Default::default() };
        for cycle in 0..calls {
            average.step(&inputs, cycle, MS);
        }
        inputs.value = value;
        let window = usize::from(window_size.unsigned_abs());
        // A window later, nothing of the other value is left; two, and no rounding of it either.
        let averages: Vec<f64> = (0..3 * window).map(|_| average.step(&inputs, 0, MS).average).collect();
        prop_assert!(averages[2 * window..].iter().all(|average| *average == value));
    }

    #[test]
    fn an_average_is_between_the_least_and_the_greatest_value_of_the_window(
        values in prop::collection::vec(-1e6..1e6f64, 1..200), window_size in 1i16..=100,
    ) {
        let mut average = Buffered::<FloatingAverage>::new();
        let window: usize = window_size.unsigned_abs().into();
        for end in 1..=values.len() {
            let value = values[end - 1];
            let inputs =
                floating_average::Inputs { cyclic_execution: true, window_size, value, ..Default::default() };
            let found = average.step(&inputs, 0, MS).average;
            let within = &values[end.saturating_sub(window)..end];
            let least = within.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = within.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(least <= found && found <= greatest, "{least} {found} {greatest}");
        }
    }

    #[test]
    fn sine_and_triangle_stay_within_their_amplitude(
        amplitude in measured(), offset in measured(), period in 1i32..=i32::MAX,
        phase_shift in -1e6..1e6f64, period_ns in 10_000u64..=3_600_000_000_000, first in 0u64..1 << 60,
        steps in prop::collection::vec(1u64..1 << 40, 20),
    ) {
        let (mut sine, mut triangle) = (sinus::State::default(), triangle::State::default());
        let (a, b) = (offset - amplitude, offset + amplitude);
        let mut index = first;
        for step in steps {
            let cycle = Cycle::new(index, period_ns, &[]);
            let inputs = sinus::Inputs { amplitude, offset, period, phase_shift, ..Default::default() };
            let value = SinusCI::step(&mut sine, &inputs, &cycle).value;
            prop_assert!(a.min(b) <= value && value <= a.max(b));
            let inputs = triangle::Inputs { amplitude, offset, period, phase_shift, ..Default::default() };
            let value = TriangleCI::step(&mut triangle, &inputs, &cycle).value;
            prop_assert!(a.min(b) <= value && value <= a.max(b));
            index += step;
        }
    }

    #[test]
    fn a_hysteresis_never_toggles_within_its_band(
        low in -10.0..0.0f64, high in 0.0..10.0f64,
        values in prop::collection::vec(-20.0..20.0f64, 1..100),
    ) {
        let (mut state, mut before) = (hysteresis::State::default(), false);
        for value in values {
            let inputs = hysteresis::Inputs { value, set_high_lim: high, set_low_lim: low };
            let output = Hysteresis::step(&mut state, &inputs, &Cycle::new(0, MS, &[])).output;
            let is_within = low < value && value < high;
            prop_assert_eq!(output, if is_within { before } else { value >= high });
            before = output;
        }
    }

    #[test]
    fn a_rising_curve_has_rising_values_between_those_of_its_ends(
        heights in prop::array::uniform4(0.0..10.0f64), a in -1.0..4.0f64, b in -1.0..4.0f64,
    ) {
        let [y1, y2, y3, y4] = [0.0; 4].map({
            let (mut sum, mut heights) = (0.0, heights.into_iter());
            move |_: f64| { sum += heights.next().unwrap(); sum }
        });
        let at = |value| {
            let inputs = non_linear_interpolation::Inputs {
                value, number_of_points: 4, x2: 1.0, x3: 2.0, x4: 3.0, y1, y2, y3, y4, ..Default::default()
            };
            NonLinearInterpolation::step(&mut Default::default(), &inputs, &Cycle::new(0, MS, &[])).output_value
        };
        let (low, high) = (at(a.min(b)), at(a.max(b)));
        prop_assert!(low <= high + 1e-12 && y1 <= low && high <= y4 + 1e-12, "{low} {high}");
    }

    #[test]
    fn a_filter_stays_between_its_output_and_its_input(
        values in prop::collection::vec(measured(), 1..100), time_constant in 0.0..100.0f64,
    ) {
        let mut state = low_pass::State::default();
        let mut before = values[0];
        for value in values {
            let inputs = low_pass::Inputs { value, time_constant, ..Default::default() };
            let y = LowPassCI::step(&mut state, &inputs, &Cycle::new(0, 10 * MS, &[])).filtered_value;
            let slack = 1e-15 * before.abs().max(value.abs());
            prop_assert!(before.min(value) - slack <= y && y <= before.max(value) + slack);
            before = y;
        }
    }
}
