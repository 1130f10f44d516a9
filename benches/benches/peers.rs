//! What peers cost the cycle: eight that watch its telemetry, and twenty a second that come and go.
//!
//! The arms take turns, forth and back. `quiet` and `quiet again` are the same thing twice: what lies
//! between them is noise. Peers run on another CPU than the node, so that they meet it in shared
//! memory only.
//!
//! ```text
//! cargo bench -p isochrone-benches --bench peers -- --rounds 10 --seconds 6
//! ```

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::Parser;
use isochrone_benches::{Bench, Failure, take_turns, us};
use isochrone_processes::Child;
use isochrone_timing::{Distribution, TaskReport};

#[derive(Parser)]
struct Args {
    /// Turns of each arm
    #[arg(long, default_value_t = 10)]
    rounds: usize,
    /// Length of a turn
    #[arg(long, default_value_t = 6.0)]
    seconds: f64,
    /// CPU of the node
    #[arg(long, default_value_t = 1)]
    cpu: u32,
    /// CPUs of the peers
    #[arg(long, default_value = "0")]
    peer_cpus: String,
    /// Arms, by name
    #[arg(long, value_delimiter = ',', default_value = "quiet,quiet again,observers,storm")]
    arms: Vec<String>,
    /// Only see whether every arm runs
    #[arg(long)]
    test: bool,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

const OBSERVERS: usize = 8;
/// Twenty a second.
const STORM_INTERVAL: Duration = Duration::from_millis(50);
/// How long the node and its observers need to start, and how long a peer of the storm stays.
const SETTLING: Duration = Duration::from_millis(300);
const STAY: Duration = Duration::from_millis(120);

const NODE: &str = r#"
[node]
name = "bench"
[[task]]
name = "bench"
period = "1ms"
priority = 80
cpu = CPU
[[input]]
name = "raw"
service = "bench/in"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
[block.in]
value = "raw"
setChangeRate = 1.0
[[output]]
service = "bench/out"
signals = ["ramp.delayedValue"]
"#;

#[derive(Default)]
struct Arm {
    name: String,
    release: Distribution,
    execution: Distribution,
    cycles: u64,
    missed: u64,
    connects: u64,
    connect_errors: u64,
}

fn main() -> Result<(), Failure> {
    let mut args = Args::parse();
    if args.test {
        (args.rounds, args.seconds) = (1, 1.0);
    }
    let bench = Bench::new()?;
    let named = |name: &String| Arm { name: name.clone(), ..Arm::default() };
    let mut arms: Vec<Arm> = args.arms.iter().map(named).collect();
    take_turns(args.rounds, &mut arms, |arm| arm.take(&turn(&bench, &args, &arm.name)?))?;
    print(&args, &arms);
    Ok(())
}

impl Arm {
    fn take(&mut self, task: &TaskReport) -> Result<(), Failure> {
        for (name, into) in
            [("release_jitter_ns", &mut self.release), ("execution_ns", &mut self.execution)]
        {
            if let Some(histogram) = task.histograms.get(name) {
                into.merge(&Distribution::decode(histogram)?);
            }
        }
        self.cycles += task.cycles;
        self.missed += task.missed;
        self.connects += task.connects.unwrap_or_default();
        self.connect_errors += task.connect_errors.unwrap_or_default();
        Ok(())
    }
}

/// Runs the node once, among the arm's peers.
fn turn(bench: &Bench, args: &Args, arm: &str) -> Result<TaskReport, Failure> {
    let node = bench.start(&[], &NODE.replace("CPU", &args.cpu.to_string()), args.seconds)?;
    thread::sleep(SETTLING);
    let peers = Peers { bench, cpus: &args.peer_cpus };
    let over = AtomicBool::new(false);
    let report = thread::scope(|scope| {
        let company = scope.spawn(|| match arm {
            "quiet" | "quiet again" => Ok(()),
            "observers" => peers.watch(&over),
            "storm" => peers.storm(&over),
            other => {
                Err(format!("no arm \"{other}\"; there are: quiet, quiet again, observers, storm")
                    .into())
            }
        });
        let report = node.report();
        over.store(true, Ordering::Relaxed);
        company.join().map_err(|_| "a peer's thread panicked")??;
        report
    })?;
    report
        .tasks
        .into_iter()
        .next()
        .map(|arm| arm.task)
        .ok_or_else(|| "the report has no task".into())
}

struct Peers<'a> {
    bench: &'a Bench,
    cpus: &'a str,
}

impl Peers<'_> {
    fn start(&self, arguments: &str) -> Result<Peer, Failure> {
        let mut command = self.bench.command(&["taskset", "-c", self.cpus], arguments);
        Ok(Peer(Child::start("a peer", &mut command)?))
    }

    /// Watches the telemetry with several observers until it is over.
    fn watch(&self, over: &AtomicBool) -> Result<(), Failure> {
        let observe = |_| self.start("subscribe isochrone/bench/telemetry --stats");
        let _observers = (0..OBSERVERS).map(observe).collect::<Result<Vec<Peer>, Failure>>()?;
        while !over.load(Ordering::Relaxed) {
            thread::sleep(STORM_INTERVAL);
        }
        Ok(())
    }

    /// Lets readers and writers join and leave; every third is killed.
    fn storm(&self, over: &AtomicBool) -> Result<(), Failure> {
        let mut present = std::collections::VecDeque::new();
        for number in 0.. {
            if over.load(Ordering::Relaxed) {
                break;
            }
            // A service has one writer at a time: one in four, gone before the next.
            present.push_back((
                number,
                match number % 4 {
                    0 => self.start("publish bench/in --value 7 --rate 200")?,
                    _ => self.start("subscribe bench/out --stats")?,
                },
            ));
            thread::sleep(STORM_INTERVAL);
            if present.len() as u32 > STAY.as_millis() as u32 / STORM_INTERVAL.as_millis() as u32
                && let Some((number, peer)) = present.pop_front()
                && number % 3 != 0
            {
                peer.ask_to_leave()?;
            }
        }
        Ok(())
    }
}

/// A peer; dropping it kills it.
struct Peer(Child);

impl Peer {
    fn ask_to_leave(mut self) -> Result<(), Failure> {
        self.0.end()?;
        Ok(())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

fn print(args: &Args, arms: &[Arm]) {
    println!(
        "in us, period 1 ms, {} turns of {} s each, alternating; {OBSERVERS} observers, {} peers a second",
        args.rounds,
        args.seconds,
        1000 / STORM_INTERVAL.as_millis()
    );
    println!(
        "{:<14}{:>9}{:>8}{:>10}{:>8}|{:>9}{:>9}{:>9}{:>9} |{:>9}{:>9}{:>9}",
        "",
        "cycles",
        "missed",
        "connects",
        "failed",
        "rel. p50",
        "p99",
        "p99.9",
        "max",
        "exec p50",
        "p99",
        "p99.9"
    );
    for arm in arms {
        let release = |quantile| us(arm.release.quantile(quantile));
        let execution = |quantile| us(arm.execution.quantile(quantile));
        println!(
            "{:<14}{:>9}{:>8}{:>10}{:>8}|{:>9}{:>9}{:>9}{:>9} |{:>9}{:>9}{:>9}",
            arm.name,
            arm.cycles,
            arm.missed,
            arm.connects,
            arm.connect_errors,
            release(0.5),
            release(0.99),
            release(0.999),
            release(1.0),
            execution(0.5),
            execution(0.99),
            execution(0.999)
        );
    }
}
