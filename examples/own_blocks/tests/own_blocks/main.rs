//! Blocks of one's own, in a closed loop and in a program.

mod closed_loop;
#[path = "../../src/moving_average.rs"]
mod moving_average;
#[path = "../../src/pid.rs"]
mod pid;
mod program;

use isochrone::blocks::testing::check;

#[test]
fn the_blocks_are_what_blocks_must_be() {
    check::<pid::Pid>();
    check::<moving_average::MovingAverage>();
}
