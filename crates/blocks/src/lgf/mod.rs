//! Signals and filters after Siemens' Library of General Functions (LGF), and two of its kind that LGF does not have.

pub mod difference_quotient;
pub mod floating_average;
pub mod hysteresis;
pub mod integration;
pub mod low_pass;
pub mod non_linear_interpolation;
pub mod rectangle;
pub mod sinus;
pub mod triangle;

mod generator;
mod sum;
