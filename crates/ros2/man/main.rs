//! Writes the man page of `isochrone-ros2` into a folder, for the package:
//!
//! ```sh
//! cargo run --manifest-path crates/ros2/Cargo.toml --target-dir target/reach --features man --bin man_page -- FOLDER
//! ```

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let Some(folder) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err(std::io::Error::other("give the folder for the man page"));
    };
    std::fs::create_dir_all(&folder)?;
    clap_mangen::generate_to(isochrone_ros2::command(), folder)
}
