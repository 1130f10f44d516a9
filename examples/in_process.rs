//! A node and an application in one process, connected by the same ports that connect processes: only
//! the service variant differs.
//!
//! With `local::Service` nothing leaves the process. With `ipc::Service` instead, the same code
//! exchanges data with other programs through shared memory.
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin in_process
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::error::Error;

use isochrone::cyclic::{Clock, Monotonic};
use isochrone::ipc::{Depth, FrameLayout, FramePublisher, FrameSubscriber, SignalSpec, Stamp};
use isochrone::prelude::*;

type Service = local::Service;

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::new(Source::new("level.toml", include_str!("level.toml")), &Rules::default())?;
    let domain = Domain::find()?;
    let application = Participant::<Service>::join("application", &domain)?;
    let mut levels = FrameSubscriber::open(&application, "plant/level", 4, Depth::Newest)?;
    let raw = FrameLayout { signals: vec![SignalSpec::new("raw", "LREAL")], period_ns: None };
    let mut sensor = FramePublisher::open(&application, "plant/analog", &raw)?.plain();

    let mut node = Node::prepare(&plan, Participant::<Service>::join("level", &domain)?)?.start();
    let (mut level_m, mut frames) = (0.0, 0);
    while level_m < 1.2 && node.poll().is_running() {
        if let Some([raw]) = sensor.values_mut() {
            *raw = 20736.0; // 16 mA, three quarters full
        }
        sensor.send(Stamp { cycle: frames, ..Stamp::default() }, || Monotonic.now_ns());
        sensor.prepare();
        frames += 1;
        if let Some([_raw, level, ..]) =
            levels.newest(Monotonic.now_ns()).as_ref().map(|f| f.values())
        {
            level_m = *level; // read in place, without a copy
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    println!("level {level_m} m, node {:?}", node.finish()?.end);
    Ok(())
}
