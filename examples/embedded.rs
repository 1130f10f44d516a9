//! The fill level of `level.toml` inside an application's own process: no IPC, no second program.
//!
//! The application says what the sensor reads and takes the level. The configuration says what is
//! computed (`engine`), a thread of its own steps it every millisecond (`cyclic`), and the records
//! of its cycles say how punctual it was (`timing`).
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin embedded
//! ```
#![allow(clippy::print_stdout, reason = "showing values is what this program is for")]

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use isochrone_cyclic::{Clock, Cyclic, Monotonic, ThreadRequest, prepare_thread};
use isochrone_engine::{Plan, Rules, Source, TaskEngine};
use isochrone_timing::{CycleRecord, TaskTiming};

const CYCLES: usize = 100;
/// What is shown of a cycle: `signals` of the output in `level.toml`.
const SIGNALS: usize = 4;

/// Takes the place of a sensor: 16 mA (three quarters full), then more than 20 mA.
fn read_sensor(step: usize) -> f64 {
    if step <= 50 { 20736.0 } else { 30000.0 }
}

fn main() -> Result<(), Box<dyn Error>> {
    // What, and in what order: text -> plan -> engine. Strings end here; from now on an input is
    // its index among the task's inputs, an output likewise.
    let source = Source { name: "level.toml".into(), text: include_str!("level.toml").into() };
    let plan = Plan::new(source, &Rules::default())?;
    let task = plan.tasks.first().ok_or("there is no task")?;
    let input = task.inputs.iter().position(|input| input.name == "level_raw");
    let input = input.ok_or("there is no input level_raw")?;
    let mut engine = TaskEngine::build(&plan)?.pop().ok_or("there is no task")?;

    // When: cycle k is due at start + phase + k * period.
    let schedule = task.schedule;
    let request = ThreadRequest { priority: task.priority, cpu: None };
    let stop = Arc::new(AtomicBool::new(false)); // set it to end the loop early

    let mut frames = vec![[0.0; SIGNALS]; CYCLES];
    let mut records = Vec::with_capacity(CYCLES);
    let control = || {
        // May be refused, for want of rights; the loop then runs less punctually.
        let refusals = prepare_thread(request).refusals;
        let start_ns = Monotonic.now_ns() + schedule.period_ns;
        let mut cyclic = Cyclic::new(Monotonic, schedule, start_ns, stop);
        for (step, frame) in (1..).zip(&mut frames) {
            let Some(release) = cyclic.wait() else { break };
            engine.set_input(input, read_sensor(step), release.start_ns);
            engine.step(release.cycle);
            engine.read_output(0, frame);
            let end_ns = Monotonic.now_ns();
            cyclic.finished(end_ns);
            records.push(CycleRecord {
                cycle: release.cycle,
                release_ns: release.release_ns,
                start_ns: release.start_ns,
                end_ns,
                missed: release.missed,
                overruns: cyclic.overruns(),
            });
        }
        refusals
    };
    // A thread of its own, because real-time threads do not take signals: Ctrl-C stays with main.
    let refusals = std::thread::scope(|scope| scope.spawn(control).join())
        .map_err(|_| "the control thread panicked")?;
    for refusal in refusals {
        println!("note: {refusal}\n      {}", refusal.remedy());
    }

    println!("step  raw    level in m  ramp in m");
    for (step, frame) in (1..).zip(&frames).filter(|(step, _)| [1, 2, 50, 51, 100].contains(step)) {
        let [raw, level, ramp, _heartbeat] = frame;
        println!("{step:<4}  {raw:<5}  {level:<10}  {ramp}");
    }
    let mut timing = TaskTiming::new(schedule.period_ns).with_warm_up(10);
    records.iter().for_each(|record| timing.record(record));
    let report = timing.report(&task.name);
    let jitter = report.release_jitter_ns;
    println!("{} cycles, {} missed", report.cycles, report.missed);
    let [p50, p90, max] = [jitter.p50, jitter.p90, jitter.max].map(Option::unwrap_or_default);
    println!("release jitter in ns: p50 {p50}, p90 {p90}, max {max}");
    Ok(())
}
