//! Writes the man pages of `isochrone` into a folder: one of the program, and one of each verb.
//!
//! ```sh
//! cargo run -p isochrone-packaging -- FOLDER
//! ```

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err(std::io::Error::other("give the folder for the man pages"));
    };
    std::fs::create_dir_all(&folder)?;
    clap_mangen::generate_to(isochrone_cli::command(), folder)
}
