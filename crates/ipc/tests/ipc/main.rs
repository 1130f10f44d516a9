//! Ports, services and those who hold them, over real shared memory.

#[macro_use]
mod variants;

mod frames;
mod killed_clients;
mod layouts;
mod listing;
mod lives;
mod memory;
mod newest_frames;
mod repaired_requests;
mod requests;
mod services;
mod signal_reader;
mod sleeping_readers;
mod writers;
