//! The C interface of isochrone. `include/isochrone.h` is generated from the comments here and is for those who use it;
//! `include/isochrone.hpp` is C++ on top of it. docs/cpp.md begins with the first program.
//!
//! Every function ends in a [status](status), checks its [handles](handles) and [arguments](arguments), and lets no panic
//! through. A [participant](participant) has one [ordinary thread](joined), so that the calls of a cycle touch nothing
//! but the ports of their own thread.
#![allow(non_camel_case_types, reason = "they are named as in C")]
#![allow(
    clippy::missing_safety_doc,
    reason = "the comments are those of the header, and C has no such section"
)]
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

#[cfg(not(target_pointer_width = "64"))]
compile_error!("a handle needs 64 bits");

// The header has them in this order.
pub mod status;

pub mod participant;

pub mod publisher;

pub mod subscriber;

pub mod client;

pub mod pace;

pub mod flags;

pub mod log;

mod arguments;
mod handles;
mod joined;
mod process;

#[cfg(test)]
mod cycle_tests;
