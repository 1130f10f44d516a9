//! Rules for a declaration beyond what the compiler sees.

use alloc::vec;

use crate::{Block, PinDefault, Slots, Words};

/// Asserts that defaults are values of their pins, that status words are described and stand there once, and that
/// the initial state is all zero.
pub(super) fn check<B: Block>() {
    let mut slots = vec![0.0; B::Inputs::LEN];
    B::Inputs::default().write(&mut slots);
    for (pin, slot) in B::INPUTS.iter().zip(slots) {
        if let PinDefault::Value(default) = pin.default {
            assert!(
                pin.pin_type.holds(default) && default.to_bits() == slot.to_bits(),
                "{}.{}: its default {default:?} is no {}",
                B::NAME,
                pin.name,
                pin.pin_type
            );
        }
    }
    for (index, word) in B::STATUS.iter().enumerate() {
        let is_said = !word.name.is_empty() && !word.meaning.is_empty();
        assert!(is_said, "{}: say what the status word 16#{:04X} means", B::NAME, word.code);
        let is_first = B::STATUS.iter().take(index).all(|other| other.code != word.code);
        assert!(is_first, "{}: the status word 16#{:04X} stands twice", B::NAME, word.code);
    }
    let mut words = vec![1; B::State::LEN];
    B::State::default().write(&mut words);
    assert!(words.iter().all(|word| *word == 0), "{}: its initial state is not all zero", B::NAME);
}
