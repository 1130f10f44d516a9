//! `bench jitter`: how late a loop's releases are.

mod arm;
mod cyclictest;
mod load;
mod loops;
mod node;
mod validity;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use isochrone_blocks::BlockType;
use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_engine::{Plan, format_duration_ns, parse_milliseconds_ns};
use isochrone_machine::{Environment, Machine, examine};
use isochrone_report::{Report, turn_order};
use isochrone_timing::Warning;

use self::arm::{Arm, Kind, Turn};
use self::load::{Load, Stress};
use super::live::Live;
use super::watch::allowed_cpus;
use super::{outputs, parse_length, parse_turn};
use crate::domain;
use crate::failure::Failure;
use crate::stop;
use crate::{configuration, run, terminal};

/// Measure release jitter: how late a loop begins its cycles
///
/// The arms run one after the other, forth and back, in turns of `--turn`, at the same
/// period, priority, CPU, phase and clock. The first 200 ms of a turn are warm-up and are not counted.
/// `sleep` is cyclictest's loop, `hybrid` and `economical` are the node's (a fifth and a tenth of a
/// CPU), `spin` never sleeps; `cyclictest` is the program itself.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone bench jitter --seconds 60 --html jitter.html\n  \
    isochrone bench jitter --period 250us,1ms,4ms --load idle,cpu --report jitter.json\n  \
    isochrone bench jitter --arms sleep,hybrid --config level.toml --gate gate.toml")]
pub(super) struct Args {
    /// Arms; the others are compared with the first one. Without this: sleep, hybrid and, where it
    /// is installed and may run, cyclictest
    #[arg(long, value_enum, value_delimiter = ',', value_name = "ARM")]
    arms: Vec<Loop>,
    /// A configuration as a further arm, run as `run` does and named after its file; the other arms
    /// take over the period, priority, CPU and phase of its first task
    #[arg(long = "config", value_name = "FILE.toml")]
    configs: Vec<PathBuf>,
    /// Periods, 10us to 1s, such as 1 (ms) or 250us; with several of them each arm runs at each
    #[arg(long, value_delimiter = ',', value_name = "TIME", value_parser = parse_period)]
    period: Vec<u64>,
    /// Real-time priority (SCHED_FIFO), 1 to 89; 0 for none
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=89))]
    priority: Option<u8>,
    /// CPU of all arms; the last one that this process may use if it is not given
    #[arg(long)]
    cpu: Option<usize>,
    /// Where releases lie: this long (ms, or with a unit: 30us) after a grid that begins between the
    /// kernel's ticks
    #[arg(long, value_name = "TIME", value_parser = parse_milliseconds_ns)]
    phase: Option<u64>,
    /// What else the machine does meanwhile (stress-ng on all CPUs); with several of them each arm
    /// runs under each
    #[arg(long, value_enum, value_delimiter = ',', default_value = "idle")]
    load: Vec<Load>,
    /// Time of each arm, at each period and under each load: 20, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "20", value_parser = parse_length, allow_negative_numbers = true)]
    seconds: f64,
    /// Time of a turn, 10ms to 60s
    #[arg(long, alias = "block", value_name = "TIME", default_value = "2", value_parser = parse_turn, allow_negative_numbers = true)]
    turn: f64,
    #[command(flatten)]
    outputs: outputs::Args,
    #[command(flatten)]
    domain: domain::Args,
}

/// The arms that need no configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Loop {
    Sleep,
    Hybrid,
    Economical,
    Spin,
    Cyclictest,
}

/// What is not counted at the beginning of a turn.
const WARM_UP: Duration = Duration::from_millis(200);
/// More than a turn needs before its warm-up and after its end: cyclictest waits for a whole second.
const LONGEST_SET_UP: Duration = Duration::from_secs(10);
const DEFAULT_PERIOD_NS: u64 = 1_000_000;
const DEFAULT_PRIORITY: u8 = 80;

pub(super) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let outputs = args.outputs.open()?;
    let settings = Settings::find(args, catalogue)?;
    let stop = stop::on_signal(None)?;
    let domain = args.domain.find()?;
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    if let Ok(examination) = examine(&Machine::here(), Some(settings.cpu)) {
        report.findings = examination.findings;
    }
    if settings.priority.is_some() {
        report.warnings.extend(prepare_process().refusals.iter().map(run::warning));
    }
    let origin_ns = Monotonic.now_ns();
    let rounds = (args.seconds / args.turn).ceil().max(1.0) as usize;
    let kinds = settings.kinds(args, &report.environment)?;
    let circumstances: Vec<(Load, u64)> = args
        .load
        .iter()
        .flat_map(|load| settings.periods_ns.iter().map(|period_ns| (*load, *period_ns)))
        .collect();
    let counted = Duration::from_secs_f64(args.turn.min(args.seconds));
    let all = (rounds * kinds.len() * circumstances.len()) as f64;
    let names = kinds.iter().map(|(name, _)| name.as_str());
    let live = Live::start((WARM_UP + counted).mul_f64(all), names);
    let began = Instant::now();
    let mut done = 0.0;
    let mut load_before = None;
    let mut stress: Option<Stress> = None;
    for (load, period_ns) in circumstances {
        if load_before.replace(load) != Some(load) {
            // The old load ends before the new one starts.
            drop(stress.take());
            stress = Stress::start(load, (WARM_UP + counted + LONGEST_SET_UP).mul_f64(all))?;
        }
        let mut arms: Vec<Arm> = kinds
            .iter()
            .map(|(name, kind)| Arm::new(name, kind.clone(), period_ns, &settings, origin_ns))
            .collect();
        for (_, index) in turn_order(rounds, arms.len()) {
            if stop.is_due() {
                break;
            }
            let Some(arm) = arms.get_mut(index) else { continue };
            let pass = || live.pass(began.elapsed());
            arm.take(&Turn { counted, stop: &stop, domain: &domain, pass: &pass })?;
            // Ctrl-C ends the load, too.
            if let Some(stress) = stress.as_mut().filter(|_| !stop.is_due()) {
                stress.check()?;
            }
            live.show(index, arm.jitter());
            // Starting and ending a turn takes its time, too, and not the same for each arm.
            done += 1.0;
            live.expect(began.elapsed().mul_f64(all / done));
        }
        // `idle` is only worth a word beside something else.
        let named = if args.load == [Load::Idle] { "" } else { load.as_str() };
        // An early end may come before an arm's first turn.
        for arm in arms.iter().filter(|arm| arm.jitter().count() > 0) {
            arm.warnings(counted).for_each(|warning| keep(&mut report.warnings, warning));
            report.tasks.push(arm.report(named));
        }
    }
    drop((live, stress, domain));
    report.ended_early = stop.is_due();
    report.warnings.extend(validity::check(&report));
    outputs.write(&mut report)
}

/// What all arms have in common.
struct Settings {
    periods_ns: Vec<u64>,
    priority: Option<u8>,
    cpu: usize,
    phase_ns: u64,
    plans: Vec<(String, Arc<Plan>)>,
}

impl Settings {
    /// From the command line, or from the configurations where they say it.
    fn find(args: &Args, catalogue: &[BlockType]) -> Result<Self, Failure> {
        let mut plans = Vec::new();
        for path in &args.configs {
            let plan = configuration::plan(path, catalogue)?;
            run::require_services(&plan)?;
            let name = path.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into());
            plans.push((name, Arc::new(plan)));
        }
        let mut settings = Self {
            periods_ns: args.period.clone(),
            priority: Some(args.priority.unwrap_or(DEFAULT_PRIORITY)).filter(|p| *p > 0),
            cpu: find_cpu(args.cpu)?,
            phase_ns: args.phase.unwrap_or(0),
            plans,
        };
        let Some((name, task)) = settings
            .plans
            .first()
            .and_then(|(name, plan)| Some((name.clone(), plan.tasks.first()?)))
        else {
            if settings.periods_ns.is_empty() {
                settings.periods_ns.push(DEFAULT_PERIOD_NS);
            }
            return Ok(settings);
        };
        let said = [
            ("--period", !args.period.is_empty()),
            ("--priority", args.priority.is_some()),
            ("--cpu", args.cpu.is_some()),
            ("--phase", args.phase.is_some()),
        ];
        if let Some((option, _)) = said.iter().find(|(_, said)| *said) {
            return Err(Failure::usage(format!(
                "{option} cannot be given with --config: the first task of \"{name}\" says it, so \
                 that all arms run alike"
            )));
        }
        let (schedule, priority) = (task.schedule, task.priority);
        let (period_ns, phase_ns) = (schedule.period_ns, schedule.phase_ns);
        let cpu = task.cpu.map_or(settings.cpu, |cpu| cpu as usize);
        for (other, plan) in &settings.plans {
            if let Some(task) = plan.tasks.first()
                && task.schedule.period_ns != period_ns
            {
                return Err(Failure::usage(format!(
                    "the first tasks of \"{name}\" and \"{other}\" have periods of {} and {}; arms are \
                     compared at the same period",
                    format_duration_ns(period_ns),
                    format_duration_ns(task.schedule.period_ns)
                )));
            }
        }
        Ok(Self { periods_ns: vec![period_ns], priority, cpu, phase_ns, ..settings })
    }

    /// The arms by name.
    fn kinds(
        &self,
        args: &Args,
        environment: &Environment,
    ) -> Result<Vec<(String, Kind)>, Failure> {
        let mut loops = args.arms.clone();
        if loops.is_empty() {
            loops.extend([Loop::Sleep, Loop::Hybrid]);
            if cyclictest::check(self).is_ok() {
                loops.push(Loop::Cyclictest);
            }
        }
        let mut kinds = Vec::new();
        for arm in loops {
            let name = arm.to_possible_value().map_or_else(String::new, |v| v.get_name().into());
            kinds.push((name, self.kind(arm, environment)?));
        }
        for (name, plan) in &self.plans {
            kinds.push((name.clone(), Kind::Node(plan.clone())));
        }
        for (index, (name, _)) in kinds.iter().enumerate() {
            if kinds.iter().take(index).any(|(other, _)| other == name) {
                return Err(Failure::usage(format!(
                    "there are two arms \"{name}\"; give each once, and configurations other file names"
                )));
            }
        }
        Ok(kinds)
    }

    fn kind(&self, arm: Loop, environment: &Environment) -> Result<Kind, Failure> {
        Ok(match arm {
            Loop::Sleep => Kind::sleep(),
            Loop::Hybrid => Kind::hybrid(0.2),
            Loop::Economical => Kind::hybrid(0.1),
            Loop::Spin => Kind::spin(loops::longest_spin(environment, self.priority)),
            Loop::Cyclictest => {
                cyclictest::check(self)?;
                Kind::Cyclictest
            }
        })
    }
}

/// The CPU that was asked for, or the last one that this process may use.
fn find_cpu(wanted: Option<usize>) -> Result<usize, Failure> {
    let allowed = allowed_cpus()?;
    match wanted {
        Some(wanted) if allowed.contains(&wanted) => Ok(wanted),
        Some(wanted) => {
            let there: Vec<String> = allowed.iter().map(usize::to_string).collect();
            Err(Failure::usage(format!(
                "there is no CPU {wanted} that this process may use; there are: {}",
                there.join(", ")
            )))
        }
        None => {
            allowed.last().copied().ok_or_else(|| Failure::found("this process may use no CPU"))
        }
    }
}

/// Adds a warning unless it is there.
fn keep(warnings: &mut Vec<Warning>, warning: Warning) {
    if !warnings.contains(&warning) {
        terminal::note(&format!("warning: {}\n  remedy: {}", warning.message, warning.remedy));
        warnings.push(warning);
    }
}

fn parse_period(text: &str) -> Result<u64, String> {
    match parse_milliseconds_ns(text)? {
        period_ns @ 10_000..=1_000_000_000 => Ok(period_ns),
        _ => Err("a period is 10us to 1s".into()),
    }
}
