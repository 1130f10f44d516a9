//! Plants, for loops that are simulated in one configuration.

pub mod dead_time;
