//! What peers cost the cycle: eight that watch its telemetry, twenty a second that come and go, and those
//! who operate the node: eight that ask for values 50 times a second each, one that sets 100 times a
//! second, and one that changes the configuration once a second.
//!
//! The arms take turns, forth and back. `quiet` and `quiet again` are the same thing twice: what lies
//! between them is noise. Peers run on another CPU than the node, so that they meet it in shared
//! memory only.
//!
//! With five turns or more, each arm's release jitter is compared with that of `quiet`, turn by turn, with
//! the interval that contains 99 % of the ratios obtained by resampling the turns.
//!
//! ```text
//! cargo bench -p isochrone-benches --bench peers -- --rounds 10 --seconds 6
//! cargo bench -p isochrone-benches --bench peers -- --arms quiet,pollers,setter,changes --instances 1000
//! ```

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use isochrone_benches::{Bench, Failure, Profile, take_turns, us};
use isochrone_control::{ApplyParams, Client, ClientError, SetParams};
use isochrone_ipc::Participant;
use isochrone_machine::CpuList;
use isochrone_processes::Child;
use isochrone_report::{Pairing, TurnSamples, ratio};
use isochrone_timing::{Distribution, Metric, TaskReport};
use rustix::thread::CpuSet;

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
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "quiet,quiet again,observers,storm,pollers,setter,changes"
    )]
    arms: Vec<String>,
    /// Ramps that the node runs beside the one that is asked for
    #[arg(long, default_value_t = 1)]
    instances: usize,
    /// Only see whether every arm runs
    #[arg(long)]
    test: bool,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

/// What the other arms are compared with.
const QUIET: &str = "quiet";
const OBSERVERS: usize = 8;
/// Twenty a second.
const STORM_INTERVAL: Duration = Duration::from_millis(50);
/// Between two looks of a poller, two transactions of the setter, and two changes.
const POLL_HZ: u32 = 50;
const SET_INTERVAL: Duration = Duration::from_millis(10);
const CHANGE_INTERVAL: Duration = Duration::from_secs(1);
/// How long an operator waits for an answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// How long the node and its observers need to start, and how long a peer of the storm stays.
const SETTLING: Duration = Duration::from_millis(300);
const STAY: Duration = Duration::from_millis(120);

const NODE: &str = r#"
[node]
name = "bench"
control = "force"
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
setChangeRate = RATE
[[block]]
name = "more"
type = "LimRateOfChangeCI"
count = INSTANCES
in = { value = "raw", setChangeRate = RATE }
[[output]]
service = "bench/out"
signals = ["ramp.delayedValue"]
"#;

#[derive(Default)]
struct Arm {
    name: String,
    release: Distribution,
    /// The release jitter of each turn.
    turns: Vec<TurnSamples>,
    execution: Distribution,
    cycles: u64,
    missed: u64,
    connects: u64,
    connect_errors: u64,
    operated: Operated,
}

/// What operators did, and how long each waited for the answer.
#[derive(Default)]
struct Operated {
    requests: u64,
    refused: u64,
    wait: Distribution,
}

fn main() -> Result<(), Failure> {
    let mut args = Args::parse();
    if args.test {
        (args.rounds, args.seconds) = (1, 1.0);
    }
    let bench = Bench::new(Profile::of_bench(args.test))?;
    let named = |name: &String| Arm { name: name.clone(), ..Arm::default() };
    let mut arms: Vec<Arm> = args.arms.iter().map(named).collect();
    take_turns(args.rounds, &mut arms, |arm| {
        let task = turn(&bench, &args, &arm.name, &mut arm.operated)?;
        arm.take(&task)
    })?;
    print(&args, &arms);
    compare(&arms);
    Ok(())
}

impl Arm {
    fn take(&mut self, task: &TaskReport) -> Result<(), Failure> {
        let measured = |name: &str| {
            task.histograms
                .get(name)
                .map_or(Ok(Distribution::new()), |text| Distribution::decode(text))
        };
        let release = measured("release_jitter_ns")?;
        self.turns.push(TurnSamples::of(&release));
        self.release.merge(&release);
        self.execution.merge(&measured("execution_ns")?);
        self.cycles += task.cycles;
        self.missed += task.missed;
        self.connects += task.connects.unwrap_or_default();
        self.connect_errors += task.connect_errors.unwrap_or_default();
        Ok(())
    }
}

/// Runs the node once, among the arm's peers.
fn turn(
    bench: &Bench,
    args: &Args,
    arm: &str,
    operated: &mut Operated,
) -> Result<TaskReport, Failure> {
    let node = bench.start(&configuration(args, 1.0), args.seconds)?;
    thread::sleep(SETTLING);
    let peers = Peers { bench, cpus: &args.peer_cpus };
    let over = AtomicBool::new(false);
    let report = thread::scope(|scope| {
        let company = scope.spawn(|| match arm {
            QUIET | "quiet again" => Ok(()),
            "observers" => peers.watch(&over),
            "storm" => peers.storm(&over),
            "pollers" => peers.poll(&over),
            "setter" => peers.operate(&over, SET_INTERVAL, operated, |client, round| {
                let rate = 1.0 + (round % 2) as f64;
                let values = [("ramp.setChangeRate", rate)].into_iter().collect();
                client.call(&SetParams { values, ..SetParams::default() }).map(drop)
            }),
            "changes" => peers.operate(&over, CHANGE_INTERVAL, operated, |client, round| {
                let rate = 2.0 - (round % 2) as f64;
                let configuration = configuration(args, rate);
                client.call(&ApplyParams { configuration, ..ApplyParams::default() }).map(drop)
            }),
            other => Err(format!("no arm \"{other}\"; the default names all").into()),
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

fn configuration(args: &Args, rate: f64) -> String {
    NODE.replace("CPU", &args.cpu.to_string())
        .replace("INSTANCES", &args.instances.to_string())
        .replace("RATE", &format!("{rate:?}"))
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

    /// Asks for values from several processes until it is over.
    fn poll(&self, over: &AtomicBool) -> Result<(), Failure> {
        let watch = format!("watch bench ramp.delayedValue --rate {POLL_HZ}");
        let poll = |_| self.start(&watch);
        let _pollers = (0..OBSERVERS).map(poll).collect::<Result<Vec<Peer>, Failure>>()?;
        while !over.load(Ordering::Relaxed) {
            thread::sleep(STORM_INTERVAL);
        }
        Ok(())
    }

    /// Does something to the node again and again, on the CPUs of the peers, until it is over.
    fn operate(
        &self,
        over: &AtomicBool,
        interval: Duration,
        operated: &mut Operated,
        ask: impl Fn(&mut Client, u64) -> Result<(), ClientError>,
    ) -> Result<(), Failure> {
        rustix::thread::sched_setaffinity(None, &cpus(self.cpus)?)?;
        let participant = Participant::join("operator", self.bench.domain())?;
        let mut client = Client::connect(&participant, "bench", PATIENCE)?;
        for round in 0.. {
            if over.load(Ordering::Relaxed) {
                break;
            }
            let begin = Instant::now();
            match ask(&mut client, round) {
                Ok(()) => {
                    operated.requests += 1;
                    let waited = begin.elapsed().as_nanos();
                    operated.wait.record(u64::try_from(waited).unwrap_or(u64::MAX));
                }
                Err(ClientError::Refused(_)) => operated.refused += 1,
                // The node has ended.
                Err(_) => break,
            }
            thread::sleep(interval.saturating_sub(begin.elapsed()));
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

/// A list of CPUs as an affinity.
fn cpus(list: &str) -> Result<CpuSet, Failure> {
    let list = CpuList::parse(list).ok_or_else(|| format!("\"{list}\" is no list of CPUs"))?;
    let mut set = CpuSet::new();
    (0..CpuSet::MAX_CPU).filter(|cpu| list.contains(*cpu)).for_each(|cpu| set.set(cpu));
    Ok(set)
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
    for arm in arms.iter().filter(|arm| arm.operated.requests + arm.operated.refused > 0) {
        let Operated { requests, refused, wait } = &arm.operated;
        let [p50, p99, max] = [0.5, 0.99, 1.0].map(|quantile| us(wait.quantile(quantile)));
        println!(
            "{}: {requests} answered, {refused} refused; request to answer p50 {p50}, p99 {p99}, max {max}",
            arm.name
        );
    }
}

/// How the release jitter of each arm compares with that of `quiet`.
fn compare(arms: &[Arm]) {
    let Some(quiet) = arms.iter().find(|arm| arm.name == QUIET) else {
        return;
    };
    println!(
        "release jitter, {QUIET} divided by the arm (99 % interval; above 1 the arm's is lower)"
    );
    for arm in arms.iter().filter(|arm| arm.name != QUIET) {
        let words = [("p50", 0.5), ("p99", 0.99)].map(|(name, quantile)| {
            match ratio(
                &quiet.turns,
                &arm.turns,
                quantile,
                Pairing::Paired,
                Metric::RELEASE_JITTER.resolution,
            ) {
                Ok(found) => {
                    format!("{name} {:.2} ({:.2} to {:.2})", found.ratio, found.low, found.high)
                }
                Err(too_short) => format!("{name}: {too_short}"),
            }
        });
        println!("{:<14}{}", arm.name, words.join("; "));
    }
}
