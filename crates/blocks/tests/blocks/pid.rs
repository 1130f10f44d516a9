//! PID, case by case. What holds for random sequences is in `pid_properties.rs`, step responses are in
//! `step_responses.rs`.

use isochrone_blocks::pid::{Inputs, Outputs, PID, State};
use isochrone_blocks::{Block, Cycle, status};

/// A period whose number of seconds is exact.
const PERIOD_NS: u64 = 500_000_000;

/// A controller with its state, one call after the other.
#[derive(Default)]
struct Controller {
    state: State,
    cycle: u64,
}

impl Controller {
    fn step(&mut self, inputs: Inputs) -> Outputs {
        let outputs = PID::step(&mut self.state, &inputs, &Cycle::new(self.cycle, PERIOD_NS, &[]));
        self.cycle += 1;
        outputs
    }

    fn steps(&mut self, inputs: Inputs, cycles: u64) -> Outputs {
        (0..cycles).map(|_| self.step(inputs)).last().unwrap()
    }
}

/// A deviation of 2 at a proportional controller of gain 4 whose output is not limited.
fn p() -> Inputs {
    Inputs {
        set_point: 5.0,
        process_value: 3.0,
        gain: 4.0,
        output_min: -1e9,
        output_max: 1e9,
        ..Inputs::default()
    }
}

fn pi() -> Inputs {
    Inputs { integral_time: 8.0, ..p() }
}

fn pid() -> Inputs {
    Inputs { derivative_time: 2.0, n: 4.0, ..pi() }
}

#[test]
fn the_proportional_part_weighs_the_set_point_with_b() {
    assert_eq!(Controller::default().step(p()).output, 8.0);
    assert_eq!(Controller::default().step(Inputs { b: 0.5, ..p() }).output, -2.0);
    assert_eq!(Controller::default().step(Inputs { b: 0.0, ..p() }).output, -12.0);
}

#[test]
fn the_integral_moves_by_the_deviation_for_the_time_of_a_cycle() {
    let mut controller = Controller::default();
    for cycle in 0..100 {
        let outputs = controller.step(pi());
        // K/Ti * e * h = 0.5.
        assert_eq!(outputs.integral_part, 0.5 * f64::from(cycle));
        assert_eq!(outputs.output, 8.0 + 0.5 * f64::from(cycle));
    }
}

#[test]
fn the_derivative_acts_on_the_process_value_and_dies_with_its_filter() {
    let mut controller = Controller::default();
    let inputs = Inputs { integral_time: 0.0, ..pid() };
    assert_eq!(controller.steps(inputs, 3).derivative_part, 0.0);
    // Tf = Td/N = 0.5 s and h = 0.5 s: -K*Td/(Tf + h) for a change of 1, then half of it, and so on.
    let moved = Inputs { process_value: 4.0, ..inputs };
    let derivative: Vec<f64> = (0..4).map(|_| controller.step(moved).derivative_part).collect();
    assert_eq!(derivative, [-8.0, -4.0, -2.0, -1.0]);
}

#[test]
fn the_derivative_weighs_the_set_point_with_c() {
    for (c, kick) in [(0.0, 0.0), (0.5, 4.0), (1.0, 8.0)] {
        let mut controller = Controller::default();
        let inputs = Inputs { integral_time: 0.0, c, ..pid() };
        controller.step(inputs);
        let outputs = controller.step(Inputs { set_point: 6.0, ..inputs });
        assert_eq!(outputs.derivative_part, kick, "c = {c}");
    }
}

#[test]
fn an_infinite_n_is_no_filter() {
    let mut controller = Controller::default();
    let inputs = Inputs { n: f64::INFINITY, integral_time: 0.0, ..pid() };
    controller.step(inputs);
    let moved = Inputs { process_value: 4.0, ..inputs };
    assert_eq!(controller.step(moved).derivative_part, -16.0);
    assert_eq!(controller.step(moved).derivative_part, 0.0);
}

#[test]
fn the_parallel_form_with_the_gains_of_the_isa_form_does_the_same() {
    let parallel = Inputs {
        parallel: true,
        integral_gain: 0.5,
        derivative_gain: 8.0,
        // What the form does not use may be anything.
        integral_time: -1.0,
        derivative_time: f64::NAN,
        ..pid()
    };
    let isa = Inputs { integral_gain: f64::NAN, ..pid() };
    let (mut a, mut b) = (Controller::default(), Controller::default());
    for cycle in 0..50 {
        let process_value = f64::from(cycle % 7) + 0.5;
        // Limits that count, so that the tracking times count.
        let limits =
            |inputs| Inputs { output_min: -10.0, output_max: 20.0, process_value, ..inputs };
        assert_eq!(a.step(limits(isa)), b.step(limits(parallel)));
    }
}

#[test]
fn direct_action_turns_all_parts_round() {
    let (mut reverse, mut direct) = (Controller::default(), Controller::default());
    for cycle in 0..20 {
        let inputs = Inputs { process_value: f64::from(cycle % 5), ..pid() };
        let (a, b) = (reverse.step(inputs), direct.step(Inputs { direct: true, ..inputs }));
        assert_eq!(a.output, -b.output);
        assert_eq!(a.derivative_part, -b.derivative_part);
    }
}

#[test]
fn skipped_cycles_count_as_time() {
    let mut controller = Controller::default();
    let rates = Inputs { up_rate: 1.0, ..pi() };
    assert_eq!(controller.steps(pi(), 2).integral_part, 0.5);
    controller.cycle += 3;
    assert_eq!(controller.step(pi()).integral_part, 2.5);
    let mut limited = Controller::default();
    assert_eq!(limited.step(rates).output, 0.5);
    limited.cycle += 3;
    assert_eq!(limited.step(rates).output, 2.5);
}

#[test]
fn limits_and_rates_are_told() {
    let low = Inputs { output_max: 6.0, ..p() };
    let outputs = Controller::default().step(low);
    assert_eq!((outputs.output, outputs.status, outputs.error), (6.0, status::LIMITED_HIGH, false));
    let high = Inputs { output_min: 9.0, ..p() };
    let outputs = Controller::default().step(high);
    assert_eq!((outputs.output, outputs.status, outputs.error), (9.0, status::LIMITED_LOW, false));
    let slow = Inputs { up_rate: 4.0, ..p() };
    let outputs = Controller::default().step(slow);
    assert_eq!((outputs.output, outputs.status, outputs.error), (2.0, status::LIMITED_RATE, false));
    let mut stuck = Controller::default();
    let still = Inputs { up_rate: 0.0, down_rate: 0.0, ..p() };
    assert_eq!(stuck.steps(still, 10).output, 0.0, "a rate of 0 is no movement");
}

#[test]
fn a_limit_counts_for_more_than_a_rate() {
    let mut controller = Controller::default();
    let inputs = Inputs { up_rate: 1.0, down_rate: 1.0, ..p() };
    controller.steps(inputs, 16);
    let lower = Inputs { output_max: 3.0, ..inputs };
    assert_eq!(controller.step(lower).output, 3.0);
}

#[test]
fn without_integral_action_a_limit_leaves_nothing_behind() {
    let mut controller = Controller::default();
    controller.steps(Inputs { output_max: 1.0, ..p() }, 100);
    assert_eq!(controller.step(p()).output, 8.0);
}

#[test]
fn manual_mode_holds_until_its_value_changes() {
    let mut controller = Controller::default();
    let automatic = Inputs { manual_value: 30.0, ..pi() };
    assert_eq!(controller.steps(automatic, 3).output, 9.0);
    let manual = Inputs { manual: true, ..automatic };
    assert_eq!(controller.step(manual).output, 9.5, "what automatic mode gives");
    assert_eq!(controller.steps(manual, 20).output, 9.5);
    assert_eq!(controller.step(Inputs { manual_value: 31.0, ..manual }).output, 31.0);
    assert_eq!(controller.step(manual).output, 30.0, "it has changed, and counts from then on");
    let back = controller.step(automatic);
    assert_eq!(back.output, 30.0);
    assert_eq!(controller.step(automatic).output, 30.5);
    assert_eq!(controller.step(manual).output, 31.0);
    assert_eq!(controller.steps(manual, 5).output, 31.0, "it holds again");
}

#[test]
fn mode_and_manual_value_that_are_set_together_move_the_output_in_the_next_cycle() {
    let mut controller = Controller::default();
    controller.steps(pi(), 3);
    let manual = Inputs { manual: true, manual_value: 30.0, ..pi() };
    assert_eq!(controller.step(manual).output, 9.5);
    assert_eq!(controller.step(manual).output, 30.0);
}

#[test]
fn the_first_call_takes_its_mode_at_once() {
    let manual = Inputs { manual: true, manual_value: 7.0, ..pi() };
    assert_eq!(Controller::default().step(manual).output, 7.0);
    let track = Inputs { track: true, track_value: 3.0, ..pi() };
    assert_eq!(Controller::default().step(track).output, 3.0);
    let both = Inputs { track: true, track_value: 3.0, ..manual };
    assert_eq!(Controller::default().step(both).output, 7.0, "manual precedes tracking");
}

#[test]
fn automatic_mode_goes_on_from_the_value_that_was_tracked() {
    let mut controller = Controller::default();
    let track = Inputs { track: true, track_value: 40.0, ..pi() };
    assert_eq!(controller.steps(track, 10).output, 40.0);
    let automatic = Inputs { track: false, ..track };
    assert_eq!(controller.step(automatic).output, 40.0);
    assert_eq!(controller.step(automatic).output, 40.5);
}

#[test]
fn a_change_of_parameters_moves_no_output() {
    let mut controller = Controller::default();
    assert_eq!(controller.steps(pid(), 3).output, 9.0);
    let other = Inputs { gain: 1.0, integral_time: 4.0, b: 0.0, direct: true, ..pid() };
    assert_eq!(controller.step(other).output, 9.5);
    assert_eq!(controller.step(other).output, 9.25, "then the new integral moves it");
    let mut controller = Controller::default();
    controller.step(p());
    controller.step(Inputs { gain: 1.0, ..p() });
    let again = controller.step(Inputs { gain: 1.0, ..p() });
    assert_eq!((again.output, again.integral_part), (8.0, 6.0), "kept without integral action");
    let reset = controller.step(Inputs { gain: 1.0, reset: true, ..p() });
    assert_eq!((reset.output, reset.integral_part), (2.0, 0.0));
}

#[test]
fn a_failed_sensor_holds_the_output_and_its_return_is_no_bump() {
    for failed in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut controller = Controller::default();
        assert_eq!(controller.steps(pid(), 3).output, 9.0);
        for _ in 0..10 {
            let outputs = controller.step(Inputs { process_value: failed, ..pid() });
            assert_eq!((outputs.output, outputs.status), (9.0, status::SENSOR));
            assert!(outputs.error);
        }
        let back = Inputs { process_value: 20.0, ..pid() };
        let outputs = controller.step(back);
        assert_eq!((outputs.output, outputs.status), (9.0, status::OK));
        assert_eq!(controller.step(back).output, 9.0 - 4.0 / 8.0 * 15.0 * 0.5);
    }
}

#[test]
fn without_integral_action_the_return_of_the_sensor_leaves_no_bias() {
    let failed = Inputs { process_value: f64::NAN, ..p() };
    let mut controller = Controller::default();
    controller.steps(failed, 3);
    assert_eq!(controller.step(p()).output, 8.0, "it failed from the first cycle on");
    assert_eq!(controller.steps(failed, 3).output, 8.0);
    let outputs =
        controller.step(Inputs { process_value: 4.0, up_rate: 2.0, down_rate: 2.0, ..p() });
    assert_eq!((outputs.output, outputs.status), (7.0, status::LIMITED_RATE));

    let manual = Inputs { manual: true, manual_value: 10.0, ..p() };
    controller.steps(manual, 2);
    controller.steps(Inputs { manual: false, ..manual }, 2);
    controller.steps(failed, 3);
    let outputs = controller.step(Inputs { process_value: 4.0, ..p() });
    assert_eq!(
        (outputs.output, outputs.integral_part),
        (6.0, 2.0),
        "the bias of manual mode stays"
    );
}

#[test]
fn manual_mode_works_without_the_sensor() {
    let mut controller = Controller::default();
    let manual = Inputs { manual: true, manual_value: 7.0, process_value: f64::NAN, ..pi() };
    let outputs = controller.step(manual);
    assert_eq!((outputs.output, outputs.status), (7.0, status::SENSOR));
    let outputs = controller.step(Inputs { manual_value: 8.0, ..manual });
    assert_eq!((outputs.output, outputs.status), (8.0, status::SENSOR));
    controller.step(Inputs { manual: false, manual_value: 8.0, ..manual });
    assert_eq!(controller.step(pi()).output, 8.0, "automatic mode goes on from there");
}

#[test]
fn what_is_invalid_is_told_and_the_output_holds() {
    let nan = f64::NAN;
    let inf = f64::INFINITY;
    let other = |change: fn(&mut Inputs)| {
        let mut inputs = pid();
        change(&mut inputs);
        inputs
    };
    for (bad, status) in [
        (other(|i| (i.output_min, i.output_max) = (1.0, 0.0)), status::RANGE),
        (other(|i| i.up_rate = -1.0), status::NEGATIVE_RATE),
        (other(|i| i.down_rate = -1.0), status::NEGATIVE_RATE),
        (other(|i| i.integral_time = -1.0), status::TIME),
        (other(|i| i.derivative_time = -1.0), status::TIME),
        (other(|i| i.tracking_time = -1.0), status::TIME),
        (other(|i| i.n = 0.0), status::TIME),
        (other(|i| i.n = -1.0), status::TIME),
        (Inputs { set_point: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { gain: inf, ..pid() }, status::NOT_FINITE),
        (Inputs { integral_time: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { derivative_time: inf, ..pid() }, status::NOT_FINITE),
        (Inputs { n: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { b: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { c: inf, ..pid() }, status::NOT_FINITE),
        (Inputs { tracking_time: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { output_max: nan, ..pid() }, status::NOT_FINITE),
        (Inputs { output_min: -inf, output_max: -inf, ..pid() }, status::NOT_FINITE),
        (Inputs { up_rate: nan, ..pid() }, status::NOT_FINITE),
    ] {
        let mut controller = Controller::default();
        assert_eq!(controller.steps(pid(), 3).output, 9.0);
        let outputs = controller.step(bad);
        assert_eq!((outputs.output, outputs.status, outputs.error), (9.0, status, true), "{bad:?}");
        let outputs = controller.step(pid());
        assert_eq!((outputs.output, outputs.status), (9.0, status::OK), "{bad:?}");
    }
}

#[test]
fn values_of_other_modes_may_be_anything() {
    let inputs = Inputs { manual_value: f64::NAN, track_value: f64::INFINITY, ..pi() };
    let mut controller = Controller::default();
    assert_eq!(controller.step(inputs).status, status::OK);
    controller.step(Inputs { track: true, ..inputs });
    let outputs = controller.step(Inputs { track: true, ..inputs });
    assert_eq!((outputs.output, outputs.status), (8.5, status::NOT_FINITE));
}

#[test]
fn integral_gain_alone_is_an_integrating_controller() {
    let inputs =
        Inputs { parallel: true, gain: 0.0, integral_gain: 0.5, derivative_gain: 9.0, ..p() };
    let mut controller = Controller::default();
    assert_eq!(controller.steps(inputs, 5).output, 2.0);
    // Its tracking time is 0: the integral stands at the limit.
    let limited = Inputs { output_max: 3.0, ..inputs };
    assert_eq!(controller.steps(limited, 50).output, 3.0);
    let turned = Inputs { process_value: 7.0, ..limited };
    assert_eq!(controller.steps(turned, 3).output, 1.5 + 0.5);
}

#[test]
fn a_rate_of_zero_holds_the_output_in_every_mode_until_a_limit_moves_it() {
    for (manual, track) in [(false, false), (true, false), (false, true)] {
        let mut controller = Controller::default();
        let mode = Inputs { manual, track, manual_value: 60.0, track_value: 60.0, ..p() };
        let held = Inputs { set_point: 1e3, up_rate: 0.0, ..mode };
        let outputs = controller.steps(held, 3);
        assert_eq!((outputs.output, outputs.status), (0.0, status::LIMITED_RATE));
        let outputs = controller.step(Inputs { output_min: 5.0, ..held });
        assert_eq!((outputs.output, outputs.status), (5.0, status::LIMITED_LOW));
    }
}

#[test]
fn reset_has_no_effect_in_manual_and_tracking_mode() {
    for (manual, track) in [(true, false), (false, true)] {
        let mode = Inputs { manual, track, manual_value: 60.0, track_value: 60.0, ..pi() };
        let [mut with, mut without] = [Controller::default(), Controller::default()];
        for reset in [false, true, true, false] {
            let expected = without.step(mode);
            assert_eq!(with.step(Inputs { reset, ..mode }), expected);
            assert_eq!(expected.output, 60.0);
        }
    }
}
