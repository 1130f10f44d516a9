//! The fill level of `level.toml` inside an application's own process: no IPC, no second program.
//!
//! The application sets the sensor value and reads the level; the node computes it every millisecond in
//! its own thread.
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin embedded
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::error::Error;

use isochrone::prelude::*;

const CONFIGURATION: &str = include_str!("level.toml");

fn main() -> Result<(), Box<dyn Error>> {
    let plan = Plan::new(Source::new("level.toml", CONFIGURATION), &Rules::default())?;
    let node = Node::prepare_alone(&plan)?;
    // Without permission for real-time scheduling, the node still runs, with more jitter.
    for refusal in node.refusals() {
        println!("note: {refusal}\n      {}", refusal.remedy());
    }
    let node = node.with_cycles(Some(500)).start();
    // What the sensor reads: 16 mA, three quarters full.
    node.set([("level_raw", 20736.0)])?;
    node.wait();
    for name in ["level_raw", "level.y", "ramp.delayedValue"] {
        println!("{name} = {}", said(node.value(name)));
    }
    for task in node.finish()?.tasks {
        let jitter = task.release_jitter_ns;
        let [p50, p90, max] = [jitter.p50, jitter.p90, jitter.max].map(said);
        println!("{} cycles, {} missed", task.cycles, task.missed);
        println!("release jitter in ns: p50 {p50}, p90 {p90}, max {max}");
    }
    Ok(())
}

/// A quantity, or that it was not measured.
fn said<T: std::fmt::Debug>(measured: Option<T>) -> String {
    measured.map_or_else(|| "not measured".into(), |value| format!("{value:?}"))
}
