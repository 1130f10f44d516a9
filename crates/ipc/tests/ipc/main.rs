//! Ports, services and those who hold them, over real shared memory.

#[macro_use]
mod domain;

mod frames;
mod killed_clients;
mod layouts;
mod listing;
mod lives;
mod memory;
mod services;
mod writers;
