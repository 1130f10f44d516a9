//! The rules for every block, as a test of one line.
//!
//! ```
//! # mod half {
//! isochrone_blocks::block! {
//!     /// Half of a value.
//!     pub Half {
//!         inputs {
//!             /// The value.
//!             "x" => x: i16 = 0,
//!         }
//!         outputs {
//!             /// Half of it, towards zero.
//!             "y" => y: i16,
//!         }
//!     }
//! }
//! # impl isochrone_blocks::Block for Half {
//! #     fn step(_: &mut State, inputs: &Inputs, _: &isochrone_blocks::Cycle<'_>) -> Outputs {
//! #         Outputs { y: inputs.x / 2 }
//! #     }
//! # }
//! # }
//! # use half::Half;
//!
//! fn main() {
//!     isochrone_blocks::testing::check::<Half>();
//! }
//! ```

mod declared;
mod inputs;
mod names;
mod shared;
mod stored;

use alloc::vec;
use alloc::vec::Vec;

use crate::{Block, BlockType, Cycle, Declaration, Indication, Slots, Words, status};
use inputs::{Draws, Sequence};
use names::Named;
use stored::{Stored, bits};

/// Sequences of inputs that a block is stepped with.
const CASES: u64 = 300;
/// Cycles in which a block must have got over its inputs.
const RECOVERY_CYCLES: u64 = 10_000;

/// Steps a block with hundreds of sequences of inputs, extreme ones and such as it works with, and asserts that it
/// is what a node relies on:
///
/// - Its **declaration** compiles in a catalogue, its defaults are values of their pins, and its status words are
///   described and stand there once.
/// - **No input makes it panic**, and none makes an output that is NaN, infinite or not of its type: a block that
///   cannot compute reports [`status::NOT_FINITE`] and holds its outputs. An integer that overflows is
///   seen where arithmetic is checked, as in a test that is not built with optimisation.
/// - **Nothing stays broken**: with [`Block::typical`] as inputs, it reports no error after
///   10,000 cycles at the latest, if a new instance reports none with them. So no NaN stays in the state.
/// - It is **deterministic**: outputs and state follow from state, inputs and cycle alone, to the last bit, and
///   neither from the outputs before nor from other instances.
/// - Its **state** is the same when it was kept as words, as snapshots, `apply` and `replay` keep it.
/// - Its **error outputs agree**: `error` is TRUE exactly if `status` is an error, and `status` is
///   one of the declared words.
///
/// The inputs are the same in every run. A sequence that failed is named with its pins.
///
/// # Panics
/// The block is not so: the message says in what, and with which inputs.
pub fn check<B: Block>() {
    let block_type = BlockType::of::<B>();
    declared::check::<B>();
    for case in 0..CASES {
        let mut sequence = Sequence::new::<B>(case);
        let mut bank = Bank::<B>::new(case, &block_type, &mut sequence.draws);
        for _ in 0..sequence.cycles {
            bank.step(&mut sequence);
        }
        bank.recover(&sequence);
        shared::check::<B>(&block_type, case);
    }
}

/// Instances of a block that are stepped together, each alone, and each with its state as a struct.
struct Bank<'a, B: Block> {
    case: u64,
    block_type: &'a BlockType,
    together: Stored,
    alone: Stored,
    states: Vec<(B::State, Vec<u64>)>,
    inputs: Vec<Vec<f64>>,
}

impl<'a, B: Block> Bank<'a, B> {
    fn new(case: u64, block_type: &'a BlockType, draws: &mut Draws) -> Self {
        let instances = draws.between(1, 8) as usize;
        Self {
            case,
            block_type,
            together: Stored::new(block_type, instances),
            alone: Stored::new(block_type, instances),
            states: vec![(B::State::default(), vec![0; B::BUFFER]); instances],
            inputs: vec![inputs::typical::<B>(); instances],
        }
    }

    fn step(&mut self, sequence: &mut Sequence) {
        let block_type = self.block_type;
        let cycle = sequence.next_cycle();
        self.inputs.iter_mut().for_each(|inputs| sequence.draw::<B>(inputs));
        let (slots, words) = (block_type.slots(), block_type.state_words);
        let of_together = self.together.image.chunks_exact_mut(slots);
        let of_alone = self.alone.image.chunks_exact_mut(slots);
        for ((together, alone), inputs) in of_together.zip(of_alone).zip(&self.inputs) {
            // The outputs before are no part of what a step depends on.
            alone.fill(-7.0);
            for slots in [together, alone] {
                slots.iter_mut().zip(inputs).for_each(|(slot, input)| *slot = *input);
            }
        }
        let errors =
            block_type.step_bank(&mut self.together.image, &mut self.together.words, &cycle);
        let of_alone = self.alone.image.chunks_exact_mut(slots);
        let of_alone = of_alone.zip(self.alone.words.chunks_exact_mut(words));
        let errors_alone: u64 =
            of_alone.map(|(image, words)| block_type.step_bank(image, words, &cycle)).sum();
        assert!(
            bits(&self.together.image) == bits(&self.alone.image)
                && self.together.words == self.alone.words
                && errors == errors_alone,
            "{}, case {}, cycle {}: an instance does not do in a bank what it does alone, or does not do the \
             same again: its step depends on something beside its state, its inputs and the cycle",
            B::NAME,
            self.case,
            cycle.index()
        );
        let of_alone = self.alone.image.chunks_exact(slots);
        let states = self.alone.words.chunks_exact(words).zip(&mut self.states);
        for (index, (image, (words, state))) in of_alone.zip(states).enumerate() {
            let (inputs, outputs) = image.split_at(B::Inputs::LEN);
            let step = Step { case: self.case, cycle: cycle.index(), index, inputs, outputs };
            step.check_outputs::<B>();
            step.check_state::<B>(state, words, &cycle);
        }
    }

    /// Gives every instance typical inputs until it reports no error.
    fn recover(mut self, sequence: &Sequence) {
        let (slots, words) = (self.block_type.slots(), self.block_type.state_words);
        let typical = inputs::typical::<B>();
        let of_alone = self.alone.image.chunks_exact_mut(slots);
        for (index, (image, words)) in
            of_alone.zip(self.alone.words.chunks_exact_mut(words)).enumerate()
        {
            let mut fresh = Stored::new(self.block_type, 1);
            let is_over = (1..=RECOVERY_CYCLES).any(|after| {
                let cycle = sequence.cycle_after(after);
                let mut errors = [0, 0];
                let both =
                    [(&mut *image, &mut *words), (&mut fresh.image[..], &mut fresh.words[..])];
                for (errors, (image, words)) in errors.iter_mut().zip(both) {
                    image.iter_mut().zip(&typical).for_each(|(slot, input)| *slot = *input);
                    *errors = self.block_type.step_bank(image, words, &cycle);
                }
                // Inputs with which a new instance is in error say nothing.
                errors[0] == 0 || errors[1] != 0
            });
            let (inputs, outputs) = image.split_at(B::Inputs::LEN);
            assert!(
                is_over,
                "{}, case {}, instance {index}: after extreme inputs, {RECOVERY_CYCLES} cycles with the typical ones \
                 ({}) do not end the error: {}; take nothing into the state that is not finite",
                B::NAME,
                self.case,
                Named(B::INPUTS, inputs),
                Named(B::OUTPUTS, outputs)
            );
        }
    }
}

/// What an instance did in a cycle.
struct Step<'a> {
    case: u64,
    cycle: u64,
    index: usize,
    inputs: &'a [f64],
    outputs: &'a [f64],
}

impl Step<'_> {
    /// Asserts something of a step.
    fn expect<B: Declaration>(&self, is_so: bool, otherwise: &str) {
        let Self { case, cycle, index, inputs, outputs } = self;
        assert!(
            is_so,
            "{}, case {case}, cycle {cycle}, instance {index}: with {}, its outputs are {}: {otherwise}",
            B::NAME,
            Named(B::INPUTS, inputs),
            Named(B::OUTPUTS, outputs)
        );
    }

    fn check_outputs<B: Block>(&self) {
        let are_values = B::OUTPUTS.iter().zip(self.outputs);
        let mut are_values =
            are_values.map(|(pin, slot)| slot.is_finite() && pin.pin_type.holds(*slot));
        self.expect::<B>(
            are_values.all(|is_value| is_value),
            "an output is not finite; report status::NOT_FINITE and let the outputs hold",
        );
        let output = |name| B::OUTPUTS.iter().position(|pin| pin.name == name);
        let slot = |place: usize| self.outputs.get(place).copied().unwrap_or_default();
        let Some(indication @ Indication::Status(place)) = Indication::among(B::OUTPUTS) else {
            return;
        };
        let word = slot(place);
        self.expect::<B>(
            indication.is_error(word) == B::is_error(&B::Outputs::read(self.outputs)),
            "`is_error` does not say what `status` says",
        );
        if let Some(error) = output("error") {
            self.expect::<B>(
                (slot(error) != 0.0) == status::is_error(word as u16),
                "`error` is TRUE exactly if `status` is 16#8000 or above",
            );
        }
        let is_declared = B::STATUS.iter().any(|known| f64::from(known.code) == word);
        self.expect::<B>(
            is_declared || B::STATUS.is_empty(),
            "`status` is none of the words that the block declares",
        );
    }

    /// Steps the instance with its state as a struct.
    fn check_state<B: Block>(
        &self,
        (state, buffer): &mut (B::State, Vec<u64>),
        words: &[u64],
        cycle: &Cycle<'_>,
    ) {
        let outputs = B::step_buffered(state, buffer, &B::Inputs::read(self.inputs), cycle);
        let mut slots = vec![0.0; B::Outputs::LEN];
        outputs.write(&mut slots);
        let mut own = vec![0; words.len()];
        let (own_state, own_buffer) = own.split_at_mut(B::State::LEN);
        (*state).write(own_state);
        own_buffer.iter_mut().zip(buffer).for_each(|(word, kept)| *word = *kept);
        self.expect::<B>(
            bits(&slots) == bits(self.outputs) && own == words,
            "its state, kept as words and read again, is not what it was",
        );
    }
}
