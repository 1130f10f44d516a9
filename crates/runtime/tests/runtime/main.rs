//! Nodes in this process and in others, and the requests that they answer.

mod apply;
mod embedding;
mod follow;
mod journal;
mod journal_thread;
mod journalled;
mod late_polls;
mod node;
mod panics;
mod polling;
mod recording;
mod stands;

use isochrone_cyclic::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
