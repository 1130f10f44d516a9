//! Nodes in this process and in others, and the requests that they answer.

mod apply;
mod control;
mod control_page;
mod embedding;
mod follow;
mod frame_wait;
mod journal;
mod journal_thread;
mod journalled;
mod late_polls;
mod node;
mod operated;
mod panics;
mod polling;
mod recording;
mod requests_text;
mod stands;

use isochrone_cyclic::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
