//! What the doctor says of machines.

mod checks;
mod doctor;
mod machines;
mod quiet;
