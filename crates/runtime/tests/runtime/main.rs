//! Nodes in this process and in others, and the requests that they answer.

mod apply;
mod embedding;
mod follow;
mod happened;
mod journal;
mod journal_rotation;
mod journal_thread;
mod journalled;
mod node;
mod panics;
mod recording;
mod sharing;
mod stands;
mod supervisor;
mod twins;

use isochrone_cyclic::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
