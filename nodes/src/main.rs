//! The program `isochrone`: the library's command line, with the blocks that come with it.

use std::process::ExitCode;

fn main() -> ExitCode {
    isochrone_cli::main()
}
