//! `run`: the control node.

mod beside;
mod ending;
mod report;

use std::path::{Path, PathBuf};
use std::time::Duration;

use isochrone_blocks::BlockType;
use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_engine::{Diagnostic, Diagnostics, Plan, Problem, parse_seconds};
use isochrone_processes::Stop;
use isochrone_runtime::journal::Journal;
use isochrone_runtime::state::{Restored, Retention, StateFile};
use isochrone_runtime::{Alarm, End, Events, Node, Outcome, Running, hold_panic_messages, warning};
use isochrone_timing::units::counted;
use isochrone_timing::{TaskReport, Warning};

use crate::base::domain;
use crate::base::failure::Failure;
use crate::base::files::{Numbers, OutputFile, ResultFile, keep_apart};
use crate::base::stop;
use crate::base::{configuration, numbers, terminal, throttling};
use crate::program;
use crate::service::Service;

/// How often the stop flag and the service manager are looked at.
const LOOK: Duration = Duration::from_millis(15);

/// Run a control node until Ctrl-C, SIGTERM, --seconds or --cycles
///
/// Each task runs at its period: it reads the newest frame of every input's service, steps the
/// blocks and publishes a frame for every output. Peers may join, leave or be killed at any time.
/// If the machine refuses real-time scheduling, a warning shows the remedy; --strict makes it an
/// error.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone run examples/level.toml\n  \
    isochrone run level.toml --seconds 60 --report level.json\n  isochrone run level.toml --record level.mcap\n  isochrone run level.toml --strict")]
pub(crate) struct Args {
    /// Configuration file (TOML)
    file: PathBuf,
    /// Stop after this time, counted from the first cycle: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Stop after this many cycles of the first task
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    cycles: Option<u64>,
    /// Write the report (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Add to this file what is set, forced, released, undone and applied, with the values before and after.
    /// While it cannot be written, changes are refused
    #[arg(long, value_name = "FILE.jsonl")]
    journal: Option<PathBuf>,
    /// Record every cycle of every task in this file, with its inputs and outputs and what is done to the node:
    /// `replay` repeats the run bit for bit. No file is replaced: where level.mcap is there, level_0002.mcap is written,
    /// and so on. If the file cannot be written any more, the node runs on without it
    #[arg(long, value_name = "FILE.mcap")]
    record: Option<PathBuf>,
    /// Retain the state of the node in this file instead of NODE.state in $STATE_DIRECTORY or
    /// ~/.local/state/isochrone. The configuration says retain = true
    #[arg(long, value_name = "FILE.state")]
    state: Option<PathBuf>,
    /// Start without the state that the node retained, which is kept as FILE.state.cold
    #[arg(long)]
    cold: bool,
    /// Print the report as JSON instead of the table
    #[arg(long)]
    json: bool,
    /// Refuse to start if there are warnings or the requested scheduling is refused
    #[arg(long)]
    strict: bool,
    /// Exit with status 1 if a block reported an error
    #[arg(long)]
    fail_on_block_errors: bool,
    #[command(flatten)]
    take_over: domain::TakeOver,
    #[command(flatten)]
    domain: domain::Args,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let mut plan = configuration::plan(&args.file, catalogue)?;
    if args.strict {
        configuration::refuse_warnings(&plan)?;
    }
    require_services(&plan)?;
    configuration::note_warnings(&plan);
    configuration::note_max_age(&plan);
    keep_apart([&args.report, &args.journal, &args.record].into_iter().flatten())?;
    if let Some(report) = &args.report {
        configuration::keep(&args.file, report)?;
    }
    let state_file = state_file(args, &plan)?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let journal =
        args.journal.as_deref().map(|file| open_journal(file, args, &plan)).transpose()?;
    let recording = args.record.as_deref().map(|file| open_recording(file, args)).transpose()?;
    let retention = state_file.map(|file| retention(args, &plan, file)).transpose()?.flatten();
    let stop = stop::on_signal(None)?;
    hold_panic_messages();

    let mut report = program::report();
    if plan.tasks.iter().any(|task| task.settings.priority.is_some()) {
        report.warnings.extend(prepare_process().refusals.iter().map(warning));
    }
    let name = format!("isochrone/{}", plan.node);
    let participant = args.take_over.of(args.domain.join(&name)?);
    let mut users = beside::find(&plan, &participant)?;
    let cpus = beside::choose_cpus(&mut plan, &mut users);
    throttling::refuse(&plan, &cpus, &report.environment)?;
    report.warnings.extend(beside::choose_phases(&mut plan, &mut users));
    let prepared = Node::prepare_at(&plan, &cpus, retention, participant)
        .map_err(Failure::found)?
        .with_cycles(args.cycles);
    let refused: Vec<Warning> = prepared.refusals().map(warning).collect();
    let known = report.warnings.iter().chain(&refused);
    if args.strict && known.clone().next().is_some() {
        let refusals: Vec<String> = known.map(sentence).collect();
        return Err(Failure::found(refusals.join("\n")));
    }
    let prepared = match recording {
        Some(file) => {
            let name = file.path().display().to_string();
            let failed = |error| Failure::usage(format!("cannot write {name}: {error}"));
            prepared.with_recording(name.clone(), file).map_err(failed)?
        }
        None => prepared,
    };
    beside::note_unpinned(&cpus, prepared.grants());
    prepared.restored().into_iter().for_each(note_restored);
    // No reason to refuse the start: the cycles are what they would be without telemetry.
    let known = known.cloned().chain(prepared.alarms().iter().map(Into::into));
    note_start(&plan, known);
    let prepared = match journal {
        Some(journal) => prepared.with_journal(journal).map_err(Failure::usage)?,
        None => prepared,
    };
    if prepared.is_held() {
        let (program, node) = (program::name(), &plan.node);
        terminal::note(&format!("note: it sends nothing until you run `{program} start {node}`"));
    }
    let events = prepared.events();
    let node = prepared.start();
    let ahead_ns = node.epoch_ns().saturating_sub(Monotonic.now_ns());
    let stop = stop::after(stop, args.seconds, ahead_ns);
    run_until(&node, events, &plan, &stop);
    let (of_node, outcome, panicked) = match node.finish() {
        Ok(outcome) => (outcome.report(), outcome, Ok(())),
        Err(error) => {
            let (report, panicked) = (error.report(), Failure::found(&error));
            (report, error.into_outcome(), Err(panicked))
        }
    };
    let report = report::complete(report, of_node);
    for force in &outcome.forces {
        let by = force.client.as_ref().map_or_else(String::new, |name| format!(", by {name}"));
        terminal::note(&format!(
            "note: \"{}\" was still forced to {} when the node ended{by}",
            force.name, force.value
        ));
    }
    let is_kept = |alarm: &Alarm| !matches!(alarm, Alarm::StateIncomplete { .. });
    let are_kept = plan.retain.is_some() && outcome.alarms.iter().all(is_kept);
    if let Some(lost) = unsaved(&outcome).filter(|_| !are_kept) {
        terminal::note(&lost);
    }

    if let Some(file) = report_file {
        file.write_report(&report)?;
    }
    if args.json {
        terminal::print_json(&report)?
    } else {
        terminal::print(&report.to_string())?
    }
    panicked.and_then(|()| verdict(args, &outcome))
}

/// Opens the journal, and says if a node was killed while it wrote there.
fn open_journal(path: &Path, args: &Args, plan: &Plan) -> Result<Journal, Failure> {
    for other in [Some(&args.file), args.report.as_ref()].into_iter().flatten() {
        configuration::keep(other, path)?;
    }
    let journal = Journal::open(path, plan).map_err(Failure::usage)?;
    if journal.had_cut_line() {
        terminal::note(&format!(
            "note: {}: its last line was incomplete and is removed: a node was killed while it wrote",
            path.display()
        ));
    }
    Ok(journal)
}

/// Creates the file of a recording, and says if it has another name than was given.
fn open_recording(path: &Path, args: &Args) -> Result<OutputFile, Failure> {
    configuration::keep(&args.file, path)?;
    let file = OutputFile::create_recording(path, Numbers::IfTaken).map_err(Failure::usage)?;
    if file.path() != path {
        let (there, taken) = (path.display(), file.path().display());
        terminal::note(&format!("note: {there} is there already; recording in {taken}"));
    }
    Ok(file)
}

/// The file that the node retains its state in, which nothing else is written to.
fn state_file(args: &Args, plan: &Plan) -> Result<Option<StateFile>, Failure> {
    if plan.retain.is_none() {
        if args.state.is_some() || args.cold {
            let option = if args.cold { "--cold" } else { "--state" };
            return Err(Failure::usage(format!(
                "{option} is for a node that retains its state; write retain = true below [node] of {}",
                args.file.display()
            )));
        }
        return Ok(None);
    }
    let file = match &args.state {
        Some(path) => StateFile::at(path),
        None => StateFile::of(&plan.node).map_err(Failure::usage)?,
    };
    configuration::keep(&args.file, file.path())?;
    let others = [Some(&args.file), args.report.as_ref(), args.journal.as_ref()];
    for other in others.into_iter().chain([args.record.as_ref()]).flatten() {
        if file.owns(other) {
            let (other, file) = (other.display(), file.path().display());
            return Err(Failure::usage(format!(
                "{other} is a file of the retained state {file}, which the node writes itself; name another file"
            )));
        }
        configuration::keep(other, file.path())?;
    }
    Ok(Some(file))
}

/// The state that the node retains, as it was left.
fn retention(args: &Args, plan: &Plan, file: StateFile) -> Result<Option<Retention>, Failure> {
    let opened = if args.cold { Retention::cold(plan, file) } else { Retention::open(plan, file) };
    let opened = opened.map_err(Failure::usage)?;
    if let Some(path) = opened.as_ref().filter(|_| args.cold).and_then(Retention::put_aside) {
        terminal::note(&format!("note: starts cold; the state is kept as {}", path.display()));
    }
    Ok(opened)
}

fn note_restored(restored: &Restored) {
    terminal::note(&format!("note: restored {restored}"));
    for unexpected in &restored.unexpected {
        terminal::note(&format!("note: {unexpected}"));
    }
}

/// Runs the node until it has ended, as it does by itself or is to.
fn run_until(node: &Running, events: Events, plan: &Plan, stop: &Stop) {
    let mut service = Service::find(plan, node);
    while let Some(batch) = events.within(LOOK) {
        for cycle in &batch.cycles {
            service.note(cycle.task, &cycle.record);
        }
        // Also at the end: one that ran a single cycle was ready.
        service.tell();
        if batch.is_ending {
            break;
        }
        if stop.is_due() {
            node.stop();
        }
    }
    // Nobody takes them any more.
    drop(events);
    service.stopping();
    ending::await_end(&plan.node, node);
}

/// Which values were set and are lost, with as many values as one reads.
fn unsaved(outcome: &Outcome) -> Option<String> {
    /// Values that are named.
    const NAMED: usize = 8;
    let count = outcome.unsaved.iter().len();
    let named = outcome.unsaved.iter().take(NAMED).map(|(name, value)| format!("{name} = {value}"));
    let named = named.collect::<Vec<_>>().join(", ");
    let more = count.checked_sub(NAMED).filter(|more| *more > 0);
    let more = more.map_or_else(String::new, |more| format!(" and {more} more"));
    let (values, were) = (counted(count as u64, "value"), if count == 1 { "was" } else { "were" });
    (count > 0).then(|| {
        format!(
            "note: {values} {were} set and not saved: {named}{more}; `isochrone save` keeps such values while the \
             node runs"
        )
    })
}

/// The exit status of the run.
fn verdict(args: &Args, outcome: &Outcome) -> Result<(), Failure> {
    if let End::Overrun { task, missed } = &outcome.end {
        return Err(Failure::found(overrun_sentence(task, *missed)));
    }
    let is_incomplete = |alarm: &&Alarm| {
        matches!(
            alarm,
            Alarm::JournalIncomplete { .. }
                | Alarm::RecordingIncomplete { .. }
                | Alarm::StateIncomplete { .. }
        )
    };
    if let Some(alarm) = outcome.alarms.iter().find(is_incomplete) {
        return Err(Failure::found(alarm));
    }
    let in_error = |task: &TaskReport| {
        let steps = task.block_errors.filter(|steps| *steps > 0)?;
        Some(format!("task \"{}\": {steps} steps of blocks reported an error", task.name))
    };
    let errors: Vec<String> = outcome.tasks.iter().filter_map(in_error).collect();
    if args.fail_on_block_errors && !errors.is_empty() {
        Err(Failure::found(errors.join("\n")))
    } else {
        Ok(())
    }
}

fn sentence(warning: &Warning) -> String {
    format!("{}\n  remedy: {}", warning.message, warning.remedy)
}

/// Why a task stopped the node after too many missed releases.
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

fn note_start(plan: &Plan, warnings: impl Iterator<Item = Warning>) {
    for warning in warnings {
        terminal::note(&format!("warning: {}", sentence(&warning)));
    }
    let names: Vec<_> = plan.tasks.iter().map(|task| task.name.as_str()).collect();
    let tasks = if names.len() == 1 { "task" } else { "tasks" };
    terminal::note(&format!(
        "node \"{}\" is running {tasks} {}. Press Ctrl-C to end it.",
        plan.node,
        names.join(", ")
    ));
}

/// Running needs a service for every input: the command line feeds none.
pub(crate) fn require_services(plan: &Plan) -> Result<(), Failure> {
    let without = plan.tasks.iter().flat_map(|task| &task.inputs).filter(|i| i.service.is_none());
    let diagnostics: Vec<Diagnostic> = without
        .map(|input| {
            let message = format!("input \"{}\" has no service, which `run` needs", input.name);
            Diagnostic::new(Problem::MissingKey, input.span.clone(), message).help(
                "add service = \"…\", the service whose frames carry the value, or make it a \
                     [[variable]] if operators give it",
            )
        })
        .collect();
    if diagnostics.is_empty() {
        Ok(())
    } else {
        Err(Failure::configuration(Diagnostics::new(plan.source.clone(), diagnostics)))
    }
}
