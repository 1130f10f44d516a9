//! Instances that share all inputs but the first.

use alloc::vec;
use alloc::vec::Vec;

use super::inputs::{self, Sequence};
use super::stored::{Stored, bits};
use crate::{Block, BlockType, Feed, Slots};

const INSTANCES: usize = 3;

/// Asserts that the loop for such instances does with each what a step of it alone does.
pub(super) fn check<B: Block>(block_type: &BlockType, case: u64) {
    let Some(step) = block_type.step_shared() else { return };
    let (slots, words) = (block_type.slots(), block_type.state_words);
    let mut sequence = Sequence::new::<B>(case);
    let (mut as_one, mut alone) =
        (Stored::new(block_type, INSTANCES), Stored::new(block_type, INSTANCES));
    let mut drawn = vec![inputs::typical::<B>(); INSTANCES];
    for _ in 0..sequence.cycles {
        let cycle = sequence.next_cycle();
        drawn.iter_mut().for_each(|inputs| sequence.draw::<B>(inputs));
        let firsts: Vec<f64> = drawn.iter().map(|inputs| first(inputs)).collect();
        // A feed brings every other value.
        let values: Vec<f64> = firsts.iter().flat_map(|value| [*value, -7.0]).collect();
        let feed = Feed { values: &values, stride: 2 };
        let feed = Some(feed).filter(|_| B::Inputs::LEN > 0 && cycle.index() % 2 == 1);
        let shared = drawn.iter().take(1).flatten();
        let of_one = as_one.image.chunks_exact_mut(slots);
        for ((one, alone), value) in of_one.zip(alone.image.chunks_exact_mut(slots)).zip(&firsts) {
            for slots in [&mut *one, alone] {
                slots.iter_mut().zip(shared.clone()).for_each(|(slot, input)| *slot = *input);
                if let (Some(slot), true) = (slots.first_mut(), B::Inputs::LEN > 0) {
                    *slot = *value;
                }
            }
            if let (Some(slot), true) = (one.first_mut(), feed.is_some()) {
                *slot = -7.0;
            }
        }
        let errors = step(feed, &mut as_one.image, &mut as_one.words, &cycle);
        let of_alone = alone.image.chunks_exact_mut(slots).zip(alone.words.chunks_exact_mut(words));
        let errors_alone: u64 =
            of_alone.map(|(image, words)| block_type.step_bank(image, words, &cycle)).sum();
        assert!(
            bits(&as_one.image) == bits(&alone.image)
                && as_one.words == alone.words
                && errors == errors_alone,
            "{}, case {case}, cycle {}: instances that share all inputs but the first do not do together what each \
             does alone: a step depends on something beside its state, its inputs and the cycle",
            B::NAME,
            cycle.index()
        );
    }
}

fn first(inputs: &[f64]) -> f64 {
    inputs.first().copied().unwrap_or_default()
}
