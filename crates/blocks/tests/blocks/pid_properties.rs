//! What holds for PID whatever is done to it: no bump, limits and rates, no windup.

use isochrone_blocks::pid::{Inputs, PID, State};
use isochrone_blocks::{Block, Cycle, status};
use proptest::prelude::*;

/// What changes from a cycle to the next.
#[derive(Clone, Debug)]
enum Change {
    Nothing,
    Signals { set_point: f64, process_value: f64 },
    SensorFails,
    ManualValue(f64),
    TrackValue(f64),
    Mode { manual: bool, track: bool },
    Isa { gain: f64, integral_time: f64, derivative_time: f64, tracking_time: f64 },
    Parallel { gain: f64, integral_gain: f64, derivative_gain: f64 },
    Shape { n: f64, b: f64, c: f64, direct: bool },
    Limits { min: f64, width: f64 },
    Rates { up: f64, down: f64 },
    Skipped(u64),
}

fn changes() -> impl Strategy<Value = Vec<Change>> {
    let signal = -50.0..50.0;
    let time = prop_oneof![Just(0.0), 0.001..100.0];
    let gain = prop_oneof![Just(0.0), -20.0..20.0];
    let change = prop_oneof![
        6 => Just(Change::Nothing),
        6 => (signal.clone(), signal.clone())
            .prop_map(|(set_point, process_value)| Change::Signals { set_point, process_value }),
        1 => Just(Change::SensorFails),
        2 => signal.clone().prop_map(Change::ManualValue),
        2 => signal.clone().prop_map(Change::TrackValue),
        4 => any::<(bool, bool)>().prop_map(|(manual, track)| Change::Mode { manual, track }),
        2 => (gain.clone(), time.clone(), time.clone(), time).prop_map(
            |(gain, integral_time, derivative_time, tracking_time)| Change::Isa {
                gain, integral_time, derivative_time, tracking_time,
            }
        ),
        1 => (gain.clone(), gain.clone(), gain).prop_map(
            |(gain, integral_gain, derivative_gain)| Change::Parallel {
                gain, integral_gain, derivative_gain,
            }
        ),
        1 => (0.5..30.0, 0.0..1.5, 0.0..1.5, any::<bool>())
            .prop_map(|(n, b, c, direct)| Change::Shape { n, b, c, direct }),
        1 => (signal, 0.0..80.0).prop_map(|(min, width)| Change::Limits { min, width }),
        1 => (prop_oneof![Just(f64::INFINITY), 0.0..1e3], prop_oneof![Just(f64::INFINITY), 0.0..1e3])
            .prop_map(|(up, down)| Change::Rates { up, down }),
        1 => (1..50u64).prop_map(Change::Skipped),
    ];
    prop::collection::vec(change, 1..150)
}

impl Change {
    fn apply(&self, inputs: &mut Inputs, cycle: &mut u64) {
        match *self {
            Self::Nothing => {}
            Self::Signals { set_point, process_value } => {
                (inputs.set_point, inputs.process_value) = (set_point, process_value);
            }
            Self::SensorFails => inputs.process_value = f64::NAN,
            Self::ManualValue(value) => inputs.manual_value = value,
            Self::TrackValue(value) => inputs.track_value = value,
            Self::Mode { manual, track } => (inputs.manual, inputs.track) = (manual, track),
            Self::Isa { gain, integral_time, derivative_time, tracking_time } => {
                inputs.parallel = false;
                (inputs.gain, inputs.tracking_time) = (gain, tracking_time);
                (inputs.integral_time, inputs.derivative_time) = (integral_time, derivative_time);
            }
            Self::Parallel { gain, integral_gain, derivative_gain } => {
                (inputs.parallel, inputs.gain) = (true, gain);
                (inputs.integral_gain, inputs.derivative_gain) = (integral_gain, derivative_gain);
            }
            Self::Shape { n, b, c, direct } => {
                (inputs.n, inputs.b, inputs.c, inputs.direct) = (n, b, c, direct);
            }
            Self::Limits { min, width } => {
                (inputs.output_min, inputs.output_max) = (min, min + width);
            }
            Self::Rates { up, down } => (inputs.up_rate, inputs.down_rate) = (up, down),
            Self::Skipped(cycles) => *cycle += cycles,
        }
    }
}

/// The inputs with the mode and the parameters of others.
fn with_mode_and_parameters(inputs: &Inputs, of: &Inputs) -> Inputs {
    Inputs {
        set_point: inputs.set_point,
        process_value: inputs.process_value,
        manual_value: inputs.manual_value,
        track_value: inputs.track_value,
        output_min: inputs.output_min,
        output_max: inputs.output_max,
        up_rate: inputs.up_rate,
        down_rate: inputs.down_rate,
        ..*of
    }
}

fn start() -> Inputs {
    Inputs { gain: 2.0, integral_time: 1.0, derivative_time: 0.2, ..Inputs::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_change_of_mode_or_parameters_moves_the_output_of_its_cycle_by_no_bit(
        changes in changes(), period_ns in 10_000..1_000_000_000u64,
    ) {
        let (mut state, mut inputs, mut index) = (State::default(), start(), 0);
        PID::step(&mut state, &inputs, &Cycle::new(index, period_ns, &[]));
        // Some changes fall into the same cycle.
        for some in changes.chunks(2) {
            let before = inputs;
            index += 1;
            some.iter().for_each(|change| change.apply(&mut inputs, &mut index));
            let cycle = Cycle::new(index, period_ns, &[]);
            let mut unchanged = state;
            let without = with_mode_and_parameters(&inputs, &before);
            let without = PID::step(&mut unchanged, &without, &cycle);
            let outputs = PID::step(&mut state, &inputs, &cycle);
            prop_assert_eq!(outputs.output.to_bits(), without.output.to_bits());
            prop_assert!(!outputs.error || outputs.status == status::SENSOR, "{:?}", outputs);
        }
    }

    #[test]
    fn after_a_change_to_manual_mode_the_output_holds_while_manual_value_does(
        changes in changes(), period_ns in 10_000..1_000_000_000u64,
    ) {
        let (mut state, mut inputs, mut index) = (State::default(), start(), 0);
        // The output to hold, and `manualValue` in the last cycle before manual mode, while nothing has ended the hold.
        let (mut held, mut baseline) = (None, None);
        for change in changes {
            index += 1;
            change.apply(&mut inputs, &mut index);
            let output = PID::step(&mut state, &inputs, &Cycle::new(index, period_ns, &[])).output;
            if !inputs.manual {
                (held, baseline) = (None, Some(inputs.manual_value));
                continue;
            }
            if baseline != Some(inputs.manual_value) {
                (held, baseline) = (None, None);
            } else {
                // A limit may have moved it.
                let held = held.get_or_insert(output);
                *held = held.clamp(inputs.output_min, inputs.output_max);
                prop_assert_eq!(output, *held);
            }
        }
    }

    #[test]
    fn the_output_is_always_within_its_limits_and_moves_no_faster_than_its_rates(
        changes in changes(), period_ns in 10_000..1_000_000_000u64,
    ) {
        let (mut state, mut inputs, mut index) = (State::default(), start(), 0u64);
        let (mut last, mut cycles) = (0.0, 1);
        for change in changes {
            let before = index;
            change.apply(&mut inputs, &mut index);
            cycles += index - before;
            let outputs = PID::step(&mut state, &inputs, &Cycle::new(index, period_ns, &[]));
            let Inputs { output_min: min, output_max: max, up_rate, down_rate, .. } = inputs;
            let (u, h) = (outputs.output, (cycles * period_ns) as f64 / 1e9);
            prop_assert!(min <= u && u <= max, "{} to {}: {}", min, max, u);
            let is_in_rates = last - down_rate * h <= u && u <= last + up_rate * h;
            let is_moved_by_limit = (u == min && last < min) || (u == max && last > max);
            prop_assert!(is_in_rates || is_moved_by_limit, "{} to {}", last, u);
            prop_assert!(outputs.status != status::LIMITED_HIGH || u == max);
            prop_assert!(outputs.status != status::LIMITED_LOW || u == min);
            (last, cycles) = (u, 1);
            index += 1;
        }
    }

    #[test]
    fn the_output_leaves_its_limit_in_the_cycle_in_which_the_deviation_turns_round(
        gain in 0.01..50.0f64,
        integral_time in 0.05..100.0f64,
        part in 0.05..=1.0f64,
        deviation in 1.0..50.0f64,
        cycles in 1..3000u64,
        period_ns in 100_000..5_000_000u64,
    ) {
        // A tracking time of at most the integral time, and of at least the period; automatic where it is all of it.
        let period_s = period_ns as f64 / 1e9;
        let tracking_time =
            if part > 0.95 { 0.0 } else { (part * integral_time).max(period_s) };
        let inputs = Inputs { gain, integral_time, tracking_time, ..Inputs::default() };
        let above = Inputs { set_point: deviation, output_max: 0.5 * gain * deviation, ..inputs };
        let below = Inputs { process_value: deviation, set_point: 0.0, ..above };
        let mut state = State::default();
        for index in 0..cycles {
            let outputs = PID::step(&mut state, &above, &Cycle::new(index, period_ns, &[]));
            prop_assert_eq!(outputs.status, status::LIMITED_HIGH);
        }
        let outputs = PID::step(&mut state, &below, &Cycle::new(cycles, period_ns, &[]));
        prop_assert!(outputs.output < above.output_max, "{:?}", outputs);
    }

    #[test]
    fn automatic_mode_goes_on_from_any_output_by_its_integral_alone(
        changes in changes(),
        period_ns in 10_000..1_000_000_000u64,
        signals in (-50.0..50.0f64, -50.0..50.0f64),
        manual_value in -50.0..50.0f64,
    ) {
        let (mut state, mut inputs, mut index) = (State::default(), start(), 0);
        for change in changes {
            index += 1;
            change.apply(&mut inputs, &mut index);
            PID::step(&mut state, &inputs, &Cycle::new(index, period_ns, &[]));
        }
        // Signals at rest, and then from manual to automatic mode.
        let free = Inputs {
            set_point: signals.0,
            process_value: signals.1,
            manual: true,
            manual_value,
            output_min: -1e12,
            output_max: 1e12,
            up_rate: f64::INFINITY,
            down_rate: f64::INFINITY,
            ..inputs
        };
        let mut step = |inputs: &Inputs, after| {
            PID::step(&mut state, inputs, &Cycle::new(index + after, period_ns, &[])).output
        };
        step(&free, 1);
        let other = Inputs { manual_value: manual_value + 1.0, ..free };
        step(&other, 2);
        let held = step(&other, 3);
        prop_assert_eq!(held, manual_value + 1.0);
        let automatic = Inputs { manual: false, track: false, derivative_time: 0.0, derivative_gain: 0.0, ..other };
        prop_assert_eq!(step(&automatic, 4), held);
        let moved = step(&automatic, 5) - held;
        let ki = match inputs.parallel {
            true => inputs.integral_gain,
            false if inputs.integral_time == 0.0 => 0.0,
            false => inputs.gain / inputs.integral_time,
        };
        let sign = if inputs.direct { -1.0 } else { 1.0 };
        let expected = sign * ki * (signals.0 - signals.1) * (period_ns as f64 / 1e9);
        let rounding = 1e-12 * (1.0 + expected.abs() + 100.0 * inputs.gain.abs());
        prop_assert!((moved - expected).abs() <= rounding, "{} {}", moved, expected);
    }
}
