//! The executor and what it counts, on the real kernel.

mod allocations;
mod process;
