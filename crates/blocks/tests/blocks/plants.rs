//! The plants, case by case. Their step responses are in `step_responses.rs`.

use isochrone_blocks::plants::integrator::{self, PlantIntegrator};
use isochrone_blocks::plants::pt1::{self, PlantPT1};
use isochrone_blocks::plants::pt2::{self, PlantPT2};
use isochrone_blocks::{Block, Cycle, status};

const PERIOD_NS: u64 = 10_000_000;

fn at(cycle: u64) -> Cycle<'static> {
    Cycle::new(cycle, PERIOD_NS, &[])
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

#[test]
fn a_plant_starts_at_its_initial_value_and_again_at_reset() {
    let mut state = pt1::State::default();
    let inputs = pt1::Inputs { u: 5.0, initial_value: 2.0, ..Default::default() };
    assert_eq!(PlantPT1::step(&mut state, &inputs, &at(0)).y, 2.0);
    assert!(PlantPT1::step(&mut state, &inputs, &at(1)).y > 2.0);
    let again = pt1::Inputs { reset: true, ..inputs };
    assert_eq!(PlantPT1::step(&mut state, &again, &at(2)).y, 2.0);

    let mut state = pt2::State::default();
    let inputs = pt2::Inputs { u: 5.0, initial_value: 2.0, ..Default::default() };
    assert_eq!(PlantPT2::step(&mut state, &inputs, &at(0)).y, 2.0);
    for cycle in 1..100 {
        PlantPT2::step(&mut state, &inputs, &at(cycle));
    }
    PlantPT2::step(&mut state, &pt2::Inputs { reset: true, ..inputs }, &at(100));
    let at_rest = pt2::Inputs { u: 2.0, ..inputs };
    assert_eq!(PlantPT2::step(&mut state, &at_rest, &at(101)).y, 2.0);
}

#[test]
fn skipped_cycles_count_as_the_time_that_they_take() {
    let one = pt1::Inputs { u: 3.0, time_constant: 0.2, ..Default::default() };
    let two = pt2::Inputs { u: 3.0, time_constant: 0.2, damping: 0.3, ..Default::default() };
    let tank = integrator::Inputs { u: 3.0, ..Default::default() };
    let run = |cycles: &[u64]| {
        let (mut a, mut b, mut c) = Default::default();
        let steps = cycles.iter().map(|&cycle| {
            let y1 = PlantPT1::step(&mut a, &one, &at(cycle)).y;
            let y2 = PlantPT2::step(&mut b, &two, &at(cycle)).y;
            [y1, y2, PlantIntegrator::step(&mut c, &tank, &at(cycle)).y]
        });
        steps.last().unwrap()
    };
    let (all, some) = (run(&[0, 1, 2, 3, 4, 5, 6, 7]), run(&[0, 2, 3, 7]));
    for (all, some) in all.iter().zip(some) {
        assert!(near(*all, some), "{all} {some}");
    }
}

#[test]
fn a_time_constant_of_0_is_no_lag() {
    let mut state = pt1::State::default();
    let inputs = pt1::Inputs { u: 3.0, gain: 2.0, time_constant: 0.0, ..Default::default() };
    PlantPT1::step(&mut state, &inputs, &at(0));
    assert_eq!(PlantPT1::step(&mut state, &inputs, &at(1)).y, 6.0);
    for damping in [0.0, 0.5, 1.0, 2.0] {
        let mut state = pt2::State::default();
        let inputs =
            pt2::Inputs { u: 3.0, gain: 2.0, time_constant: 0.0, damping, ..Default::default() };
        PlantPT2::step(&mut state, &inputs, &at(0));
        assert_eq!(PlantPT2::step(&mut state, &inputs, &at(1)).y, 6.0);
    }
}

#[test]
fn a_pt2_with_two_time_constants_is_two_lags_in_series() {
    // The lags T1 = 3 s and T2 = 0.5 s answer a step with 1 - (T1*exp(-t/T1) - T2*exp(-t/T2)) / (T1 - T2).
    let (t1, t2) = (3.0f64, 0.5f64);
    let time_constant = (t1 * t2).sqrt();
    let damping = (t1 + t2) / (2.0 * time_constant);
    let inputs = pt2::Inputs { u: 1.0, time_constant, damping, ..Default::default() };
    let mut state = pt2::State::default();
    for cycle in 0..1_000 {
        let y = PlantPT2::step(&mut state, &inputs, &at(cycle)).y;
        let t = cycle as f64 * 0.01;
        let exact = 1.0 - (t1 * (-t / t1).exp() - t2 * (-t / t2).exp()) / (t1 - t2);
        assert!((y - exact).abs() < 1e-11, "{t}: {y} {exact}");
    }
}

#[test]
fn an_undamped_pt2_neither_grows_nor_dies_in_a_million_cycles() {
    let inputs = pt2::Inputs { u: 1.0, damping: 0.0, ..Default::default() };
    let mut state = pt2::State::default();
    let mut last = f64::NAN;
    for cycle in 0..=1_000_000 {
        last = PlantPT2::step(&mut state, &inputs, &at(cycle)).y;
    }
    let exact = 1.0 - 1e4f64.cos();
    assert!((last - exact).abs() < 1e-7, "{last} {exact}");
}

#[test]
fn a_change_of_the_time_constant_keeps_value_and_rate() {
    let inputs = pt2::Inputs { u: 1.0, time_constant: 1.0, damping: 0.2, ..Default::default() };
    let mut state = pt2::State::default();
    let mut ys: Vec<f64> =
        (0..100).map(|cycle| PlantPT2::step(&mut state, &inputs, &at(cycle)).y).collect();
    let slower = pt2::Inputs { time_constant: 1.1, ..inputs };
    ys.extend((100..103).map(|cycle| PlantPT2::step(&mut state, &slower, &at(cycle)).y));
    let rates: Vec<f64> = ys.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!((rates[99] - rates[98]).abs() < 0.02 * rates[98], "{:?}", &rates[96..]);
}

#[test]
fn a_tank_fills_by_inflow_less_outflow_and_stays_within_its_limits() {
    let tank = integrator::Inputs {
        u: 0.3,
        load: 0.1,
        gain: 0.5,
        y_min: 0.0,
        y_max: 2.0,
        initial_value: 1.0,
        ..Default::default()
    };
    let mut state = integrator::State::default();
    let mut step = |inputs, cycle| PlantIntegrator::step(&mut state, &inputs, &at(cycle));
    assert_eq!(step(tank, 0).y, 1.0);
    // 0.1 1/s for a second.
    let after = (1..=100).map(|cycle| step(tank, cycle).y).last().unwrap();
    assert!(near(after, 1.1), "{after}");
    let full = step(tank, 10_000);
    assert_eq!((full.y, full.status, full.error), (2.0, status::LIMITED_HIGH, false));
    let falls = step(integrator::Inputs { u: 0.0, ..tank }, 10_001);
    assert!(falls.y < 2.0 && falls.status == status::OK, "the overflow is gone");
    let empty = step(integrator::Inputs { u: 0.0, ..tank }, 20_000);
    assert_eq!((empty.y, empty.status), (0.0, status::LIMITED_LOW));
}

#[test]
fn an_integrator_loses_nothing_to_rounding() {
    // Each step is too small to change a y of 1e6 by itself as it should.
    let inputs =
        integrator::Inputs { u: 1.0, gain: 1e-9, initial_value: 1e6, ..Default::default() };
    let mut state = integrator::State::default();
    let mut y = 0.0;
    for cycle in 0..=10_000_000 {
        y = PlantIntegrator::step(&mut state, &inputs, &at(cycle)).y;
    }
    assert!((y - 1e6 - 1e-4).abs() < 2e-10, "{}", y - 1e6);
}

#[test]
fn bad_inputs_hold_the_output_and_are_told() {
    let good = pt1::Inputs { u: 1.0, initial_value: 0.5, ..Default::default() };
    for (bad, status) in [
        (pt1::Inputs { time_constant: -1.0, ..good }, status::TIME),
        (pt1::Inputs { time_constant: f64::NAN, ..good }, status::NOT_FINITE),
        (pt1::Inputs { time_constant: f64::INFINITY, ..good }, status::NOT_FINITE),
        (pt1::Inputs { u: f64::NAN, ..good }, status::NOT_FINITE),
        (pt1::Inputs { gain: 1e200, u: 1e200, ..good }, status::NOT_FINITE),
        (pt1::Inputs { reset: true, initial_value: f64::NAN, ..good }, status::NOT_FINITE),
    ] {
        let mut state = pt1::State::default();
        PlantPT1::step(&mut state, &good, &at(0));
        let outputs = PlantPT1::step(&mut state, &bad, &at(1));
        assert_eq!((outputs.y, outputs.status, outputs.error), (0.5, status, true), "{bad:?}");
        assert_eq!(PlantPT1::step(&mut state, &good, &at(2)).status, status::OK);
    }
    let good = pt2::Inputs { u: 1.0, initial_value: 0.5, ..Default::default() };
    for (bad, status) in [
        (pt2::Inputs { time_constant: -1.0, ..good }, status::TIME),
        (pt2::Inputs { damping: -0.1, ..good }, status::TIME),
        (pt2::Inputs { damping: f64::INFINITY, ..good }, status::NOT_FINITE),
        (pt2::Inputs { gain: f64::NAN, ..good }, status::NOT_FINITE),
    ] {
        let mut state = pt2::State::default();
        PlantPT2::step(&mut state, &good, &at(0));
        let outputs = PlantPT2::step(&mut state, &bad, &at(1));
        assert_eq!((outputs.y, outputs.status, outputs.error), (0.5, status, true), "{bad:?}");
        assert_eq!(PlantPT2::step(&mut state, &good, &at(2)).status, status::OK);
    }
    let good = integrator::Inputs { u: 1.0, initial_value: 0.5, ..Default::default() };
    for (bad, status) in [
        (integrator::Inputs { y_min: 1.0, y_max: 0.0, ..good }, status::RANGE),
        (integrator::Inputs { y_max: f64::NAN, ..good }, status::NOT_FINITE),
        (integrator::Inputs { y_max: f64::NEG_INFINITY, ..good }, status::NOT_FINITE),
        (integrator::Inputs { load: f64::INFINITY, ..good }, status::NOT_FINITE),
    ] {
        let mut state = integrator::State::default();
        PlantIntegrator::step(&mut state, &good, &at(0));
        let outputs = PlantIntegrator::step(&mut state, &bad, &at(1));
        assert_eq!((outputs.y, outputs.status, outputs.error), (0.5, status, true), "{bad:?}");
        assert_eq!(PlantIntegrator::step(&mut state, &good, &at(2)).status, status::OK);
    }
}
