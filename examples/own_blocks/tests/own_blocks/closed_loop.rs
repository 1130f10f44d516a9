//! The PID block in a closed loop, stepped without a node.

use crate::pid::{Inputs, Outputs, Pid, State};
use isochrone::blocks::{Block, Cycle, status};

const PERIOD_NS: u64 = 10_000_000;

/// The valve of `pid.toml`: gain 40, integral time 2 s, 0 to 100 %.
const VALVE: Inputs = Inputs {
    setpoint: 1.0,
    x: 0.0,
    gain: 40.0,
    integral_time: 2.0,
    derivative_time: 0.0,
    y_min: 0.0,
    y_max: 100.0,
};

/// A controller and its cycles.
#[derive(Default)]
struct Controller {
    state: State,
    cycles: u64,
}

impl Controller {
    fn step(&mut self, inputs: Inputs) -> Outputs {
        let cycle = Cycle::new(self.cycles, PERIOD_NS, &[]);
        self.cycles += 1;
        Pid::step(&mut self.state, &inputs, &cycle)
    }

    /// Fills a tank that loses half of what it holds in a second, until nothing moves: the level and
    /// the last outputs.
    fn settle(&mut self, mut level: f64, inputs: Inputs) -> (f64, Outputs) {
        let mut outputs = Outputs::default();
        for _ in 0..20_000 {
            outputs = self.step(Inputs { x: level, ..inputs });
            level += (outputs.y / 100.0 - 0.5 * level) * 0.01;
        }
        (level, outputs)
    }
}

#[test]
fn the_level_comes_to_its_set_point_and_stays() {
    let (level, outputs) = Controller::default().settle(0.0, VALVE);
    assert!((level - 1.0).abs() < 1e-9, "{level}");
    assert!((outputs.y - 50.0).abs() < 1e-6 && outputs.status == status::OK, "{outputs:?}");
}

#[test]
fn a_gain_that_changes_at_the_set_point_does_not_move_the_valve() {
    for gain in [80.0, 20.0, 4.0] {
        let mut controller = Controller::default();
        let (level, before) = controller.settle(0.0, VALVE);
        let after = controller.step(Inputs { x: level, gain, ..VALVE });
        assert!((after.y - before.y).abs() < 1e-6, "gain {gain}: {before:?}, then {after:?}");
        let (level, later) = controller.settle(level, Inputs { gain, ..VALVE });
        assert!((level - 1.0).abs() < 1e-9 && later.status == status::OK, "{level}, {later:?}");
    }
}

#[test]
fn a_valve_at_its_limit_leaves_it_as_soon_as_the_deviation_turns() {
    for (x, limit, word) in [(-9.0, 100.0, status::LIMITED_HIGH), (9.0, 0.0, status::LIMITED_LOW)] {
        let mut controller = Controller::default();
        let (level, _) = controller.settle(0.0, VALVE);
        for _ in 0..100_000 {
            let limited = controller.step(Inputs { x, ..VALVE });
            assert_eq!((limited.y, limited.status), (limit, word));
        }
        let free = controller.step(Inputs { x: level, ..VALVE });
        assert!((free.y - 50.0).abs() < 1.0 && free.status == status::OK, "{free:?}");
    }
}

#[test]
fn an_integral_beyond_a_limit_runs_back_to_it() {
    let mut controller = Controller::default();
    let (level, _) = controller.settle(0.0, VALVE);
    // The limit is now below the 50 % that hold the level, so the integral stands beyond it.
    let narrow = Inputs { y_max: 40.0, ..VALVE };
    let held = controller.step(Inputs { x: level, ..narrow });
    assert_eq!((held.y, held.status), (40.0, status::LIMITED_HIGH));
    // A tenth above its set-point: 4 % by the gain, and 2 % less in every second.
    let above = Inputs { x: 1.1, ..narrow };
    let free = (1..=500).find(|_| controller.step(above).status == status::OK);
    assert!(free.is_some_and(|cycles| (250..=350).contains(&cycles)), "{free:?}");
}

#[test]
fn a_value_that_is_no_number_is_an_error_and_the_valve_holds() {
    let nan = f64::NAN;
    let mut controller = Controller::default();
    let (level, before) = controller.settle(0.0, VALVE);
    let inputs = Inputs { x: level, ..VALVE };
    for (wrong, word) in [
        (Inputs { gain: nan, ..inputs }, status::NOT_FINITE),
        (Inputs { gain: f64::INFINITY, ..inputs }, status::NOT_FINITE),
        (Inputs { x: nan, ..inputs }, status::NOT_FINITE),
        (Inputs { setpoint: f64::INFINITY, ..inputs }, status::NOT_FINITE),
        (Inputs { derivative_time: f64::INFINITY, ..inputs }, status::NOT_FINITE),
        (Inputs { integral_time: nan, ..inputs }, status::RANGE),
        (Inputs { y_min: nan, ..inputs }, status::RANGE),
        (Inputs { y_max: -1.0, ..inputs }, status::RANGE),
    ] {
        let held = controller.step(wrong);
        assert_eq!((held.y, held.error, held.status), (before.y, true, word), "{wrong:?}");
        let again = controller.step(inputs);
        assert!((again.y - before.y).abs() < 1e-6 && !again.error, "{wrong:?}: {again:?}");
    }
}
