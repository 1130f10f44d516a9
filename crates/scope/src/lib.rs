//! **Shots**: what signals did around an instant, cycle by cycle.
//!
//! A [`Trigger`] is a text such as `ramp.delayedValue > 1.0`. A [`Capture`] is given the rows of one or
//! several tasks as they come, keeps as many as lie before a trigger, and makes a [`Shot`] of those around
//! it. [`columns`] and [`Ticks`] say what a chart shows of a shot, however it is drawn.
//!
//! No clock and no I/O: the same rows make the same shot. All times are ns of one clock, whichever it is.
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

mod capture;
mod columns;
mod comparator;
mod decimation;
mod edge;
mod rows;
mod shot;
mod ticks;
mod trigger;
mod undrawable;
mod window;

pub use capture::{Capture, ObservedTask, TriggerSearch};
pub use columns::{Column, Extremes, Span, columns};
pub use comparator::Comparator;
pub use decimation::Decimation;
pub use edge::{Condition, Edge};
pub use rows::{Head, Rows};
pub use shot::{Gap, Shot, Track, TrackSignal, Triggered};
pub use ticks::Ticks;
pub use trigger::{Kind, Trigger, TriggerError};
pub use undrawable::Undrawable;
pub use window::Window;
