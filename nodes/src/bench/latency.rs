//! `bench latency`: how long a message takes from one process to another.

use std::io::{BufReader, stdin, stdout};

use clap::ValueEnum;
use isochrone_bench::allowed_cpus;
use isochrone_bench::latency::{self, Arm, Cpus, LatencySettings, NodePlace, SendPace, Wait};
use isochrone_machine::{BoundThread, Environment, Machine, Observation};

use super::live::Terminal;
use super::outputs;
use super::times::{parse_length, parse_turn};
use crate::base::failure::Failure;
use crate::base::{stop, terminal};
use crate::program;

/// Measure how long a message takes from one process to another
///
/// Uses two processes, each on its own CPU. Paced, one sends at absolute instants and the other
/// receives; the one-way time is from just before the values are written until all of them are
/// read. It counts from the moment a message was actually sent and does not include how late the
/// sender was; if the sender missed more than 1 % of its send times, a warning reports it
/// (pace_not_kept). Back to back, each message is sent when the previous one has returned, and the
/// one-way time is half of the round trip. Every value is written, read and checked. The first
/// tenth of each turn is warm-up.
///
/// Through nodes that follow (arms follow and chain), the thread that sends also reads what comes
/// back, on the receiver's CPU; the first node runs on the sender's CPU, the second of a chain on
/// another one if there is one. A message is sent 20 us after a release of the nodes, or a tenth of the
/// period if that is less; the time is from just before the value is written until that of the last
/// node's frame is read.
#[derive(clap::Args)]
#[group(skip)]
#[command(
    after_help = "Examples:\n  isochrone bench latency --arms raw,ports --values 64 --seconds 10\n  \
    isochrone bench latency --pace back-to-back --html latency.html\n  \
    isochrone bench latency --arms node,ports --pace 1000 --values 1\n  \
    isochrone bench latency --arms ports,follow,chain --pace 1000,4000 --values 1"
)]
pub(crate) struct Args {
    /// What to measure; the others are compared with the first
    #[arg(
        long,
        value_delimiter = ',',
        value_enum,
        default_value = Arm::names(),
        value_name = "ARM,…"
    )]
    arms: Vec<Arm>,
    /// Messages per second, or back-to-back
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = SendPace::parse,
        default_value = "100,1000,10000,back-to-back",
        allow_negative_numbers = true,
        value_name = "HZ,…"
    )]
    pace: Vec<SendPace>,
    /// Number of 8-byte values per message, 1 to 4096
    #[arg(
        long,
        value_delimiter = ',',
        value_parser = parse_values,
        default_value = "1,64,4096",
        allow_negative_numbers = true,
        value_name = "N,…"
    )]
    values: Vec<usize>,
    /// Time for each arm, at each pace and size: 3, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "3", value_parser = parse_length, allow_negative_numbers = true)]
    seconds: f64,
    /// Length of a turn, 10ms to 60s
    #[arg(long, alias = "block", value_name = "TIME", default_value = "0.5", value_parser = parse_turn, allow_negative_numbers = true)]
    turn: f64,
    /// How receivers wait
    #[arg(long, value_enum, default_value = "poll")]
    wait: Wait,
    /// CPUs of the sender and the receiver; default: those that `cpu = "auto"` would choose now for two
    /// tasks, the better one for the receiver
    #[arg(long, value_parser = parse_cpus, value_name = "A,B")]
    cpu: Option<Cpus>,
    /// SCHED_FIFO priority of both processes, 1 to 89; default: normal scheduling
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=89), allow_negative_numbers = true)]
    priority: Option<u8>,
    #[command(flatten)]
    outputs: outputs::Args,
}

/// Fewest messages per turn for a meaningful result.
const FEWEST_MESSAGES: f64 = 10.0;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    // Before the machine is observed, which takes a while.
    let stop = stop::on_signal(None)?;
    let settings = args.settings(&allowed_cpus()?)?;
    let mut report = program::report();
    refuse_throttled_poll(&settings, &report.environment)?;
    let outputs = args.outputs.open()?;
    outputs.check_arms(&settings.names())?;
    let limited =
        args.arms.iter().filter_map(|arm| arm.limited(&args.values, &args.pace, &settings.sizes));
    limited.for_each(|note| terminal::note(&format!("note: {note}")));
    settings
        .names()
        .iter()
        .filter_map(|arm| whereabouts(&settings, arm))
        .for_each(|note| terminal::note(&note));
    let measured = latency::measure(&settings, &stop, &Terminal)?;
    report.links = measured.links;
    report.warnings.extend(measured.warnings);
    report.ended_early = stop.is_due();
    outputs.write(&mut report)
}

/// The other process of `bench latency`, which starts it
#[derive(clap::Args)]
#[command(hide = true)]
pub(crate) struct PeerArgs {}

pub(crate) fn serve(_: &PeerArgs) -> Result<(), Failure> {
    Ok(latency::serve_peer(BufReader::new(stdin()), &mut stdout().lock())?)
}

impl Args {
    /// The command line, checked.
    fn settings(&self, allowed: &[usize]) -> Result<LatencySettings, Failure> {
        let twice = |(index, arm): (usize, &Arm)| {
            self.arms.iter().take(index).any(|before| before == arm).then_some(*arm)
        };
        if let Some(arm) = self.arms.iter().enumerate().find_map(twice) {
            return Err(Failure::usage(format!("--arms lists {arm} twice; name each arm once")));
        }
        let turn_s = self.turn.min(self.seconds);
        for hz in self.pace.iter().filter_map(|pace| pace.hz()) {
            if hz * turn_s < FEWEST_MESSAGES {
                let needed = FEWEST_MESSAGES / hz;
                return Err(Failure::usage(format!(
                    "at {hz} Hz a turn of {turn_s} s has fewer than {FEWEST_MESSAGES} messages; \
                     give --turn {needed} and --seconds of some times that"
                )));
            }
        }
        let cpus = choose_cpus(self.cpu, allowed, || Machine::here().observation().cloned())?;
        let others = |cpu: &&usize| **cpu != cpus.sender && **cpu != cpus.receiver;
        Ok(LatencySettings {
            sizes: latency::plan(&self.arms, &self.values, &self.pace),
            rounds: (self.seconds / turn_s).round().max(1.0) as usize,
            turn_ns: (turn_s * 1e9) as u64,
            wait: self.wait,
            cpus,
            // Where there is no third CPU the node shares that of its publisher.
            node_cpu: allowed.iter().rfind(others).copied().unwrap_or(cpus.sender),
            priority: self.priority,
        })
    }
}

/// Where the processes of an arm through nodes run.
fn whereabouts(settings: &LatencySettings, arm: &str) -> Option<String> {
    let arm = Arm::from_str(arm, false).ok()?;
    let nodes: Vec<String> = settings.node_places(arm).iter().map(NodePlace::to_string).collect();
    let Cpus { sender, receiver } = settings.cpus;
    let ends = if arm.has_peer() {
        format!("sends on CPU {sender}, reads on CPU {receiver}")
    } else {
        format!("sends and reads on CPU {receiver}")
    };
    let noun = if nodes.len() == 1 { "node" } else { "nodes" };
    (!nodes.is_empty()).then(|| format!("note: {arm} {ends}; {noun} on {}", nodes.join(", ")))
}

/// A real-time thread that polls is taken off its CPU by the kernel's throttling.
fn refuse_throttled_poll(
    settings: &LatencySettings,
    environment: &Environment,
) -> Result<(), Failure> {
    match (settings.priority, settings.polling_arm(), environment.fifo_throttling()) {
        (Some(_), Some(arm), Some(throttling)) => Err(Failure::found(format!(
            "--priority with arm \"{arm}\": its receiver polls, but the kernel gives real-time \
                 threads only {throttling} us of a CPU and would stop it for the rest\n\
                 remedy: leave --priority out, or sysctl -w kernel.sched_rt_runtime_us=-1"
        ))),
        _ => Ok(()),
    }
}

fn parse_values(text: &str) -> Result<usize, String> {
    const MOST: usize = 4096;
    match text.parse() {
        Ok(values @ 1..=MOST) => Ok(values),
        _ => Err(format!("give the values of a message, from 1 to {MOST}")),
    }
}

fn parse_cpus(text: &str) -> Result<Cpus, String> {
    let read = |cpu: &str| cpu.trim().parse::<usize>().ok();
    let both = text.split_once(',').and_then(|(a, b)| Some((read(a)?, read(b)?)));
    match both {
        Some((sender, receiver)) if sender != receiver => Ok(Cpus { sender, receiver }),
        Some(_) => Err("sender and receiver need a CPU each: both poll".into()),
        None => Err("give the sender's CPU and the receiver's, such as 0,1".into()),
    }
}

/// Those that were asked for if this process may use them, or else the two that disturb least.
fn choose_cpus(
    asked: Option<Cpus>,
    allowed: &[usize],
    observe: impl FnOnce() -> Option<Observation>,
) -> Result<Cpus, Failure> {
    let listed = || allowed.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
    match (asked, allowed) {
        (_, [] | [_]) => Err(Failure::found(format!(
            "sender and receiver need a CPU each, and this process may use only CPU {}\n\
             remedy: a machine with two CPUs, or a wider cpuset or taskset",
            listed()
        ))),
        (Some(asked), _) => {
            match [asked.sender, asked.receiver].into_iter().find(|cpu| !allowed.contains(cpu)) {
                Some(cpu) => Err(Failure::usage(format!(
                    "--cpu: CPU {cpu} is not one that this process may use; those are {}",
                    listed()
                ))),
                None => Ok(asked),
            }
        }
        (None, [.., sender, receiver]) => {
            let unknown = Cpus { sender: *sender, receiver: *receiver };
            Ok(observe().and_then(quietest).unwrap_or(unknown))
        }
    }
}

/// The receiver's arrivals are measured, so its CPU is chosen first.
fn quietest(mut observation: Observation) -> Option<Cpus> {
    let mut choose = || {
        let cpu = observation.choose()?.cpu;
        observation.bind(BoundThread { process: None, name: "bench".to_owned(), cpu });
        Some(cpu)
    };
    let (receiver, sender) = (choose()?, choose()?);
    (sender != receiver).then_some(Cpus { sender, receiver })
}

#[cfg(test)]
mod tests {
    use isochrone_machine::{CpuList, ObservedCpu};

    use super::*;

    #[test]
    fn the_quietest_cpus_are_taken_if_none_are_named() {
        let both = |sender, receiver| Cpus { sender, receiver };
        let chosen = |asked, allowed: &[usize]| {
            let cpu = |cpu: &usize| ObservedCpu {
                cpu: *cpu,
                is_isolated: *cpu == 2,
                core: CpuList::default(),
                bound: Vec::new(),
                interrupts: None,
            };
            let cpus = allowed.iter().map(cpu).collect();
            choose_cpus(asked, allowed, || Some(Observation { cpus }))
        };
        assert_eq!(chosen(None, &[0, 2, 3]).unwrap(), both(3, 2));
        assert_eq!(chosen(None, &[0, 3]).unwrap(), both(0, 3));
        assert_eq!(choose_cpus(None, &[0, 2, 3], || None).unwrap(), both(2, 3));
        assert_eq!(chosen(Some(both(3, 0)), &[0, 2, 3]).unwrap(), both(3, 0));
        assert!(chosen(Some(both(1, 0)), &[0, 2, 3]).is_err());
        assert!(chosen(None, &[5]).is_err());
        assert!(chosen(Some(both(0, 1)), &[0]).is_err());
    }

    #[test]
    fn one_cpu_for_both_is_refused() {
        assert_eq!(parse_cpus("0,1"), Ok(Cpus { sender: 0, receiver: 1 }));
        assert!(parse_cpus("1,1").unwrap_err().contains("a CPU each"));
        for wrong in ["", "1", "a,b", "0,1,2", "-1,0"] {
            assert!(parse_cpus(wrong).unwrap_err().contains("such as 0,1"), "{wrong}");
        }
    }
}
