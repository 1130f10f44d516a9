//! `bench engine`: what an instance costs in a cycle.

use isochrone_bench::engine::{self, EngineSettings, TaskSize, check_memory};
use isochrone_blocks::BlockType;
use isochrone_engine::Workload;
use isochrone_machine::Machine;

use super::live::Terminal;
use super::outputs;
use super::times::parse_length;
use crate::base::failure::Failure;
use crate::base::stop;
use crate::base::terminal;
use crate::program;

/// Measure what a block instance costs per cycle, from 1 to 1,000,000 instances
///
/// An arm is a task with one block type, or with chains of saw, scale and ramp (`mixed`). Arms of
/// one size alternate. A sample is the mean of a batch of cycles long enough that reading the clock
/// takes less than a thousandth of it. Caches are warmed before each turn; this is not counted.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone bench engine\n  isochrone bench engine --arms mixed,SawTooth \
    --instances 1000,100000 --cpu 1\n  isochrone bench engine --report new.json && isochrone compare old.json new.json"
)]
pub(crate) struct Args {
    /// Number of instances in the task [default: 1 to 1000000 in decades for mixed; 1, 1000 and
    /// 1000000 for block types]
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = instances)]
    instances: Vec<usize>,
    /// Arms: `mixed` and block types [default: all of them]
    #[arg(long, value_name = "ARM,...", value_delimiter = ',')]
    arms: Vec<String>,
    /// Time for each arm at each size: 1, 500ms, 5min
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

const SIZES: [usize; 7] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000];
const SIZES_OF_TYPES: [usize; 3] = [1, 1_000, 1_000_000];

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let settings = EngineSettings {
        catalogue,
        sizes: args.sizes(catalogue)?,
        seconds: args.seconds,
        priority: args.priority,
        cpu: args.cpu,
    };
    check_memory(&settings.sizes, Machine::here().available_bytes())?;
    let outputs = args.outputs.open()?;
    outputs.check_arms(&settings.names())?;
    let stop = stop::on_signal(None)?;
    let mut report = program::report();
    terminal::note(&format!(
        "measuring {} for {} s; warming up comes before each turn and does not count. Press Ctrl-C \
         to end it early.",
        settings.names().join(", "),
        settings.total().as_secs_f64()
    ));
    let clock_read_ns = report.environment.clock_read_ns;
    let measured = engine::measure(&settings, clock_read_ns, &stop, &Terminal)?;
    report.warnings.extend(measured.warnings);
    report.costs = measured.costs;
    report.ended_early = stop.is_due();
    outputs.write(&mut report)
}

impl Args {
    /// Every size once, with every arm once.
    fn sizes(&self, catalogue: &[BlockType]) -> Result<Vec<TaskSize>, Failure> {
        let all = Workload::all(catalogue);
        let named = self.arms.iter().map(|name| workload(&all, name));
        let named = named.collect::<Result<Vec<Workload>, Failure>>()?;
        let asked: &[usize] = if self.instances.is_empty() { &SIZES } else { &self.instances };
        let takes_part = |workload: &Workload, instances: &usize| match workload {
            Workload::Only(_) if self.instances.is_empty() => SIZES_OF_TYPES.contains(instances),
            _ => true,
        };
        let mut sizes: Vec<TaskSize> = Vec::new();
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
                sizes.push(TaskSize { instances: *instances, workloads });
            }
        }
        Ok(sizes)
    }
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
        let names = |size: &TaskSize| size.workloads.iter().map(Workload::name).collect();
        let sizes = line.args.sizes(CATALOGUE).unwrap();
        sizes.iter().map(|size| (size.instances, names(size))).collect()
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
}
