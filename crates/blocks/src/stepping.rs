//! The loops that step the instances of a bank.

use crate::{Block, Cycle, Slots, Words};

pub(crate) type StepBank = fn(&mut [f64], &mut [u64], &Cycle<'_>) -> u64;

/// Like [`BlockType::step_bank`](crate::BlockType::step_bank), for instances whose inputs are the same except for the
/// first. The first inputs are in their slots, or come from a feed.
pub type StepShared = fn(Option<Feed<'_>>, &mut [f64], &mut [u64], &Cycle<'_>) -> u64;

/// The values that wires bring to a pin of each instance of a bank.
#[derive(Clone, Copy, Debug)]
pub struct Feed<'a> {
    /// The value for the first instance, and everything after it.
    pub values: &'a [f64],
    /// Distance between the values of two neighbouring instances; 0: all share one.
    pub stride: usize,
}

impl<'a> Feed<'a> {
    /// One value after the other; 0 where there are no more.
    #[inline]
    pub fn iter(self) -> impl Iterator<Item = f64> + 'a {
        let mut place = 0;
        core::iter::repeat_with(move || {
            let value = self.values.get(place).copied().unwrap_or_default();
            place += self.stride;
            value
        })
    }
}

/// Words of an instance: the state and, behind it, the buffer. A block without either still owns a word, so that image
/// and state divide into the same number of instances.
pub(crate) const fn state_words<B: Block>() -> usize {
    let words = B::State::LEN + B::BUFFER;
    if words == 0 { 1 } else { words }
}

pub(crate) fn step_bank<B: Block>(image: &mut [f64], state: &mut [u64], cycle: &Cycle<'_>) -> u64 {
    step_instances::<B, false>(None, image, state, cycle)
}

/// Types with more inputs are always stepped with the inputs of each instance: most of what they do depends on their
/// state, and a second loop cost `PID` 16 % where it saved nothing.
const MOST_SHARED_INPUTS: usize = 16;

pub(crate) const fn step_shared<B: Block>() -> Option<StepShared> {
    if B::Inputs::LEN <= MOST_SHARED_INPUTS { Some(step_instances::<B, true>) } else { None }
}

/// `SHARED`: all instances have the inputs of the first, except for their own first input.
#[inline(always)]
fn step_instances<B: Block, const SHARED: bool>(
    feed: Option<Feed<'_>>,
    image: &mut [f64],
    state: &mut [u64],
    cycle: &Cycle<'_>,
) -> u64 {
    let stride = B::Inputs::LEN + B::Outputs::LEN;
    let mut values = feed.map(Feed::iter);
    let mut shared = B::Inputs::read(image.get(..B::Inputs::LEN).unwrap_or_default());
    let mut errors = 0;
    for (slots, words) in
        image.chunks_exact_mut(stride).zip(state.chunks_exact_mut(state_words::<B>()))
    {
        let (input_slots, output_slots) = slots.split_at_mut(B::Inputs::LEN);
        let (words, buffer) = words.split_at_mut(B::State::LEN);
        let mut state = B::State::read(words);
        let outputs = if SHARED {
            if let Some(slot) = input_slots.first_mut() {
                if let Some(value) = values.as_mut().and_then(Iterator::next) {
                    *slot = value;
                }
                shared.set_first(*slot);
            }
            B::step_buffered(&mut state, buffer, &shared, cycle)
        } else {
            B::step_buffered(&mut state, buffer, &B::Inputs::read(input_slots), cycle)
        };
        state.write(words);
        outputs.write(output_slots);
        errors += u64::from(B::is_error(&outputs));
    }
    errors
}
