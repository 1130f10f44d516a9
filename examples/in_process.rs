//! A node and an application in one process, connected by the same ports that connect processes.
//! Nothing leaves the process; with `Participant::join` in place of `join_local`, the same code
//! exchanges data with other programs through shared memory.
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin in_process
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::time::Duration;

use isochrone::prelude::*;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plan = Plan::new(Source::new("level.toml", include_str!("level.toml")), &Rules::default())?;
    let domain = Domain::find()?;
    let application = Participant::join_local("application", &domain)?;
    let mut levels = FrameSubscriber::open(&application, "plant/level", 4, Depth::Newest)?;
    let raw = FrameLayout { signals: vec![SignalSpec::new("raw", "LREAL")], period_ns: None };
    let mut sensor = FramePublisher::open(&application, "plant/analog", &raw)?.plain();

    let node = Node::prepare(&plan, Participant::join_local("level", domain)?)?.start();
    let mut level_m = 0.0;
    // On the grid of the node's task, just ahead of its releases: it reads each value at once.
    let mut pace = Pace::new(Duration::from_millis(10), Duration::from_micros(9_850));
    while let Some(release) = pace.wait()
        && level_m < 1.2
        && node.is_running()
    {
        if let Some([raw]) = sensor.values_mut() {
            *raw = 20736.0; // 16 mA, three quarters full
        }
        sensor.send(release.into(), || Monotonic.now_ns());
        sensor.prepare();
        let newest = levels.newest(Monotonic.now_ns());
        if let Some([_raw, level, ..]) = newest.as_ref().map(|frame| frame.values()) {
            level_m = *level; // read in place, without a copy
        }
        application.tend(); // has failed connections tried again
    }
    println!("level {level_m} m, node {:?}", node.finish()?.end);
    Ok(())
}
