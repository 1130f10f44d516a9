//! Step responses of the plants, and of loops of PID and a plant, against the solutions that
//! `tests/oracles/step_responses.py` found from the differential equations.

use isochrone_blocks::pid::{self, PID};
use isochrone_blocks::plants::pt1::{self, PlantPT1};
use isochrone_blocks::plants::pt2::{self, PlantPT2};
use isochrone_blocks::{Block, Cycle};

const ANSWERS: &str = include_str!("../oracles/step_responses.csv");
/// How far a block may be from the solution with a zero-order hold.
const EXACT: f64 = 1e-9;
/// How far a loop of 1 ms may be from the continuous one, in heights of the step.
const CONTINUOUS: f64 = 0.005;
const MS: u64 = 1_000_000;

/// Cycle, solution with a zero-order hold, continuous solution.
fn answers(name: &str) -> Vec<(u64, f64, f64)> {
    let rows = ANSWERS.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let rows = rows.filter(|row| row[0] == name);
    let rows: Vec<_> = rows
        .map(|row| (row[1].parse().unwrap(), row[2].parse().unwrap(), row[3].parse().unwrap()))
        .collect();
    assert!(rows.len() >= 40, "{name}");
    rows
}

/// Steps a simulation, which is given the cycle and answers `y`, and compares it with the solution.
fn assert_answers(name: &str, mut y: impl FnMut(u64) -> f64) {
    let answers = answers(name);
    let ys: Vec<f64> = (0..=answers.last().unwrap().0).map(&mut y).collect();
    for (cycle, sampled, continuous) in answers {
        let y = ys[cycle as usize];
        assert!((y - sampled).abs() < EXACT, "{name}, cycle {cycle}: {y}, not {sampled}");
        let from_continuous = (y - continuous).abs();
        assert!(from_continuous < CONTINUOUS, "{name}, cycle {cycle}: {y}, not {continuous}");
    }
}

#[test]
fn a_pt1_is_the_solution_of_its_equation() {
    let inputs = pt1::Inputs { u: 1.0, gain: 2.5, ..Default::default() };
    let mut plant = pt1::State::default();
    assert_answers("pt1", |cycle| {
        PlantPT1::step(&mut plant, &inputs, &Cycle::new(cycle, 100 * MS, &[])).y
    });
}

#[test]
fn a_pt2_is_the_solution_of_its_equation_at_every_damping() {
    for (name, damping) in [("pt2_oscillating", 0.2), ("pt2_critical", 1.0), ("pt2_slow", 3.0)] {
        let inputs = pt2::Inputs { u: 1.0, gain: 2.5, damping, ..Default::default() };
        let mut plant = pt2::State::default();
        assert_answers(name, |cycle| {
            PlantPT2::step(&mut plant, &inputs, &Cycle::new(cycle, 100 * MS, &[])).y
        });
    }
}

/// A controller without limits whose set-point steps to 1.
fn controller(gain: f64, integral_time: f64, derivative_time: f64, b: f64) -> pid::Inputs {
    pid::Inputs {
        set_point: 1.0,
        gain,
        integral_time,
        derivative_time,
        b,
        output_min: f64::NEG_INFINITY,
        output_max: f64::INFINITY,
        ..Default::default()
    }
}

/// A loop in which the plant gets the output of the cycle before, as `@prev` gives it.
fn assert_loop(name: &str, controller: pid::Inputs, mut plant: impl FnMut(f64, &Cycle<'_>) -> f64) {
    let (mut state, mut u) = (pid::State::default(), 0.0);
    assert_answers(name, |cycle| {
        let cycle = Cycle::new(cycle, MS, &[]);
        let process_value = plant(u, &cycle);
        let outputs = PID::step(&mut state, &pid::Inputs { process_value, ..controller }, &cycle);
        assert_eq!(outputs.status, 0);
        u = outputs.output;
        process_value
    });
}

#[test]
fn a_loop_with_a_pt1_is_the_solution_of_its_equations() {
    let mut plant = pt1::State::default();
    assert_loop("pi_pt1", controller(2.0, 1.0, 0.0, 1.0), |u, cycle| {
        PlantPT1::step(&mut plant, &pt1::Inputs { u, ..Default::default() }, cycle).y
    });
}

#[test]
fn loops_with_a_pt2_are_the_solutions_of_their_equations() {
    for (name, controller, (gain, time_constant, damping)) in [
        ("pi_weighted_pt2", controller(0.8, 1.2, 0.0, 0.5), (1.0, 1.0, 0.7)),
        ("pid_pt2", controller(4.0, 1.6, 0.4, 1.0), (1.0, 1.0, 1.0)),
        ("pid_pt2_oscillating", controller(4.0, 3.0, 0.8, 0.6), (0.5, 2.0, 0.4)),
    ] {
        let mut plant = pt2::State::default();
        assert_loop(name, controller, |u, cycle| {
            let inputs = pt2::Inputs { u, gain, time_constant, damping, ..Default::default() };
            PlantPT2::step(&mut plant, &inputs, cycle).y
        });
    }
}
