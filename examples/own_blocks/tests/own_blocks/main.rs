//! A block of one's own, in a closed loop and in a program.

mod closed_loop;
#[path = "../../src/pid.rs"]
mod pid;
mod program;
