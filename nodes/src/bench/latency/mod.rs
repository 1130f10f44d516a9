//! `bench latency`: how long a message takes from one process to another.
//!
//! Two processes, each on a CPU of its own. The main thread (`session`) gives the turns and keeps
//! off those CPUs; the thread that measures (`measurer`) owns one end of every arm, the peer process
//! (`peer`) the other. What happens in a turn is in `turn`, what a transport is in `end`.

mod arms;
mod cache_line;
mod circumstance;
mod end;
mod measurer;
mod message;
mod node_path;
pub(super) mod peer;
mod pipe;
mod ports;
mod processes;
mod raw;
mod session;
mod stream;
mod tcp;
mod turn;
mod unix_datagram;

use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_ipc::{Participant, ipc};
use isochrone_machine::Environment;
use isochrone_processes::Company;
use isochrone_report::Report;

use super::watch::allowed_cpus;
use super::{outputs, parse_length, parse_turn};
use crate::failure::Failure;
use crate::run::warning;
use crate::stop;
use arms::{Arm, Pace, Wait};
use circumstance::KeptPace;
use session::Bench;

/// Measure how long a message takes from one process to another
///
/// Two processes, each on a CPU of its own. Paced, one sends at absolute instants and the other
/// receives: one-way is from just before the values are written until they all are read. It counts
/// from when a message really was sent: how late the sender came to its instant is in no number; if it
/// missed more than 1 % of them altogether, a warning says so (pace_not_kept). Back to back, a
/// message is sent when the one before has come back: one-way is half of the round trip. Every value
/// is really written and read, and checked. The first tenth of each turn is warm-up.
#[derive(clap::Args)]
#[group(skip)]
#[command(
    after_help = "Examples:\n  isochrone bench latency --arms raw,ports --values 64 --seconds 10\n  \
    isochrone bench latency --pace back-to-back --html latency.html\n  \
    isochrone bench latency --arms node,ports --pace 1000 --values 1"
)]
pub(crate) struct Args {
    /// What to measure; the others are compared with the first
    #[arg(
        long,
        value_delimiter = ',',
        value_enum,
        default_value = "raw,ports,unix,pipe,tcp,cache_line,node",
        value_name = "ARM,…"
    )]
    arms: Vec<Arm>,
    /// Messages per second, or back-to-back
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = Pace::parse,
        default_value = "100,1000,10000,back-to-back",
        allow_negative_numbers = true,
        value_name = "HZ,…"
    )]
    pace: Vec<Pace>,
    /// Values (of 8 bytes) in a message, 1 to 4096
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = parse_values,
        default_value = "1,64,4096",
        allow_negative_numbers = true,
        value_name = "N,…"
    )]
    values: Vec<usize>,
    /// Time of each arm, at each pace and size: 3, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "3", value_parser = parse_length, allow_negative_numbers = true)]
    seconds: f64,
    /// Time of a turn, 10ms to 60s
    #[arg(long, alias = "block", value_name = "TIME", default_value = "0.5", value_parser = parse_turn, allow_negative_numbers = true)]
    turn: f64,
    /// How receivers wait
    #[arg(long, value_enum, default_value = "poll")]
    wait: Wait,
    /// CPU of the sender and CPU of the receiver; the last two if it is not given
    #[arg(long, value_parser = Cpus::parse, value_name = "A,B")]
    cpu: Option<Cpus>,
    /// SCHED_FIFO priority of both, 1 to 89; normal scheduling if it is not given
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=89), allow_negative_numbers = true)]
    priority: Option<u8>,
    #[command(flatten)]
    outputs: outputs::Args,
}

/// Fewest messages of a turn that say anything.
const FEWEST_MESSAGES: f64 = 10.0;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let plan = Plan::new(args, &allowed_cpus()?)?;
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    plan.refuse_throttled_poll(&report.environment)?;
    let outputs = args.outputs.open()?;
    let stop = stop::on_signal(None)?;
    let company = Company::gather("isobench")?;
    let refusals = prepare_process().refusals;
    let participant = Participant::<ipc::Service>::join("isochrone/latency", company.domain())
        .map_err(Failure::found)?;
    let mut bench = Bench {
        plan: &plan,
        company: &company,
        participant: &participant,
        stop: &stop,
        origin_ns: Monotonic.now_ns(),
        turns: 0,
        paces: Vec::new(),
        warnings: refusals.iter().map(warning).collect(),
    };
    for (values, circumstances) in &plan.circumstances {
        if stop.is_due() {
            break;
        }
        report.links.extend(bench.measure(*values, circumstances)?);
    }
    report.warnings.append(&mut bench.warnings);
    report.warnings.extend(KeptPace::warning(&bench.paces));
    report.ended_early = stop.is_due();
    drop(participant);
    drop(company);
    outputs.write(&mut report)
}

/// The command line, checked.
struct Plan {
    circumstances: Vec<(usize, Vec<circumstance::Circumstance>)>,
    rounds: usize,
    turn_ns: u64,
    wait: Wait,
    cpus: Cpus,
    node_cpu: usize,
    priority: Option<u8>,
}

impl Plan {
    fn new(args: &Args, allowed: &[usize]) -> Result<Self, Failure> {
        let twice = |(index, arm): (usize, &Arm)| {
            args.arms.iter().take(index).any(|before| before == arm).then_some(*arm)
        };
        if let Some(arm) = args.arms.iter().enumerate().find_map(twice) {
            return Err(Failure::usage(format!("--arms lists {arm} twice; name each arm once")));
        }
        let turn_s = args.turn.min(args.seconds);
        for hz in args.pace.iter().filter_map(|pace| pace.hz()) {
            if hz * turn_s < FEWEST_MESSAGES {
                let needed = FEWEST_MESSAGES / hz;
                return Err(Failure::usage(format!(
                    "at {hz} Hz a turn of {turn_s} s has fewer than {FEWEST_MESSAGES} messages; \
                     give --turn {needed} and --seconds of some times that"
                )));
            }
        }
        let cpus = Cpus::choose(args.cpu, allowed)?;
        let others = |cpu: &&usize| **cpu != cpus.sender && **cpu != cpus.receiver;
        Ok(Self {
            circumstances: circumstance::plan(&args.arms, &args.values, &args.pace),
            rounds: (args.seconds / turn_s).round().max(1.0) as usize,
            turn_ns: (turn_s * 1e9) as u64,
            wait: args.wait,
            cpus,
            // Where there is no third CPU the node shares that of its publisher.
            node_cpu: allowed.iter().rfind(others).copied().unwrap_or(cpus.sender),
            priority: args.priority,
        })
    }

    fn turn(&self) -> Duration {
        Duration::from_nanos(self.turn_ns)
    }

    /// How long all turns take.
    fn total(&self) -> Duration {
        let circumstances = self.circumstances.iter().flat_map(|(_, circumstances)| circumstances);
        let turns: usize = circumstances.map(|some| some.arms.len() * self.rounds).sum();
        self.turn() * turns as u32
    }

    /// A real-time thread that polls is taken off its CPU by the kernel's throttling.
    fn refuse_throttled_poll(&self, environment: &Environment) -> Result<(), Failure> {
        let circumstances = self.circumstances.iter().flat_map(|(_, circumstances)| circumstances);
        let mut arms = circumstances.flat_map(|some| &some.arms);
        let polls = |arm: &&Arm| self.wait == Wait::Poll || !arm.can_block();
        match (self.priority, arms.find(polls), environment.fifo_throttling()) {
            (Some(_), Some(arm), Some(throttling)) => Err(Failure::found(format!(
                "--priority with arm \"{arm}\": its receiver polls, but the kernel gives real-time \
                 threads only {throttling} us of a CPU and would stop it for the rest\n\
                 remedy: leave --priority out, or sysctl -w kernel.sched_rt_runtime_us=-1"
            ))),
            _ => Ok(()),
        }
    }
}

fn parse_values(text: &str) -> Result<usize, String> {
    const MOST: usize = 4096;
    match text.parse() {
        Ok(values @ 1..=MOST) => Ok(values),
        _ => Err(format!("give the values of a message, from 1 to {MOST}")),
    }
}

/// The CPUs of the two processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cpus {
    sender: usize,
    receiver: usize,
}

impl Cpus {
    fn parse(text: &str) -> Result<Self, String> {
        let read = |cpu: &str| cpu.trim().parse::<usize>().ok();
        let both = text.split_once(',').and_then(|(a, b)| Some((read(a)?, read(b)?)));
        match both {
            Some((sender, receiver)) if sender != receiver => Ok(Self { sender, receiver }),
            Some(_) => Err("sender and receiver need a CPU each: both poll".into()),
            None => Err("give the sender's CPU and the receiver's, such as 0,1".into()),
        }
    }

    /// Those that were asked for if this process may use them, or else the last two.
    fn choose(asked: Option<Self>, allowed: &[usize]) -> Result<Self, Failure> {
        let listed = || allowed.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        match (asked, allowed) {
            (_, [] | [_]) => Err(Failure::found(format!(
                "sender and receiver need a CPU each, and this process may use only CPU {}\n\
                 remedy: a machine with two CPUs, or a wider cpuset or taskset",
                listed()
            ))),
            (Some(asked), _) => {
                match [asked.sender, asked.receiver].into_iter().find(|cpu| !allowed.contains(cpu))
                {
                    Some(cpu) => Err(Failure::usage(format!(
                        "--cpu: CPU {cpu} is not one that this process may use; those are {}",
                        listed()
                    ))),
                    None => Ok(asked),
                }
            }
            (None, [.., sender, receiver]) => Ok(Self { sender: *sender, receiver: *receiver }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_two_cpus_are_taken_if_none_are_named() {
        let both = |sender, receiver| Cpus { sender, receiver };
        assert_eq!(Cpus::choose(None, &[0, 2, 3]).unwrap(), both(2, 3));
        assert_eq!(Cpus::choose(Some(both(3, 0)), &[0, 2, 3]).unwrap(), both(3, 0));
        assert!(Cpus::choose(Some(both(1, 0)), &[0, 2, 3]).is_err());
        assert!(Cpus::choose(None, &[5]).is_err());
        assert!(Cpus::choose(Some(both(0, 1)), &[0]).is_err());
    }

    #[test]
    fn one_cpu_for_both_is_refused() {
        assert_eq!(Cpus::parse("0,1"), Ok(Cpus { sender: 0, receiver: 1 }));
        assert!(Cpus::parse("1,1").unwrap_err().contains("a CPU each"));
        for wrong in ["", "1", "a,b", "0,1,2", "-1,0"] {
            assert!(Cpus::parse(wrong).unwrap_err().contains("such as 0,1"), "{wrong}");
        }
    }
}
