//! SawTooth, case by case.

use isochrone_blocks::saw_tooth::{Inputs, SawTooth, State};
use isochrone_blocks::{Block, Cycle};

const MS: u64 = 1_000_000;

/// Steps of 5 every 20 ms from 2: four values.
fn saw() -> Inputs {
    Inputs {
        start_value: 2,
        time_range: 20,
        increment_range: 5,
        number_steps: 3,
        endless_steps: false,
        reset: false,
    }
}

fn step(state: &mut State, inputs: Inputs, cycle: u64, period_ns: u64) -> i16 {
    SawTooth::step(state, &inputs, &Cycle::new(cycle, period_ns, &[])).value
}

/// The values of cycles 0, 1, … of a 10 ms task.
fn values(inputs: Inputs, cycles: u64) -> Vec<i16> {
    let mut state = State::default();
    (0..cycles).map(|cycle| step(&mut state, inputs, cycle, 10 * MS)).collect()
}

#[test]
fn a_sawtooth_lasts_time_range_times_number_steps_plus_1() {
    assert_eq!(values(saw(), 10), [2, 2, 7, 7, 12, 12, 17, 17, 2, 2]);
}

#[test]
fn a_negative_increment_counts_down() {
    assert_eq!(
        values(Inputs { increment_range: -5, ..saw() }, 8),
        [2, 2, -3, -3, -8, -8, -13, -13]
    );
}

#[test]
fn a_time_range_that_is_no_multiple_of_the_period_steps_in_the_first_cycle_after_it() {
    // 25 ms in a 10 ms task: steps at 30, 50, 80, 100 ms.
    let inputs = Inputs { time_range: 25, ..saw() };
    assert_eq!(values(inputs, 11), [2, 2, 2, 7, 7, 12, 12, 12, 17, 17, 2]);
}

#[test]
fn a_time_range_shorter_than_the_period_skips_steps() {
    // 4 ms in a 10 ms task: 0, 2, 5, 7, 10 whole intervals.
    let inputs = Inputs { time_range: 4, number_steps: 100, ..saw() };
    assert_eq!(values(inputs, 5), [2, 12, 27, 37, 52]);
}

#[test]
fn a_time_range_of_0_or_less_steps_once_per_cycle() {
    for time_range in [0, -1, i32::MIN] {
        assert_eq!(values(Inputs { time_range, ..saw() }, 6), [2, 7, 12, 17, 2, 7]);
    }
}

#[test]
fn number_steps_of_0_or_less_stays_at_the_start_value() {
    for number_steps in [0, -1, i16::MIN] {
        assert_eq!(values(Inputs { number_steps, ..saw() }, 5), [2; 5]);
    }
}

#[test]
fn an_endless_sawtooth_ignores_number_steps_and_wraps_at_32767() {
    let endless = Inputs { endless_steps: true, time_range: 10, start_value: 32_766, ..saw() };
    assert_eq!(
        values(Inputs { increment_range: 1, ..endless }, 4),
        [32_766, 32_767, -32_768, -32_767]
    );
    let down = Inputs { increment_range: -1, start_value: -32_767, ..endless };
    assert_eq!(values(down, 4), [-32_767, -32_768, 32_767, 32_766]);
}

#[test]
fn a_finite_sawtooth_wraps_too_and_starts_again_at_its_start() {
    let inputs = Inputs { start_value: 30_000, increment_range: 2_000, time_range: 10, ..saw() };
    assert_eq!(values(inputs, 5), [30_000, 32_000, -31_536, -29_536, 30_000]);
}

#[test]
fn changed_inputs_take_effect_only_with_reset() {
    let mut state = State::default();
    step(&mut state, saw(), 0, 10 * MS);
    let other = Inputs { start_value: 100, time_range: 10, increment_range: 1, ..saw() };
    for (cycle, value) in [(1, 2), (2, 7), (6, 17), (8, 2)] {
        assert_eq!(step(&mut state, other, cycle, 10 * MS), value);
    }
    let reset = Inputs { reset: true, ..other };
    assert_eq!(step(&mut state, reset, 9, 10 * MS), 100);
    assert_eq!(step(&mut state, saw(), 10, 10 * MS), 101);
}

#[test]
fn the_first_call_takes_its_inputs_over_whatever_its_cycle() {
    for first in [0, 1, 1_000_000_000_007, u64::MAX - 5] {
        let mut state = State::default();
        let values: Vec<i16> =
            (0..5).map(|cycle| step(&mut state, saw(), first + cycle, 10 * MS)).collect();
        assert_eq!(values, [2, 2, 7, 7, 12], "first call in cycle {first}");
    }
}

#[test]
fn reset_holds_the_start_value_for_as_long_as_it_is_true() {
    let mut state = State::default();
    let reset = Inputs { reset: true, ..saw() };
    for cycle in 0..10 {
        assert_eq!(step(&mut state, reset, cycle, 10 * MS), 2);
    }
    // The last call with reset is time 0.
    let after: Vec<i16> = (10..13).map(|cycle| step(&mut state, saw(), cycle, 10 * MS)).collect();
    assert_eq!(after, [2, 7, 7]);
}

#[test]
fn skipped_cycles_count() {
    let mut state = State::default();
    let cycles = [0, 5, 6, 7, 8, 15, 80, 83];
    let values: Vec<i16> =
        cycles.iter().map(|cycle| step(&mut state, saw(), *cycle, 10 * MS)).collect();
    assert_eq!(values, [2, 12, 17, 17, 2, 17, 2, 7]);
}

#[test]
fn the_period_is_exact_after_ten_to_the_twelve_cycles() {
    // A period that is no whole number of milliseconds, so that any rounding would show.
    let period_ns = 333_333;
    let inputs = Inputs { time_range: 7, number_steps: 9, ..saw() };
    for first in [0, 10u64.pow(12), 10u64.pow(15)] {
        let mut state = State::default();
        step(&mut state, inputs, 0, period_ns);
        for cycle in first.max(1)..first + 300 {
            let elapsed_ns = u128::from(cycle) * u128::from(period_ns);
            let k = elapsed_ns / (7 * u128::from(MS)) % 10;
            assert_eq!(step(&mut state, inputs, cycle, period_ns), 2 + 5 * k as i16, "{cycle}");
        }
    }
}
