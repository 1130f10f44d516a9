//! `bench jitter`: how late a loop's releases are.

use std::io::{BufReader, stdin, stdout};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use isochrone_bench::jitter::{
    self, ArmCpu, JitterSettings, Load, Loop, NodeArm, check_sleep, find_cpus,
};
use isochrone_blocks::BlockType;
use isochrone_engine::{format_duration_ns, parse_milliseconds_ns};
use isochrone_machine::{Machine, examine};
use isochrone_runtime::{TaskCpu, TaskCpus};

use super::live::Terminal;
use super::outputs;
use super::times::{parse_length, parse_turn};
use crate::failure::Failure;
use crate::{configuration, domain, program, run, stop, terminal};

/// Measure release jitter: how late a loop starts its cycles
///
/// The arms run one after another in alternating order, in turns of `--turn`, with the same period,
/// priority, CPU, phase and clock. The first 200 ms of a turn are warm-up and are not counted.
/// `sleep` is cyclictest's loop; `hybrid` and `economical` are the node's loop at up to a fifth and
/// a tenth of a CPU; `spin` never sleeps; `cyclictest` is the program itself. `quiet` and `joins` are a
/// whole node, without and with peers that come and go: what joining costs the cycle.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone bench jitter --seconds 60 --html jitter.html\n  \
    isochrone bench jitter --period 250us,1ms,4ms --load idle,cpu --report jitter.json\n  \
    isochrone bench jitter --arms sleep,hybrid --config level.toml --gate gate.toml\n  \
    isochrone bench jitter --arms quiet,joins --seconds 60")]
pub(super) struct Args {
    /// Arms to run; the others are compared with the first. Default: sleep, hybrid and, if it is
    /// installed and permitted to run, cyclictest
    #[arg(long, value_enum, value_delimiter = ',', value_name = "ARM")]
    arms: Vec<Loop>,
    /// Configuration to run as an additional arm, named after its file; the other arms use the
    /// period, priority, CPU and phase of its first task
    #[arg(long = "config", value_name = "FILE.toml")]
    configs: Vec<PathBuf>,
    /// Periods, 10us to 1s, such as 1 (ms) or 250us; each arm runs at each of them
    #[arg(long, value_delimiter = ',', value_name = "TIME", value_parser = parse_period)]
    period: Vec<u64>,
    /// Real-time priority (SCHED_FIFO), 1 to 89; 0 for none
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=89))]
    priority: Option<u8>,
    /// CPU for all arms; default: the one that `cpu = "auto"` would choose now. With several, such as
    /// 0,1, every arm runs on each of them, as `hybrid@0` and `hybrid@1`, and the report says which of them
    /// `auto` would choose
    #[arg(long, value_delimiter = ',', value_name = "CPU")]
    cpu: Vec<usize>,
    /// Offset of the releases (ms, or with a unit: 30us) from a grid that starts between the
    /// kernel's ticks
    #[arg(long, value_name = "TIME", value_parser = parse_milliseconds_ns)]
    phase: Option<u64>,
    /// Background load (stress-ng on all CPUs); each arm runs under each of them
    #[arg(long, value_enum, value_delimiter = ',', default_value = "idle")]
    load: Vec<Load>,
    /// Time for each arm, at each period and under each load: 20, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "20", value_parser = parse_length, allow_negative_numbers = true)]
    seconds: f64,
    /// Length of a turn, 10ms to 60s
    #[arg(long, alias = "block", value_name = "TIME", default_value = "2", value_parser = parse_turn, allow_negative_numbers = true)]
    turn: f64,
    #[command(flatten)]
    outputs: outputs::Args,
    #[command(flatten)]
    domain: domain::Args,
}

/// The peers of the arms `quiet` and `joins`, which start it
#[derive(clap::Args)]
#[command(hide = true)]
pub(super) struct PeersArgs {}

pub(super) fn serve(_: &PeersArgs) -> Result<(), Failure> {
    Ok(jitter::serve_peers(BufReader::new(stdin()), &mut stdout().lock())?)
}

const DEFAULT_PERIOD_NS: u64 = 1_000_000;
const DEFAULT_PRIORITY: u8 = 80;

pub(super) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    // Before the machine is observed, which takes a while.
    let stop = stop::on_signal(None)?;
    let outputs = args.outputs.open()?;
    let machine = Machine::here();
    let settings = args.settings(catalogue, &machine)?;
    jitter::check(&settings)?;
    outputs.check_arms(&settings.names())?;
    terminal::note(&format!("note: {}", circumstances(&settings)));
    let domain = args.domain.find()?;
    let mut report = program::report();
    if let Ok(examination) = examine(&machine, settings.cpus.first().map(|on| on.cpu)) {
        report.findings = examination.findings;
    }
    let measured = jitter::measure(&settings, &report.environment, &domain, &stop, &Terminal)?;
    drop(domain);
    report.warnings.extend(measured.warnings);
    report.tasks = measured.tasks;
    report.ended_early = stop.is_due();
    report.warnings.extend(check_sleep(&report));
    outputs.write(&mut report)
}

impl Args {
    /// The settings of the bench: from the command line, or from the configurations where they specify them.
    fn settings(
        &self,
        catalogue: &[BlockType],
        machine: &Machine,
    ) -> Result<JitterSettings, Failure> {
        let mut settings = JitterSettings {
            loops: self.arms.clone(),
            nodes: self.nodes(catalogue, machine)?,
            periods_ns: self.period.clone(),
            loads: self.load.clone(),
            priority: Some(self.priority.unwrap_or(DEFAULT_PRIORITY)).filter(|p| *p > 0),
            cpus: find_cpus(&self.cpu, machine)?,
            phase_ns: self.phase.unwrap_or(0),
            time: Duration::from_secs_f64(self.seconds),
            turn: Duration::from_secs_f64(self.turn),
        };
        self.follow_first_task(&mut settings)?;
        if settings.periods_ns.is_empty() {
            settings.periods_ns.push(DEFAULT_PERIOD_NS);
        }
        if let Some(period_ns) =
            settings.periods_ns.iter().find(|period_ns| **period_ns <= settings.phase_ns)
        {
            return Err(Failure::usage(format!(
                "--phase {} is not less than the period of {}; a phase is a part of the period",
                format_duration_ns(settings.phase_ns),
                format_duration_ns(*period_ns)
            )));
        }
        if settings.loops.is_empty() {
            jitter::add_usual_loops(&mut settings);
        }
        Ok(settings)
    }

    fn nodes(&self, catalogue: &[BlockType], machine: &Machine) -> Result<Vec<NodeArm>, Failure> {
        let mut nodes = Vec::new();
        for path in &self.configs {
            let plan = configuration::plan(path, catalogue)?;
            run::require_services(&plan)?;
            let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into());
            let cpus = TaskCpus::on(&plan, machine);
            nodes.push(NodeArm { name, plan: Arc::new(plan), cpus });
        }
        Ok(nodes)
    }

    /// If there are nodes, the first task of the first one determines how all arms run.
    fn follow_first_task(&self, settings: &mut JitterSettings) -> Result<(), Failure> {
        let Some(NodeArm { name, plan, cpus }) = settings.nodes.first().cloned() else {
            return Ok(());
        };
        let Some(task) = plan.tasks.first() else { return Ok(()) };
        let said = [
            ("--period", !self.period.is_empty()),
            ("--priority", self.priority.is_some()),
            ("--cpu", !self.cpu.is_empty()),
            ("--phase", self.phase.is_some()),
        ];
        if let Some((option, _)) = said.iter().find(|(_, said)| *said) {
            return Err(Failure::usage(format!(
                "{option} cannot be given with --config: the first task of \"{name}\" says it, so \
                 that all arms run alike"
            )));
        }
        let period_ns = task.settings.period_ns;
        for other in &settings.nodes {
            let other_ns = other.plan.tasks.first().map_or(period_ns, |t| t.settings.period_ns);
            if other_ns != period_ns {
                return Err(Failure::usage(format!(
                    "the first tasks of \"{name}\" and \"{}\" have periods of {} and {}; arms are \
                     compared at the same period",
                    other.name,
                    format_duration_ns(period_ns),
                    format_duration_ns(other_ns)
                )));
            }
        }
        settings.periods_ns = vec![period_ns];
        settings.phase_ns = task.settings.phase_ns;
        settings.priority = task.settings.priority;
        if let Some(cpu) = cpus.cpu(0) {
            settings.cpus = vec![ArmCpu { cpu, reason: cpus.reason(0) }];
        }
        // Where the first task of another node leaves its CPU open, it runs where this one does.
        for other in &mut settings.nodes {
            if let (Some(TaskCpu::Chosen(_)), Some(place)) =
                (other.cpus.as_slice().first(), cpus.as_slice().first())
            {
                other.cpus = other.cpus.clone().with(0, place.clone());
            }
        }
        Ok(())
    }
}

/// What all arms have in common: `SCHED_FIFO 80, CPU 1, phase 0ns`.
fn circumstances(settings: &JitterSettings) -> String {
    let scheduler = match settings.priority {
        Some(priority) => format!("SCHED_FIFO {priority}"),
        None => "normal scheduling, no priority".to_owned(),
    };
    let cpus: Vec<_> = settings.cpus.iter().map(|on| on.cpu.to_string()).collect();
    let noun = if cpus.len() == 1 { "CPU" } else { "CPUs" };
    let phase = format_duration_ns(settings.phase_ns);
    format!("{scheduler}, {noun} {}, phase {phase}", cpus.join(", "))
}

fn parse_period(text: &str) -> Result<u64, String> {
    match parse_milliseconds_ns(text)? {
        period_ns @ 10_000..=1_000_000_000 => Ok(period_ns),
        _ => Err("a period is 10us to 1s".into()),
    }
}
