//! `run`: the control node.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{
    Clock, EPOCH_OFFSET_NS, Monotonic, Refusal, StopReason, ThreadGrant, prepare_process,
};
use isochrone_engine::{Finding, Findings, Plan, Problem, TaskEngine, parse_seconds};
use isochrone_ipc::{OpenError, Participant, Repair, ipc};
use isochrone_machine::Environment;
use isochrone_processes::Stop;
use isochrone_report::{LinkArm, Report};
use isochrone_runtime::{self as runtime, Job, Outcome, Ready, Resolver, Telemetry};
use isochrone_timing::{CycleRecord, TaskReport, TaskTiming, Warning};
use rtrb::{Consumer, RingBuffer};

use crate::domain;
use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::service::Service;
use crate::stop;
use crate::{configuration, terminal, throttling};

/// Run a control node until Ctrl-C, SIGTERM, --seconds or --cycles
///
/// Reads the newest frame of every input's service, steps the blocks and publishes a frame for
/// every output, at the period of each task. Peers may come, go and be killed at any time. Real-time
/// scheduling that the machine refuses is a warning with its remedy; --strict makes it an error.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone run examples/level.toml\n  \
    isochrone run level.toml --seconds 60 --report level.json\n  isochrone run level.toml --strict")]
pub(crate) struct Args {
    /// Configuration file (TOML)
    file: PathBuf,
    /// End after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// End after this many cycles of the first task
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    cycles: Option<u64>,
    /// Write the report (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Print the report as JSON instead of the table
    #[arg(long)]
    json: bool,
    /// Refuse to start with warnings or without the scheduling that was asked for
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// Records that fit between the cycle and the thread that reads them: 40 ms at the shortest period.
const RING_RECORDS: usize = 4096;
/// How often the records are read.
const DRAIN_INTERVAL: Duration = Duration::from_millis(20);
/// From the end of the set-up to the first release.
const START_DELAY_NS: u64 = 20_000_000;
/// Ticks of 100, 250 and 1000 Hz fall on multiples of this.
const EPOCH_GRID_NS: u64 = 20_000_000;

/// An instant, `START_DELAY_NS` and a little from now, at which a grid may begin. The kernel's ticks
/// come at whole milliseconds of the clock; a release that meets one is late by what the tick does.
/// So the grid begins between them.
pub(crate) fn next_epoch_ns() -> u64 {
    (Monotonic.now_ns() + START_DELAY_NS).next_multiple_of(EPOCH_GRID_NS) + EPOCH_OFFSET_NS
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let plan = configuration::plan_strictly(&args.file, args.strict)?;
    require_services(&plan)?;
    configuration::note_warnings(&plan);
    if let Some(report) = &args.report {
        configuration::keep(&args.file, report)?;
    }
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let stop = stop::on_signal(args.seconds)?;

    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    if plan.tasks.iter().any(|task| task.priority.is_some()) {
        report.warnings.extend(prepare_process().refusals.iter().map(warning));
    }
    throttling::refuse(&plan, &report.environment)?;
    let participant =
        Participant::join_for_real_time(&format!("isochrone/{}", plan.node), &args.domain.find()?)
            .map_err(Failure::found)?;
    let options = Options { cycles: args.cycles, strict: args.strict, announce: true };
    let overrun = run_tasks(&options, &plan, &participant, &stop, &mut report, &mut ())?;
    drop(participant);

    if let Some(file) = report_file {
        file.write_report(&report)?;
    }
    match args.json {
        true => terminal::print_json(&report)?,
        false => terminal::print(&report.to_string())?,
    }
    match overrun {
        None => Ok(()),
        Some(sentence) => Err(Failure::found(sentence)),
    }
}

/// How to run the tasks.
pub(crate) struct Options {
    /// End after this many cycles of the first task.
    pub(crate) cycles: Option<u64>,
    /// Refuse to start with warnings.
    pub(crate) strict: bool,
    /// Tell people that the node runs, and what the machine refused.
    pub(crate) announce: bool,
}

/// Who else wants to see the cycles.
pub(crate) trait Observer {
    /// The next cycle of a task, by its place in the plan.
    fn record(&mut self, _task: usize, _record: &CycleRecord) {}
    /// Some fifty times a second.
    fn look(&mut self) {}
}

impl Observer for () {}

/// Runs all tasks to their end and completes the report. Returns why the node stopped if a task
/// that overran stopped it.
pub(crate) fn run_tasks(
    options: &Options,
    plan: &Plan,
    participant: &Participant<ipc::Service>,
    stop: &Stop,
    report: &mut Report,
    observer: &mut dyn Observer,
) -> Result<Option<String>, Failure> {
    let (mut telemetry, taps) = Telemetry::open(participant, plan).map_err(Failure::found)?;
    thread::scope(|scope| {
        let mut threads = Vec::new();
        let mut watches = Vec::new();
        let engines = TaskEngine::build(plan).map_err(Failure::found)?.into_iter().zip(taps);
        for (index, (task, (engine, tap))) in plan.tasks.iter().zip(engines).enumerate() {
            let (ready, is_ready) = channel();
            let (start, epoch_ns) = channel();
            let (records, consumer) = RingBuffer::new(RING_RECORDS);
            let job = Job {
                plan: task,
                participant,
                engine,
                cycles: options.cycles.filter(|_| index == 0),
                stop: stop.flag(),
                records,
                tap,
                ready,
                epoch_ns,
            };
            let spawned = thread::Builder::new()
                .name(task.name.chars().take(15).collect())
                .spawn_scoped(scope, move || runtime::run(job));
            let thread = spawned
                .map_err(|error| Failure::found(format!("cannot start a thread: {error}")))?;
            threads.push((thread, start));
            let timing = TaskTiming::new(task.schedule.period_ns);
            watches.push(Watch {
                timing,
                consumer,
                is_ready,
                repairs: Vec::new(),
                resolvers: Vec::new(),
            });
        }

        // Dropping `start` without a word, as every early return does, ends the threads.
        let grants = watches
            .iter_mut()
            .map(|watch| watch.granted(participant))
            .collect::<Result<Vec<ThreadGrant>, Failure>>()?;
        let mut announcers = runtime::announcers(participant, plan).map_err(Failure::found)?;
        report.warnings.extend(grants.iter().flat_map(|grant| &grant.refusals).map(warning));
        if options.strict && !report.warnings.is_empty() {
            let refusals: Vec<String> = report.warnings.iter().map(sentence).collect();
            return Err(Failure::found(refusals.join("\n")));
        }
        // No reason to refuse the start: the cycles are what they would be without telemetry.
        report.warnings.extend(Telemetry::warnings(plan));
        if options.announce {
            note_start(plan, report);
        }
        let epoch_ns = next_epoch_ns();
        for (_, start) in &threads {
            let _ = start.send(epoch_ns);
        }
        let mut service = Service::find(plan, epoch_ns);
        while !stop.is_due() {
            thread::sleep(DRAIN_INTERVAL);
            for (task, watch) in watches.iter_mut().enumerate() {
                if let Some(newest) = watch.drain(|record| observer.record(task, record)) {
                    telemetry.note(task, &newest);
                    service.note(task, &newest);
                }
                for repair in &mut watch.repairs {
                    repair.tend(participant);
                }
                for resolver in &mut watch.resolvers {
                    resolver.tend(participant);
                }
            }
            for announcer in &mut announcers {
                announcer.tend(participant);
            }
            observer.look();
            telemetry.publish(participant);
            service.tell();
        }
        service.stopping();
        let mut overrun = None;
        let tasks = threads.into_iter().zip(watches).zip(plan.tasks.iter().zip(grants));
        for (index, (((thread, _), mut watch), (task, grant))) in tasks.enumerate() {
            let outcome = thread.join().map_err(|_| Failure::found("a task's thread panicked"))?;
            watch.drain(|record| observer.record(index, record));
            report.warnings.extend(watch.resolvers.iter_mut().flat_map(Resolver::alarms));
            let Some(outcome) = outcome else { continue };
            if outcome.stop_reason == Some(StopReason::Overrun) {
                overrun = Some(overrun_sentence(&task.name, watch.timing.missed()));
            }
            report.links.extend(outcome.links.iter().cloned().map(LinkArm::from));
            let task = TaskReport {
                wake: task.schedule.wake.as_str().into(),
                scheduler: grant.scheduler,
                cpu: grant.cpu,
                margin_ns: outcome.margin_ns,
                ..task_report(watch.timing.report(&task.name), &outcome)
            };
            report.tasks.push(task.into());
        }
        Ok(overrun)
    })
}

/// What the main thread keeps of a task.
struct Watch {
    timing: TaskTiming,
    consumer: Consumer<CycleRecord>,
    is_ready: Receiver<Result<Ready, OpenError>>,
    repairs: Vec<Repair>,
    resolvers: Vec<Resolver>,
}

impl Watch {
    /// Waits for the end of the task's set-up.
    fn granted(&mut self, participant: &Participant<ipc::Service>) -> Result<ThreadGrant, Failure> {
        let gone = |_| Failure::found("a task's thread ended during its set-up");
        let ready = self.is_ready.recv().map_err(gone)?.map_err(Failure::found)?;
        self.repairs = ready.repairs;
        let resolvers = ready.desks.into_iter().map(|desk| Resolver::open(participant, desk));
        self.resolvers = resolvers.collect::<Result<_, _>>().map_err(Failure::found)?;
        Ok(ready.grant)
    }

    /// Takes all records in, and shows them; returns the newest.
    fn drain(&mut self, mut show: impl FnMut(&CycleRecord)) -> Option<CycleRecord> {
        let mut newest = None;
        while let Ok(record) = self.consumer.pop() {
            self.timing.record(&record);
            show(&record);
            newest = Some(record);
        }
        newest
    }
}

fn task_report(report: TaskReport, outcome: &Outcome) -> TaskReport {
    TaskReport {
        cpu_fraction: Some(outcome.usage.cpu_ns as f64 / outcome.elapsed_ns.max(1) as f64),
        allocations: Some(outcome.allocations),
        ipc_allocations: Some(outcome.ipc_allocations),
        minor_faults: Some(outcome.usage.minor_faults),
        major_faults: Some(outcome.usage.major_faults),
        voluntary_switches: Some(outcome.usage.voluntary_switches),
        involuntary_switches: Some(outcome.usage.involuntary_switches),
        block_errors: Some(outcome.block_errors),
        input_rejects: Some(outcome.input_rejects),
        connects: Some(outcome.connects),
        connect_errors: Some(outcome.connect_errors),
        lost_snapshots: Some(outcome.lost_snapshots),
        ..report
    }
}

pub(crate) fn warning(refusal: &Refusal) -> Warning {
    Warning { code: refusal.code().into(), message: refusal.to_string(), remedy: refusal.remedy() }
}

fn sentence(warning: &Warning) -> String {
    format!("{}\n  remedy: {}", warning.message, warning.remedy)
}

/// Why a task stopped the node that missed so many releases.
fn overrun_sentence(task: &str, missed: u64) -> String {
    match missed {
        // A limit counts missed releases, so this was `overrun`.
        0 => format!(
            "task \"{task}\" ended a cycle after its next release was due and stopped the node, as its \
             overrun says"
        ),
        _ => format!(
            "task \"{task}\" missed a release and stopped the node, as its overrun and on_overrun say"
        ),
    }
}

fn note_start(plan: &Plan, report: &Report) {
    for warning in &report.warnings {
        terminal::note(&format!("warning: {}", sentence(warning)));
    }
    let tasks: Vec<_> = plan.tasks.iter().map(|task| task.name.as_str()).collect();
    terminal::note(&format!("node \"{}\" runs: {}. Ctrl-C ends it.", plan.node, tasks.join(", ")));
}

/// Running needs a service for every input.
pub(crate) fn require_services(plan: &Plan) -> Result<(), Failure> {
    let without = plan.tasks.iter().flat_map(|task| &task.inputs).filter(|i| i.service.is_none());
    let findings: Vec<Finding> = without
        .map(|input| {
            let message = format!("input \"{}\" has no service, which `run` needs", input.name);
            Finding::new(Problem::MissingKey, input.span.clone(), message)
                .help("add service = \"…\", the service whose frames carry the value")
        })
        .collect();
    match findings.is_empty() {
        true => Ok(()),
        false => Err(Failure::configuration(Findings::new(plan.source.clone(), findings))),
    }
}
