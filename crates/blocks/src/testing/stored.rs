//! Instances as a node keeps them.

use alloc::vec;
use alloc::vec::Vec;

use crate::BlockType;

/// The slots and the state words of some instances.
pub(super) struct Stored {
    pub(super) image: Vec<f64>,
    pub(super) words: Vec<u64>,
}

impl Stored {
    pub(super) fn new(block_type: &BlockType, instances: usize) -> Self {
        let (slots, words) = (block_type.slots(), block_type.state_words);
        Self { image: vec![0.0; instances * slots], words: vec![0; instances * words] }
    }
}

pub(super) fn bits(slots: &[f64]) -> Vec<u64> {
    slots.iter().map(|slot| slot.to_bits()).collect()
}
