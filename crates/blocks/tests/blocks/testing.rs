//! What the test of every block finds in blocks that are not what they must be, and arrays in a state.

use isochrone_blocks::{Block, BlockType, Cycle, Words, status, testing};

/// Declares a block with an input `x`, an output `y` and a status word, in a module of its own.
macro_rules! block_with_status {
    ($module:ident, $Block:ident, { $($state:tt)* }, $step:expr) => {
        mod $module {
            use super::*;

            isochrone_blocks::block! {
                /// A block of a test.
                pub(crate) $Block {
                    inputs {
                        /// Signal.
                        "x" => x: f64 = 0.0,
                    }
                    outputs {
                        /// What is made of it.
                        "y" => y: f64,
                        /// An error is reported in `status`.
                        "error" => error: bool,
                        /// Status word.
                        "status" => status: u16,
                    }
                    state { $($state)* }
                    status {
                        status::OK => "OK": "no error",
                        status::NOT_FINITE => "NOT_FINITE": "y is not finite",
                    }
                }
            }

            impl Block for $Block {
                fn step(state: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
                    let step: fn(&mut State, f64, &Cycle<'_>) -> (f64, u16) = $step;
                    let (y, status) = step(state, inputs.x, cycle);
                    Outputs { y, error: status::is_error(status), status }
                }
            }
        }
        use $module::$Block;
    };
}

block_with_status!(honest, Honest, {}, |_, x, _| {
    if x.is_finite() { (x, status::OK) } else { (0.0, status::NOT_FINITE) }
});

#[test]
fn a_block_that_holds_all_of_it_passes() {
    testing::check::<Honest>();
}

block_with_status!(passing, PassesOn, {}, |_, x, _| (x, status::OK));

#[test]
#[should_panic(expected = "report status::NOT_FINITE and let the outputs hold")]
fn a_value_that_is_not_finite_is_not_passed_on() {
    testing::check::<PassesOn>();
}

block_with_status!(corrupted, Corrupted, { sum: f64 }, |state, x, _| {
    state.sum += x;
    if state.sum.is_finite() { (state.sum, status::OK) } else { (0.0, status::NOT_FINITE) }
});

#[test]
#[should_panic(expected = "take nothing into the state that is not finite")]
fn what_is_not_finite_does_not_stay_in_the_state() {
    testing::check::<Corrupted>();
}

block_with_status!(undeclared, Undeclared, {}, |_, x, _| {
    if x.is_finite() { (x, status::OK) } else { (0.0, status::RANGE) }
});

#[test]
#[should_panic(expected = "`status` is none of the words that the block declares")]
fn a_status_word_is_declared() {
    testing::check::<Undeclared>();
}

static STEPS: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);
block_with_status!(counting, Counting, {}, |_, _, _| {
    (STEPS.fetch_add(1, std::sync::atomic::Ordering::Relaxed) as f64, status::OK)
});

#[test]
#[should_panic(expected = "depends on something beside its state, its inputs and the cycle")]
fn a_step_depends_on_nothing_beside_its_arguments() {
    testing::check::<Counting>();
}

block_with_status!(panicking, Panicking, {}, |_, x, _| {
    assert!(x > -1e300, "too far down");
    if x.is_finite() { (x, status::OK) } else { (0.0, status::NOT_FINITE) }
});

#[test]
#[should_panic(expected = "too far down")]
fn a_panic_of_a_block_comes_out() {
    testing::check::<Panicking>();
}

/// The value of so many cycles ago.
mod delay {
    use super::*;

    isochrone_blocks::block! {
        /// Delays a signal by 40 cycles.
        pub(crate) Delay {
            inputs {
                /// Signal.
                "x" => x: i16 = 0,
            }
            outputs {
                /// The signal of 40 cycles ago.
                "y" => y: i16,
            }
            state { last: [i16; 40], flags: [[bool; 2]; 3], next: u64 }
        }
    }

    impl Block for Delay {
        fn step(state: &mut State, inputs: &Inputs, _: &Cycle<'_>) -> Outputs {
            let place = (state.next % 40) as usize;
            let y = std::mem::replace(&mut state.last[place], inputs.x);
            state.flags[place % 3][place % 2] ^= true;
            state.next = (state.next + 1) % 40;
            Outputs { y }
        }
    }
}

#[test]
fn arrays_in_a_state_are_words_like_its_other_fields() {
    let delay = BlockType::of::<delay::Delay>();
    assert_eq!(delay.state_words, 40 + 6 + 1);
    testing::check::<delay::Delay>();
    let words: Vec<u64> = (0..47).map(|word| word % 2).collect();
    let state = delay::State::read(&words);
    let mut again = vec![7; delay.state_words];
    state.write(&mut again);
    assert_eq!(again, words);
    assert_eq!(delay::State::default(), delay::State::read(&[0; 47]));
}

#[test]
fn a_delay_gives_back_what_it_took_forty_cycles_before() {
    let delay = BlockType::of::<delay::Delay>();
    let (mut image, mut words) = (vec![0.0; 2], vec![0; delay.state_words]);
    for cycle in 0..200 {
        image[0] = f64::from(cycle);
        delay.step_bank(&mut image, &mut words, &Cycle::new(cycle as u64, 1_000_000, &[]));
        assert_eq!(image[1], f64::from((cycle - 40).max(0)));
    }
}
