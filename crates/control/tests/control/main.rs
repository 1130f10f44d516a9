//! The protocol of a node's control service: its texts, its page, and clients that ask.

mod asking;
mod operated;
mod requests_text;

use isochrone_cyclic::CountingAllocator;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;
