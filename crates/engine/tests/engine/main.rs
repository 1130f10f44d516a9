//! Configurations, plans, steps and operating, without a clock.

mod build;
mod configuration;
mod differential;
mod findings;
mod golden;
mod graphs;
mod inputs;
mod no_allocation;
mod one_task;
mod operate;
mod operate_random;
mod order;
mod own_blocks;
mod quality;
mod rows;
mod tasks;
mod two_tasks;
