//! A program of its own with a PID block, a moving average, a verb, and every verb of `isochrone`:
//!
//! ```text
//! cd examples/own_blocks
//! cargo run --release -- blocks Pid
//! cargo run --release -- simulate pid.toml --cycles 10
//! cargo run --release -- run pid.toml
//! cargo run --release -- settle --gain 20
//! cargo run --release -- --version
//! ```

mod moving_average;
mod pid;
mod settle;

use std::process::ExitCode;

use isochrone::prelude::*;
use isochrone_cli::Program;

/// With it, reports say what a cycle allocates.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    Program::new("own_blocks", env!("CARGO_PKG_VERSION"))
        .blocks(&[BlockType::of::<pid::Pid>(), BlockType::of::<moving_average::MovingAverage>()])
        .verb(settle::command(), settle::run)
        .main()
}
