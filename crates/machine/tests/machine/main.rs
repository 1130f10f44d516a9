//! What the doctor says of machines.

mod doctor;
mod machines;
mod quiet;
