//! Reads the frames of a service and sleeps in between: it uses next to no CPU time, and the thread that
//! sends makes no system call for it.
//!
//! Start a node (`isochrone run examples/level.toml`, or `isochrone demo`), then:
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin reader -- [SERVICE] [FRAMES]
//! ```
//!
//! SERVICE defaults to plant/level and FRAMES to 5. Exit status: 0 done, 1 the service cannot be read, 3
//! nothing was published for five seconds. The environment variable ICEORYX2_CONFIG names the
//! configuration of the domain to join; otherwise it is iceoryx2's own.
#![allow(clippy::print_stdout, reason = "showing frames is what this program is for")]

use std::error::Error;
use std::process::ExitCode;

use isochrone::cyclic::{Clock, Monotonic};
use isochrone::ipc::{Depth, FrameSubscriber, LayoutWatcher};
use isochrone::prelude::*;
use isochrone::runtime::FrameWait;

/// How long without a frame is too long.
const PATIENCE_NS: u64 = 5_000_000_000;
/// Between two looks for announcements and failed connections.
const CARE_NS: u64 = 20_000_000;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let service = arguments.next().unwrap_or_else(|| "plant/level".into());
    let frames: u32 =
        arguments.next().map_or(Ok(5), |text| text.parse()).map_err(|_| "FRAMES is a number")?;

    let participant = Participant::<ipc::Service>::join("reader", Domain::find()?)?;
    // The writer may start later. It is expected to send some four values.
    let mut subscriber = FrameSubscriber::open(&participant, &service, 4, Depth::All)?;
    let mut layouts = LayoutWatcher::open(&participant, &service)?;
    let wait = FrameWait::in_this_thread();
    let (mut read, mut heard_ns) = (0, Monotonic.now_ns());
    while read < frames {
        let care_ns = Monotonic.now_ns() + CARE_NS;
        while let Some(frame) = wait.next(&mut subscriber, care_ns) {
            heard_ns = Monotonic.now_ns();
            let age_us = heard_ns.saturating_sub(frame.header().publish_ns) as f64 / 1e3;
            println!("frame {}, {age_us} us old: {:?}", frame.header().sequence, frame.values());
            read += 1;
            if read == frames || heard_ns >= care_ns {
                break;
            }
        }
        participant.tend();
        subscriber.maintain();
        // A known period helps from the first frame on; otherwise it is learned from a few frames.
        if layouts.look(&participant)
            && let Some(announced) = layouts.newest()
        {
            subscriber.set_period(announced.layout.period_ns.unwrap_or_default());
        }
        if Monotonic.now_ns() - heard_ns > PATIENCE_NS {
            println!("no frames on {service}");
            return Ok(ExitCode::from(3));
        }
    }
    println!("{} lost", subscriber.counters().lost);
    Ok(ExitCode::SUCCESS)
}
