//! `bench engine`: what an instance costs in a cycle.

mod arm;
mod memory;

use std::thread;
use std::time::Duration;

use isochrone_blocks::BlockType;
use isochrone_cyclic::{Clock, Monotonic, ThreadRequest, prepare_process, prepare_thread};
use isochrone_engine::Workload;
use isochrone_machine::{Environment, Machine};
use isochrone_processes::Stop;
use isochrone_report::{CostReport, Report, turn_order};
use isochrone_timing::Warning;

use self::arm::{Arm, Turn};
use super::live::Live;
use super::{outputs, parse_length};
use crate::failure::Failure;
use crate::run::warning;
use crate::stop;
use crate::terminal;

/// Measure what a block instance costs in a cycle, from 1 to 1,000,000 instances
///
/// An arm is a task of one block type, or of chains of saw, scale and ramp (`mixed`). Arms of one
/// size take turns. A sample is the mean of a batch of cycles, so long that reading the clock is less
/// than a thousandth of it; before each turn the caches are warmed, which does not count.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone bench engine\n  isochrone bench engine --arms mixed,SawTooth \
    --instances 1000,100000 --cpu 1\n  isochrone bench engine --report new.json && isochrone compare old.json new.json"
)]
pub(crate) struct Args {
    /// Instances in the task [default: 1 to 1000000 in decades for mixed; 1, 1000 and 1000000 for
    /// block types]
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = instances)]
    instances: Vec<usize>,
    /// `mixed` and block types [default: all of them]
    #[arg(long, value_name = "ARM,...", value_delimiter = ',')]
    arms: Vec<String>,
    /// Time of each arm at each size: 1, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "1", value_parser = parse_length)]
    seconds: f64,
    /// CPU to pin to
    #[arg(long)]
    cpu: Option<usize>,
    /// SCHED_FIFO priority, 1 to 89
    #[arg(long, value_parser = clap::value_parser!(u8).range(1..=89))]
    priority: Option<u8>,
    #[command(flatten)]
    outputs: outputs::Args,
}

/// Fewest turns of an arm; even, so that each way through the arms comes as often as the other.
const FEWEST_ROUNDS: u64 = 10;
/// So that turns meet the same times, and a real-time thread pauses before the kernel makes it.
const LONGEST_TURN_NS: u64 = 400_000_000;
const SIZES: [usize; 7] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000];
const SIZES_OF_TYPES: [usize; 3] = [1, 1_000, 1_000_000];

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let sizes = args.sizes(catalogue)?;
    memory::check(&sizes, Machine::here().available_bytes())?;
    let outputs = args.outputs.open()?;
    let stop = stop::on_signal(None)?;
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    if args.priority.is_some() {
        report.warnings.extend(prepare_process().refusals.iter().map(warning));
    }
    let bench =
        Bench { args, catalogue, sizes, stop, clock_read_ns: report.environment.clock_read_ns };
    bench.announce();
    let measured = thread::scope(|scope| {
        let measure = thread::Builder::new().name("bench".into());
        let spawned = measure.spawn_scoped(scope, || bench.measure());
        let measuring = spawned.map_err(|error| Failure::found(format!("no thread: {error}")))?;
        measuring.join().map_err(|_| Failure::found("the thread of the bench panicked"))?
    })?;
    report.warnings.extend(measured.warnings);
    report.costs = measured.costs;
    report.ended_early = measured.ended_early;
    outputs.write(&mut report)
}

/// A size, and the arms that take turns at it.
struct Size {
    instances: usize,
    workloads: Vec<Workload>,
}

impl Args {
    /// Every size once, with every arm once.
    fn sizes(&self, catalogue: &[BlockType]) -> Result<Vec<Size>, Failure> {
        let all = Workload::all(catalogue);
        let named = self.arms.iter().map(|name| workload(&all, name));
        let named = named.collect::<Result<Vec<Workload>, Failure>>()?;
        let asked: &[usize] = if self.instances.is_empty() { &SIZES } else { &self.instances };
        let takes_part = |workload: &Workload, instances: &usize| match workload {
            Workload::Only(_) if self.instances.is_empty() => SIZES_OF_TYPES.contains(instances),
            _ => true,
        };
        let mut sizes: Vec<Size> = Vec::new();
        for instances in asked {
            let mut workloads: Vec<Workload> = Vec::new();
            for workload in if named.is_empty() { &all } else { &named } {
                let is_new = workloads.iter().all(|known| known.name() != workload.name());
                if is_new && takes_part(workload, instances) {
                    workloads.push(*workload);
                }
            }
            let is_new = sizes.iter().all(|known| known.instances != *instances);
            if is_new && !workloads.is_empty() {
                sizes.push(Size { instances: *instances, workloads });
            }
        }
        Ok(sizes)
    }
}

struct Bench<'a> {
    args: &'a Args,
    catalogue: &'a [BlockType],
    sizes: Vec<Size>,
    stop: Stop,
    clock_read_ns: u64,
}

/// What came of the bench.
struct Outcome {
    costs: Vec<CostReport>,
    warnings: Vec<Warning>,
    ended_early: bool,
}

impl Bench<'_> {
    /// The names of the arms, each once.
    fn names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for name in self.sizes.iter().flat_map(|size| &size.workloads).map(Workload::name) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// How long to measure, without warming up and building.
    fn total(&self) -> Duration {
        let turns: usize = self.sizes.iter().map(|size| size.workloads.len()).sum();
        let seconds = turns as f64 * self.args.seconds;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }

    fn announce(&self) {
        terminal::note(&format!(
            "measuring {} for {} s; warming up comes before each turn and does not count. \
             Ctrl-C ends it early.",
            self.names().join(", "),
            self.total().as_secs_f64()
        ));
    }

    fn measure(&self) -> Result<Outcome, Failure> {
        let origin_ns = Monotonic.now_ns();
        let grant =
            prepare_thread(ThreadRequest { priority: self.args.priority, cpu: self.args.cpu });
        let (rounds, turn_ns) = rounds(self.args.seconds);
        let mut turn =
            Turn::new(origin_ns, turn_ns, self.clock_read_ns, grant.cpu, self.stop.clone());
        let names = self.names();
        let live = Live::start(self.total(), names.iter().copied());
        let mut passed = Duration::ZERO;
        let mut costs = Vec::new();
        for size in &self.sizes {
            let build = |workload: &Workload| Arm::build(workload, size.instances, self.catalogue);
            let mut arms = size.workloads.iter().map(build).collect::<Result<Vec<Arm>, _>>()?;
            for (_, place) in turn_order(rounds, arms.len()) {
                let Some(arm) = arms.get_mut(place) else { continue };
                let began_ns = Monotonic.now_ns();
                arm.take(&mut turn);
                if let Some(line) = names.iter().position(|name| *name == arm.name()) {
                    live.say(line, || arm.so_far());
                }
                passed += Duration::from_nanos(turn_ns);
                live.pass(passed);
                if self.stop.is_due() {
                    break;
                }
                if self.args.priority.is_some() {
                    // The kernel takes a CPU from a real-time thread that leaves nothing of it.
                    thread::sleep(Duration::from_nanos((Monotonic.now_ns() - began_ns) / 8));
                }
            }
            costs.extend(arms.iter().filter_map(Arm::report));
            if self.stop.is_due() {
                break;
            }
        }
        costs.sort_by_key(|cost| names.iter().position(|name| *name == cost.name));
        let warnings = grant.refusals.iter().map(warning).collect();
        Ok(Outcome { costs, warnings, ended_early: self.stop.is_due() })
    }
}

/// Turns of an arm, and how long each is, in ns.
fn rounds(seconds: f64) -> (usize, u64) {
    // A number too large saturates: for ever.
    let total_ns = (seconds * 1e9) as u64;
    let rounds = total_ns.div_ceil(LONGEST_TURN_NS).max(FEWEST_ROUNDS).next_multiple_of(2);
    (usize::try_from(rounds).unwrap_or(usize::MAX), total_ns / rounds)
}

fn instances(number: &str) -> Result<usize, String> {
    let most = Workload::MAX_INSTANCES;
    let number = number.parse().ok().filter(|number| (1..=most).contains(number));
    number.ok_or_else(|| format!("give a number of instances from 1 to {most}, such as 1000"))
}

fn workload(all: &[Workload], name: &str) -> Result<Workload, Failure> {
    all.iter().find(|workload| workload.name() == name).copied().ok_or_else(|| {
        let known: Vec<&str> = all.iter().map(Workload::name).collect();
        Failure::usage(format!("there is no arm \"{name}\"; there are: {}", known.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use isochrone_blocks::CATALOGUE;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn sizes(line: &str) -> Vec<(usize, Vec<&'static str>)> {
        let line = Line::parse_from(std::iter::once("engine").chain(line.split_whitespace()));
        let names = |size: &Size| size.workloads.iter().map(Workload::name).collect();
        line.args
            .sizes(&CATALOGUE)
            .unwrap()
            .iter()
            .map(|size| (size.instances, names(size)))
            .collect()
    }

    #[test]
    fn by_default_mixed_is_measured_at_every_size_and_every_type_at_some() {
        let found = sizes("");
        let instances: Vec<usize> = found.iter().map(|(instances, _)| *instances).collect();
        assert_eq!(instances, SIZES);
        for (instances, names) in found {
            let with_types = SIZES_OF_TYPES.contains(&instances);
            assert_eq!(names[0], "mixed");
            assert_eq!(names.len(), if with_types { 1 + CATALOGUE.len() } else { 1 });
        }
    }

    #[test]
    fn one_type_alone_is_measured_at_its_sizes() {
        let instances: Vec<usize> = sizes("--arms SawTooth").iter().map(|(n, _)| *n).collect();
        assert_eq!(instances, SIZES_OF_TYPES);
    }

    #[test]
    fn what_is_named_is_measured_at_all_sizes_that_are_named_and_once() {
        assert_eq!(
            sizes("--arms SawTooth,mixed,SawTooth --instances 7,20,7"),
            [(7, vec!["SawTooth", "mixed"]), (20, vec!["SawTooth", "mixed"])]
        );
    }

    #[test]
    fn turns_are_short_many_and_as_often_forth_as_back() {
        for seconds in [0.000_000_1, 0.01, 1.0, 5.0, 61.0, 1e300] {
            let (rounds, turn_ns) = rounds(seconds);
            assert!(rounds as u64 >= FEWEST_ROUNDS && rounds % 2 == 0, "{seconds}");
            assert!(turn_ns <= LONGEST_TURN_NS, "{seconds}: {turn_ns}");
            let total_s = rounds as f64 * turn_ns as f64 / 1e9;
            assert!(seconds > 1e9 || (total_s - seconds).abs() < 1e-6, "{seconds}: {total_s}");
        }
    }
}
