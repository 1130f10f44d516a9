//! `demo --redundant`: a node in two processes, of which the one that holds it is killed each second.

use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, FrameSubscriber, Participant, TwinPage};
use isochrone_processes::{Child, ChildError, Company, Stop};

use crate::base::failure::Failure;
use crate::base::terminal;

/// A ramp that moves by 0.2 in each cycle of 10 ms.
const CONFIGURATION: &str = r#"[node]
name = "ramp"
[[task]]
name = "fast"
period = "10ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = 1e6, setChangeRate = 20.0 }
[[output]]
service = "demo/ramp"
signals = ["ramp.delayedValue"]
"#;
const OUTPUT: &str = "demo/ramp";
const STEP: f64 = 0.2;
/// Between two kills, once the other process can take over.
const BETWEEN_KILLS: Duration = Duration::from_secs(1);
const LOOK: Duration = Duration::from_millis(5);
/// A line is drawn every so many cycles.
const CYCLES_A_LINE: u64 = 10;
/// Columns of the drawing; the ramp wraps around.
const COLUMNS: f64 = 40.0;

/// Runs it until it is stopped.
pub(super) fn run(stop: &Stop) -> Result<(), Failure> {
    let company = Company::gather("isotwins")?;
    company.write("ramp.toml", CONFIGURATION)?;
    let start = || {
        company.start_with(&["run", "ramp.toml", "--redundant"], |command| {
            let command = command.args(company.in_domain()).stdin(Stdio::null());
            command.stdout(Stdio::null()).stderr(Stdio::null())
        })
    };
    let mut processes = vec![start()?];
    let participant =
        Participant::join("isochrone/demo", company.domain()).map_err(Failure::found)?;
    let mut ramp =
        FrameSubscriber::open(&participant, OUTPUT, 1, Depth::All).map_err(Failure::found)?;
    let mut seen = Seen::default();
    let mut due = Instant::now() + BETWEEN_KILLS;
    while !stop.is_due() {
        ramp.maintain();
        participant.tend();
        while let Some(frame) = ramp.next(Monotonic.now_ns()) {
            let header = frame.header();
            let value = frame.values().first().copied().unwrap_or_default();
            seen.take(header.term, header.cycle, value)?;
        }
        if processes.len() == 1 && seen.frames > 0 {
            // The first one sits in the first seat by now.
            processes.push(start()?);
            due = Instant::now() + BETWEEN_KILLS;
        }
        if Instant::now() >= due && processes.len() == 2 && seen.has_followed() {
            due = Instant::now() + BETWEEN_KILLS;
            kill_holder(&mut processes, seen.holder(), &start)?;
        }
        thread::sleep(LOOK);
    }
    for process in &mut processes {
        process.kill()?;
    }
    terminal::print(&seen.summary())
}

/// Kills the process that holds the node, and starts another one as the standby of the other.
fn kill_holder(
    processes: &mut [Child],
    seat: u64,
    start: &impl Fn() -> Result<Child, ChildError>,
) -> Result<(), Failure> {
    // The first process has the first seat, and whoever takes the place of a killed one has its seat.
    let index = usize::from(seat == 2);
    let Some(process) = processes.get_mut(index) else { return Ok(()) };
    terminal::print(&format!("process {} is killed\n", process.id()))?;
    process.kill()?;
    *process = start()?;
    Ok(())
}

/// What the frames have shown.
#[derive(Default)]
struct Seen {
    term: u64,
    cycle: u64,
    value: f64,
    frames: u64,
    takeovers: u64,
    most_lost: u64,
    /// Cycles since the last takeover.
    since: u64,
}

impl Seen {
    fn take(&mut self, term: u64, cycle: u64, value: f64) -> Result<(), Failure> {
        if self.frames > 0 && term != self.term {
            let lost = cycle.saturating_sub(self.cycle).saturating_sub(1);
            (self.takeovers, self.since) = (self.takeovers + 1, 0);
            self.most_lost = self.most_lost.max(lost);
            let moved = value - self.value;
            terminal::print(&format!(
                "the other one has taken over: {lost} cycles without a frame, and the ramp moved by {moved:.1}\n"
            ))?;
        }
        (self.term, self.cycle, self.value) = (term, cycle, value);
        (self.frames, self.since) = (self.frames + 1, self.since + 1);
        if self.frames.is_multiple_of(CYCLES_A_LINE) {
            let column = (value / STEP / CYCLES_A_LINE as f64) % COLUMNS;
            let line = format!("{:>1$}", "*", column as usize + 1);
            terminal::print(&format!("cycle {cycle:>6}  {value:>8.1}  {line}\n"))?;
        }
        Ok(())
    }

    /// Whether the process that holds the node has done so for long enough to be followed.
    fn has_followed(&self) -> bool {
        self.since >= 50
    }

    fn holder(&self) -> u64 {
        TwinPage::seat_of(self.term)
    }

    fn summary(&self) -> String {
        let Self { frames, takeovers, most_lost, .. } = self;
        format!(
            "\n{frames} frames of {} processes; {takeovers} takeovers, at most {most_lost} cycles without a frame\n",
            takeovers + 1
        )
    }
}
