//! ScaleLinear, case by case.

use isochrone_blocks::scale_linear::{Inputs, Outputs, ScaleLinear, State};
use isochrone_blocks::{Block, Cycle};

/// The seed's example: 0 to 27648 is a level of 0.0 to 1.7 m.
fn level(x: f64) -> Inputs {
    Inputs { x, x1: 0.0, y1: 0.0, x2: 27648.0, y2: 1.7, y_min: 0.0, y_max: 1.7 }
}

fn step(state: &mut State, inputs: Inputs) -> Outputs {
    ScaleLinear::step(state, &inputs, &Cycle::new(0, 1_000_000, &[]))
}

fn once(inputs: Inputs) -> (f64, u16) {
    let outputs = step(&mut State::default(), inputs);
    assert_eq!(outputs.error, outputs.status >= 0x8000);
    (outputs.y, outputs.status)
}

/// Half of 1.7 in the order of operations of the specification.
const HELD: f64 = 1.7 / 27648.0 * 13824.0;

/// What a block shows that had scaled to [`HELD`] before.
fn after_good(inputs: Inputs) -> (f64, u16) {
    let mut state = State::default();
    assert_eq!(step(&mut state, level(13824.0)).y, HELD);
    let outputs = step(&mut state, inputs);
    (outputs.y, outputs.status)
}

#[test]
fn the_seeds_example_scales_the_ends_and_the_middle() {
    assert_eq!(once(level(0.0)), (0.0, 0));
    // Not 0.85: the slope is rounded before it is multiplied.
    assert_eq!(once(level(13824.0)), (0.8499999999999999, 0));
    assert_eq!(once(level(27648.0)), (1.7, 0));
}

#[test]
fn the_two_points_are_exact_so_that_full_scale_is_not_reported_as_limited() {
    // The rounded line passes 6.9 and would be cut there, and misses 1.7 and 2.1.
    for top in [6.9, 1.7, 2.1] {
        assert_eq!(once(Inputs { y2: top, y_max: top, ..level(27648.0) }), (top, 0));
    }
    let inputs = Inputs { x1: 0.1, y1: 0.7, x2: 0.3, y2: 0.9, ..level(0.1) };
    assert_eq!(once(inputs), (0.7, 0));
    assert_eq!(once(Inputs { x: 0.3, ..inputs }), (0.9, 0));
    let (y, _) = once(Inputs { y1: -0.0, ..level(0.0) });
    assert_eq!(y.to_bits(), (-0.0f64).to_bits());
}

#[test]
fn the_operations_run_in_the_order_of_the_specification_bit_for_bit() {
    let (x, x1, y1, x2, y2): (f64, f64, f64, f64, f64) = (-6.5, 4.6, 9.6, -8.3, -3.4);
    let slope = (y2 - y1) / (x2 - x1);
    let expected = slope * (x - x1) + y1;
    let other = (y2 - y1) * (x - x1) / (x2 - x1) + y1;
    let fused = slope.mul_add(x - x1, y1);
    assert!(expected != other && expected != fused, "these numbers must tell the orders apart");
    let inputs = Inputs { x, x1, y1, x2, y2, y_min: -9.0, y_max: 9.0 };
    assert_eq!(once(inputs).0.to_bits(), expected.to_bits());
}

#[test]
fn below_y_min_is_6001_and_above_y_max_6002_without_error() {
    assert_eq!(once(level(-1.0)), (0.0, 0x6001));
    assert_eq!(once(level(27649.0)), (1.7, 0x6002));
}

#[test]
fn points_above_each_other_give_y1_within_the_limits() {
    let inputs = Inputs { x1: 5.0, x2: 5.0, y1: 0.5, ..level(123.0) };
    assert_eq!(once(inputs), (0.5, 0));
    assert_eq!(once(Inputs { y1: -3.0, ..inputs }), (0.0, 0x6001));
    assert_eq!(once(Inputs { y1: 3.0, ..inputs }), (1.7, 0x6002));
    assert_eq!(once(Inputs { x1: 0.0, x2: -0.0, ..inputs }), (0.5, 0));
}

#[test]
fn y_min_above_y_max_is_8200_and_holds() {
    let inverted = Inputs { y_min: 2.0, ..level(1000.0) };
    assert_eq!(after_good(inverted), (HELD, 0x8200));
    assert_eq!(after_good(Inputs { x: f64::NAN, ..inverted }), (HELD, 0x8200));
}

#[test]
fn y_min_equal_to_y_max_is_legal() {
    assert_eq!(once(Inputs { y_min: 1.0, y_max: 1.0, ..level(0.0) }), (1.0, 0x6001));
    assert_eq!(once(Inputs { y_min: 1.0, y_max: 1.0, ..level(27648.0) }), (1.0, 0x6002));
}

#[test]
fn a_signal_that_is_not_finite_is_8f00_and_holds() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let good = level(1000.0);
        for inputs in [
            Inputs { x: bad, ..good },
            Inputs { x1: bad, ..good },
            Inputs { y1: bad, ..good },
            Inputs { x2: bad, ..good },
            Inputs { y2: bad, ..good },
        ] {
            assert_eq!(after_good(inputs), (HELD, 0x8F00), "{inputs:?}");
        }
    }
}

#[test]
fn a_nan_limit_is_8f00_and_an_infinite_one_is_none() {
    assert_eq!(after_good(Inputs { y_min: f64::NAN, ..level(0.0) }), (HELD, 0x8F00));
    assert_eq!(after_good(Inputs { y_max: f64::NAN, ..level(0.0) }), (HELD, 0x8F00));
    let open = Inputs { y_min: f64::NEG_INFINITY, y_max: f64::INFINITY, ..level(-27648.0) };
    assert_eq!(once(open), (-1.6999999999999997, 0));
}

#[test]
fn an_overflow_that_a_limit_catches_is_that_limit() {
    let steep = Inputs { x: 1e300, x2: 1e-10, y2: 1e300, y_min: -5.0, y_max: 5.0, ..level(0.0) };
    assert_eq!(once(steep), (5.0, 0x6002));
    assert_eq!(once(Inputs { x: -1e300, ..steep }), (-5.0, 0x6001));
}

#[test]
fn an_overflow_that_no_limit_catches_is_8f00_and_holds() {
    let steep = Inputs { x: 1e300, x2: 1e-10, y2: 1e300, y_max: f64::INFINITY, ..level(0.0) };
    assert_eq!(after_good(steep), (HELD, 0x8F00));
    let below = Inputs { x: -1e300, y_min: f64::NEG_INFINITY, ..steep };
    assert_eq!(after_good(below), (HELD, 0x8F00));
}

#[test]
fn a_slope_that_overflows_is_exact_at_the_points_and_limited_elsewhere() {
    let steep = Inputs { x: 0.0, x2: 5e-324, y2: 1e300, ..level(0.0) };
    assert_eq!(once(steep), (0.0, 0));
    assert_eq!(once(Inputs { x: 5e-324, y_max: 1e301, ..steep }), (1e300, 0));
    assert_eq!(once(Inputs { x: 1e300, y1: -1e300, ..steep }), (1.7, 0x6002));
}

#[test]
fn a_difference_that_overflows_is_8f00_and_not_a_slope_of_zero() {
    let wide = Inputs { x1: -1.7e308, x2: 1.7e308, y2: 10.0, y_max: 1e9, ..level(0.0) };
    assert_eq!(after_good(wide), (HELD, 0x8F00));
    let tall = Inputs { x: 0.5, y1: -1.7e308, x2: 1.0, y2: 1.7e308, ..level(0.0) };
    assert_eq!(after_good(tall), (HELD, 0x8F00));
    let far = Inputs { x: 1.7e308, x1: -1e308, x2: 1.0, y2: 1.0, ..level(0.0) };
    assert_eq!(after_good(far), (HELD, 0x8F00));
    // At the points no difference is needed.
    assert_eq!(once(Inputs { x: -1.7e308, ..wide }), (0.0, 0));
    assert_eq!(once(Inputs { x: 1.7e308, ..wide }), (10.0, 0));
}

#[test]
fn limits_that_only_an_infinity_lies_between_are_8f00() {
    for limit in [f64::INFINITY, f64::NEG_INFINITY] {
        let inputs = Inputs { y_min: limit, y_max: limit, ..level(1.0) };
        assert_eq!(after_good(inputs), (HELD, 0x8F00));
    }
}

#[test]
fn inputs_whose_sum_overflows_are_finite_all_the_same() {
    let inputs = Inputs { x: 1e308, x1: 1e308, x2: -1e308, ..level(0.0) };
    assert_eq!(once(inputs), (0.0, 0));
}
