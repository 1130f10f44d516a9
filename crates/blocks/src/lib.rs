//! Function blocks for cyclic control, after Siemens' Library of General Functions (LGF): two
//! ramps, a linear scale and a sawtooth.
//!
//! A block is one file. It declares its pins once with [`block!`](crate::block!) and implements
//! [`Block::step`], a pure Mealy machine: `(state, inputs, cycle) -> outputs`. Time is passed in as
//! an argument. There is no clock, I/O, allocation or unsafe code here.
//!
//! Making a plan (`Plan::new`, `isochrone check`) tries the constants of a configuration on these
//! blocks: it steps each of them, with invented values where wires lead, and warns of constants with
//! which it can only report an error. A block of your own is not stepped before a node, a simulation or
//! a bench runs it, so it gets no such warning; only its declaration is checked.
//!
//! ```
//! use isochrone_blocks::{Block, Cycle, lim_rate_of_change::{Inputs, LimRateOfChangeCI, State}};
//!
//! let mut state = State::default();
//! let inputs = Inputs { value: 25.0, set_change_rate: 10.0, ..Inputs::default() };
//! let cycle = Cycle::new(0, 100_000_000, &[]); // the first call of a 100 ms task
//! let outputs = LimRateOfChangeCI::step(&mut state, &inputs, &cycle);
//! assert_eq!(outputs.delayed_value, 1.0);
//! ```
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]
#![no_std]
#![forbid(unsafe_code)]

extern crate alloc;

mod block;
mod block_type;
mod cycle;
mod decisions;
mod declare;
mod description;
mod indication;
mod stepping;
mod value;
mod well_formed;

pub mod alarm;
pub mod condition;
pub mod expr;
pub mod formulas;
pub mod iec;
pub mod lgf;
pub mod lim_rate_of_change;
pub mod lim_rate_of_change_advanced;
pub mod literal;
pub mod pid;
pub mod plants;
pub mod saw_tooth;
pub mod scale_linear;
pub mod status;
pub mod testing;

pub use block::Block;
pub use block_type::BlockType;
pub use cycle::{Cycle, is_cyclic_ob};
pub use description::{Caution, Decision, Declaration, Origin, Pin, PinDefault, StatusWord};
pub use formulas::OutputProgram;
pub use indication::Indication;
pub use stepping::{Feed, StepShared};
pub use value::{Ob, PinType, PinValue, Slots, StateField, Words};

/// Makes the catalogue of the block types in it, and a test that each is what a block must be.
macro_rules! catalogue {
    ($($block:ty,)*) => {
        /// Every block type of this library.
        pub static CATALOGUE: &[BlockType] = &[$(BlockType::of_library::<$block>(),)*];

        #[cfg(test)]
        #[test]
        fn every_block_of_the_library_is_what_a_block_must_be() {
            $(testing::check::<$block>();)*
        }
    };
}

/// What each `Expr` of a configuration is made of: the block without expressions. It is in no catalogue, as it has no
/// pins before a configuration gives it some.
pub static EXPR: BlockType = BlockType::of_formulas(&[], &[formulas::STATUS], &[]);

/// What `[[alarm]]` in a configuration is made of. No `[[block]]` has this type, and no operator sees its inputs.
pub static ALARM: BlockType = BlockType::of_alarm::<alarm::Alarm>();

// One line here makes a block available to the configuration, the catalogue and the documentation; the tests
// report anything else that it needs.
catalogue! {
    lim_rate_of_change::LimRateOfChangeCI,
    lim_rate_of_change_advanced::LimRateOfChangeAdvancedCI,
    scale_linear::ScaleLinear,
    saw_tooth::SawTooth,
    lgf::sinus::SinusCI,
    lgf::rectangle::RectangleCI,
    lgf::triangle::TriangleCI,
    lgf::floating_average::FloatingAverage,
    lgf::low_pass::LowPassCI,
    lgf::hysteresis::Hysteresis,
    lgf::difference_quotient::DifferenceQuotientFB,
    lgf::integration::Integration,
    lgf::non_linear_interpolation::NonLinearInterpolation,
    iec::r_trig::RTrig,
    iec::f_trig::FTrig,
    iec::sr::Sr,
    iec::rs::Rs,
    iec::ton::Ton,
    iec::tof::Tof,
    iec::tp::Tp,
    iec::ctu::Ctu,
    iec::ctd::Ctd,
    iec::ctud::Ctud,
    pid::PID,
    plants::pt1::PlantPT1,
    plants::pt2::PlantPT2,
    plants::integrator::PlantIntegrator,
    plants::dead_time::DeadTime,
}
