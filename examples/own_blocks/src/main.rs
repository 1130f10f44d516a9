//! A program of its own with a PID block and every verb of `isochrone`:
//!
//! ```text
//! cd examples/own_blocks
//! cargo run --release -- blocks Pid
//! cargo run --release -- simulate pid.toml --cycles 10
//! cargo run --release -- run pid.toml
//! ```

mod pid;

use std::process::ExitCode;

use isochrone::prelude::*;

/// With it, reports say what a cycle allocates.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    isochrone_cli::main(&[BlockType::of::<pid::Pid>()])
}
