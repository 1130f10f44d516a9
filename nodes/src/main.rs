//! The program `isochrone`: the library's command line, with the blocks that come with it.

use std::process::ExitCode;

use isochrone_cyclic::CountingAllocator;

/// Counts the allocations of every thread, so that reports can say what the cycle allocates.
#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn main() -> ExitCode {
    isochrone_cli::main(&[])
}
