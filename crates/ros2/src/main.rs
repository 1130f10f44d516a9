//! `isochrone-ros2`: see the crate.

use std::process::ExitCode;

fn main() -> ExitCode {
    isochrone_ros2::main()
}
