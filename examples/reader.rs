//! Reads the signals of a service by their names and sleeps in between; the thread that sends makes no system call
//! for it.
//!
//! Start a node (`isochrone run examples/level.toml`, or `isochrone demo`), then:
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin reader -- [SERVICE] [FRAMES] [NAME …]
//! ```
//!
//! SERVICE defaults to plant/level and FRAMES to 5; without names, all signals are shown. Exit status: 0 done, 1
//! the service cannot be read or lacks a signal, 3 nothing was published for five seconds. The environment variable
//! ICEORYX2_CONFIG names the configuration of the domain to join; otherwise it is iceoryx2's own.
#![allow(clippy::print_stdout, reason = "showing frames is what this program is for")]

use std::error::Error;
use std::process::ExitCode;
use std::time::Duration;

use isochrone::prelude::*;

/// How long without a frame is too long.
const PATIENCE: Duration = Duration::from_secs(5);

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let service = arguments.first().map_or("plant/level", String::as_str);
    let frames: u32 =
        arguments.get(1).map_or(Ok(5), |text| text.parse()).map_err(|_| "FRAMES is a number")?;
    let names: Vec<&str> = arguments.iter().skip(2).map(String::as_str).collect();

    let participant = Participant::<ipc::Service>::join("reader", Domain::find()?)?;
    // The writer may start later.
    let mut reader = SignalReader::open(&participant, service, &names)?;
    let mut lost = 0;
    for _ in 0..frames {
        let Some(frame) = reader.wait(PATIENCE) else {
            println!("no frames on {service}");
            return Ok(ExitCode::from(3));
        };
        lost += frame.lost();
        let age_us = frame.age_ns().map_or(f64::NAN, |age_ns| age_ns as f64 / 1e3);
        if frame.flags().is_in_doubt() {
            println!("in doubt: {}", frame.flags());
        }
        let values: Vec<_> = frame.values()?.collect();
        println!("frame {}, {age_us} us old: {values:?}", frame.sequence());
    }
    println!("{lost} lost");
    Ok(ExitCode::SUCCESS)
}
