//! Configurations, plans, steps and orders, without a clock.

mod build;
mod configuration;
mod differential;
mod expressions;
mod findings;
mod golden;
mod inputs;
mod no_allocation;
mod one_task;
mod order;
mod own_blocks;
mod quality;
mod rows;
mod shared_inputs;
mod tasks;
mod two_tasks;
mod warm_start;
