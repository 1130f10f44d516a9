//! What holds for every input, finite or not.

use crate::arbitrary;
use crate::arbitrary::OBS;
use isochrone_blocks::lim_rate_of_change::{self, LimRateOfChangeCI};
use isochrone_blocks::lim_rate_of_change_advanced::{self, LimRateOfChangeAdvancedCI};
use isochrone_blocks::scale_linear::{self, ScaleLinear};
use isochrone_blocks::{Block, BlockType, CATALOGUE, Cycle, PinType};
use proptest::prelude::*;

/// Slots of an instance's inputs, whatever the type of its pins.
fn input_slots(block_type: BlockType) -> impl Strategy<Value = Vec<f64>> {
    block_type
        .inputs
        .iter()
        .map(|pin| match (pin.pin_type, pin.name) {
            (_, "callOB") => prop::sample::select(&[f64::NAN, 30.0, 35.0, 36.0, 1.0]).boxed(),
            (PinType::Lreal, name) if name.contains("Rate") => arbitrary::rate().boxed(),
            (PinType::Lreal, _) => arbitrary::real().boxed(),
            (PinType::Bool, _) => arbitrary::seldom().prop_map(|b| f64::from(u8::from(b))).boxed(),
            (PinType::Time, _) => (-1i32..50).prop_map(f64::from).boxed(),
            (_, _) => (-50i16..50).prop_map(f64::from).boxed(),
        })
        .collect::<Vec<_>>()
}

/// A block type and, for each cycle, the input slots of each of its instances.
fn bank() -> impl Strategy<Value = (BlockType, Vec<Vec<Vec<f64>>>)> {
    (prop::sample::select(CATALOGUE), 1usize..9).prop_flat_map(|(block_type, instances)| {
        let instances = prop::collection::vec(input_slots(block_type), instances);
        (Just(block_type), prop::collection::vec(instances, 1..20))
    })
}

fn bits(slots: &[f64]) -> Vec<u64> {
    slots.iter().map(|slot| slot.to_bits()).collect()
}

/// Writes the inputs of each instance into an image.
fn set_inputs(block_type: &BlockType, image: &mut [f64], inputs: &[Vec<f64>]) {
    for (slots, inputs) in image.chunks_exact_mut(block_type.slots()).zip(inputs) {
        slots[..inputs.len()].copy_from_slice(inputs);
    }
}

/// A step from 0 is not rounded twice; one across it is, at most this much of its terms.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

proptest! {
    #[test]
    fn a_ramp_never_moves_by_more_than_its_step(
        sequence in arbitrary::sequence(arbitrary::ramp()),
        period_ns in arbitrary::period_ns(),
    ) {
        let (mut state, mut y) = (lim_rate_of_change::State::default(), 0.0f64);
        let cycle = Cycle::new(0, period_ns, OBS);
        for inputs in &sequence {
            let outputs = LimRateOfChangeCI::step(&mut state, inputs, &cycle);
            let next = outputs.delayed_value;
            if !inputs.en_default_out_value && outputs.error {
                prop_assert_eq!(next.to_bits(), y.to_bits());
            } else if !inputs.en_default_out_value {
                let step = inputs.set_change_rate * cycle.sample_time_s(inputs.call_ob).unwrap();
                prop_assert!(y - step <= next && next <= y + step, "{y} to {next} by {step}");
            }
            y = next;
        }
    }

    #[test]
    fn an_advanced_ramp_never_moves_by_more_than_the_larger_of_its_two_rates(
        sequence in arbitrary::sequence(arbitrary::advanced()),
        period_ns in arbitrary::period_ns(),
    ) {
        let (mut state, mut y) = (lim_rate_of_change_advanced::State::default(), 0.0f64);
        let cycle = Cycle::new(0, period_ns, OBS);
        for i in &sequence {
            let outputs = LimRateOfChangeAdvancedCI::step(&mut state, i, &cycle);
            let next = outputs.output_value;
            let rates = [
                i.set_pos_up_rate_lim, i.set_pos_down_rate_lim,
                i.set_neg_up_rate_lim, i.set_neg_down_rate_lim,
            ];
            let automatic = !(i.reset || i.man_op || i.en_default_out_value || i.track)
                && rates != [0.0; 4];
            if automatic && outputs.error {
                prop_assert_eq!(next.to_bits(), y.to_bits());
            }
            // A limit may move the output further than the ramp, but to the limit only.
            let at_limit = next == i.set_high_lim || next == i.set_low_lim;
            if automatic && !outputs.error && !at_limit {
                let rising = i.set_neg_down_rate_lim.max(i.set_pos_up_rate_lim);
                let falling = i.set_pos_down_rate_lim.max(i.set_neg_up_rate_lim);
                let sample_time_s = cycle.sample_time_s(i.call_ob).unwrap();
                let (up, down) = (rising * sample_time_s, falling * sample_time_s);
                if (y > 0.0) == (next > 0.0) || y == 0.0 || next == 0.0 {
                    prop_assert!(y - down <= next && next <= y + up, "{y} to {next}: {outputs:?}");
                } else {
                    let slack = ROUNDING * (y.abs() + up.max(down));
                    prop_assert!(y - down - slack <= next, "{y} to {next}: {outputs:?}");
                    prop_assert!(next <= y + up + slack, "{y} to {next}: {outputs:?}");
                }
            }
            y = next;
        }
    }

    #[test]
    fn at_most_one_rate_flag_is_true_and_none_where_the_target_or_the_limit_before_it_is_reached(
        sequence in arbitrary::sequence(arbitrary::advanced()),
    ) {
        let mut state = lim_rate_of_change_advanced::State::default();
        for inputs in &sequence {
            let outputs =
                LimRateOfChangeAdvancedCI::step(&mut state, inputs, &Cycle::new(0, 1_000_000, OBS));
            let rate_flags = [
                outputs.pos_up_rate_lim, outputs.pos_down_rate_lim,
                outputs.neg_up_rate_lim, outputs.neg_down_rate_lim,
            ];
            let set = rate_flags.iter().filter(|flag| **flag).count();
            prop_assert!(set <= 1);
            let (y, target) = (outputs.output_value, inputs.auto_value);
            let stopped_by_a_limit = (y == inputs.set_high_lim && target > y)
                || (y == inputs.set_low_lim && target < y);
            prop_assert!(set == 0 || !(y == target || stopped_by_a_limit));
        }
    }

    #[test]
    fn scale_linear_stays_within_its_limits_whenever_it_reports_no_error(
        sequence in prop::collection::vec(arbitrary::scale(), 1..100),
    ) {
        let mut state = scale_linear::State::default();
        for inputs in &sequence {
            let outputs = ScaleLinear::step(&mut state, inputs, &Cycle::new(0, 1_000_000, &[]));
            prop_assert!(outputs.error || (inputs.y_min <= outputs.y && outputs.y <= inputs.y_max));
        }
    }

    #[test]
    fn no_input_makes_an_output_that_is_not_finite_or_not_of_its_type(
        (block_type, cycles) in bank(),
        period_ns in arbitrary::period_ns(),
    ) {
        let instances = cycles[0].len();
        let mut image = vec![0.0; instances * block_type.slots()];
        let mut state = vec![0; instances * block_type.state_words];
        for (index, inputs) in cycles.iter().enumerate() {
            set_inputs(&block_type, &mut image, inputs);
            block_type.step_bank(&mut image, &mut state, &Cycle::new(index as u64, period_ns, OBS));
            for slots in image.chunks_exact(block_type.slots()) {
                for (pin, slot) in block_type.outputs.iter().zip(&slots[block_type.inputs.len()..]) {
                    prop_assert!(
                        slot.is_finite() && pin.pin_type.holds(*slot),
                        "{}.{} is {slot}: report status::NOT_FINITE, and let the output hold",
                        block_type.name,
                        pin.name
                    );
                }
            }
        }
    }

    #[test]
    fn a_bank_steps_each_instance_as_if_it_were_alone((block_type, cycles) in bank()) {
        let (stride, words) = (block_type.slots(), block_type.state_words);
        let instances = cycles[0].len();
        let (mut image, mut state) = (vec![0.0; instances * stride], vec![0; instances * words]);
        let (mut images, mut states) = (image.clone(), state.clone());
        for (index, inputs) in cycles.iter().enumerate() {
            let cycle = Cycle::new(index as u64 * 7, 1_000_000, OBS);
            set_inputs(&block_type, &mut image, inputs);
            set_inputs(&block_type, &mut images, inputs);
            let errors = block_type.step_bank(&mut image, &mut state, &cycle);
            let alone = images.chunks_exact_mut(stride).zip(states.chunks_exact_mut(words));
            let one_by_one: u64 =
                alone.map(|(image, state)| block_type.step_bank(image, state, &cycle)).sum();
            prop_assert_eq!(bits(&image), bits(&images));
            prop_assert_eq!(&state, &states);
            prop_assert_eq!(errors, one_by_one);
            let error = block_type.outputs.iter().position(|pin| pin.name == "error");
            let reported = error.map_or(0.0, |pin| {
                image.chunks_exact(stride).map(|slots| slots[block_type.inputs.len() + pin]).sum()
            });
            prop_assert_eq!(errors as f64, reported);
        }
    }

    #[test]
    fn image_and_state_are_all_that_the_next_cycles_depend_on((block_type, cycles) in bank()) {
        let instances = cycles[0].len();
        let mut image = vec![0.0; instances * block_type.slots()];
        let mut state = vec![0; instances * block_type.state_words];
        for (index, inputs) in cycles.iter().enumerate() {
            let cycle = Cycle::new(index as u64, 1_000_000, OBS);
            set_inputs(&block_type, &mut image, inputs);
            // The outputs of the cycle before are no part of the state either.
            let (mut again, mut state_again) = (image.clone(), state.clone());
            for slots in again.chunks_exact_mut(block_type.slots()) {
                slots[block_type.inputs.len()..].fill(-7.0);
            }
            block_type.step_bank(&mut again, &mut state_again, &cycle);
            block_type.step_bank(&mut image, &mut state, &cycle);
            prop_assert_eq!(bits(&image), bits(&again));
            prop_assert_eq!(&state, &state_again);
        }
    }
}
