//! `run`: the control node.

mod args;
mod beside;
mod ending;
mod files;
mod report;
mod twin;

use std::time::Duration;

use isochrone_blocks::BlockType;
use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_engine::{Diagnostic, Diagnostics, Plan, Problem};
use isochrone_processes::Stop;
use isochrone_runtime::state::Restored;
use isochrone_runtime::{
    Alarm, End, Events, Node, Outcome, Redundancy, Running, hold_panic_messages, warning,
};
use isochrone_timing::units::counted;
use isochrone_timing::{TaskReport, Warning};

use crate::base::failure::Failure;
use crate::base::files::{ResultFile, keep_apart};
use crate::base::stop;
use crate::base::{configuration, terminal, throttling};
use crate::program;
use crate::service::Service;

pub(crate) use self::args::Args;

/// How often the stop flag and the service manager are looked at.
const LOOK: Duration = Duration::from_millis(15);

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let stop = stop::on_signal(None)?;
    let mut twin = if args.redundant { Joining::Anew } else { Joining::No };
    loop {
        match run_once(args, catalogue, &stop, twin)? {
            Some(orphan) => twin = Joining::StartOver(orphan),
            None => return Ok(()),
        }
    }
}

/// How a process comes to be one of two of a node.
enum Joining {
    /// It is the only one.
    No,
    /// It takes a seat.
    Anew,
    /// The holder died before this one could take over.
    StartOver(Redundancy),
}

/// Runs the node to its end. `Some`: it is to be started anew, as the process that it followed died too early.
fn run_once(
    args: &Args,
    catalogue: &[BlockType],
    stop: &Stop,
    joining: Joining,
) -> Result<Option<Redundancy>, Failure> {
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
    let name = format!("isochrone/{}", plan.node);
    let participant = args.take_over.of(args.domain.join(&name)?);
    let is_due = || stop.is_due();
    let redundancy = match joining {
        Joining::No => None,
        Joining::Anew => Some(Redundancy::join(&plan, &participant, args.after, is_due)),
        Joining::StartOver(orphan) => Some(orphan.start_over(&plan, &participant, is_due)),
    };
    let redundancy = match redundancy.transpose().map_err(Failure::found)? {
        // It was ended while it waited for the holder.
        Some(None) => return Ok(None),
        joined => joined.flatten(),
    };
    let is_standby = redundancy.as_ref().is_some_and(|joined| joined.holder().is_some());
    let state_file = files::state_file(args, &plan)?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let journal = args.journal.as_deref().filter(|_| !is_standby);
    let journal = journal.map(|file| files::open_journal(file, args, &plan)).transpose()?;
    let recording =
        args.record.as_deref().map(|file| files::open_recording(file, args)).transpose()?;
    let retention = state_file
        .map(|file| files::retention(args, &plan, file, redundancy.as_ref()))
        .transpose()?
        .flatten();
    hold_panic_messages();

    let mut report = program::report();
    if plan.tasks.iter().any(|task| task.settings.priority.is_some()) {
        report.warnings.extend(prepare_process().refusals.iter().map(warning));
    }
    let mut users = beside::find(&plan, &participant)?;
    let cpus = beside::choose_cpus(&mut plan, &mut users);
    throttling::refuse(&plan, &cpus, &report.environment)?;
    report.warnings.extend(beside::choose_phases(&mut plan, &mut users));
    let prepared = match &redundancy {
        Some(joined) => Node::prepare_redundant(&plan, &cpus, retention, participant, joined),
        None => Node::prepare_at(&plan, &cpus, retention, participant),
    };
    let prepared = prepared.map_err(Failure::found)?.with_cycles(args.cycles);
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
    note_start(&plan, known, redundancy.as_ref());
    let prepared = match journal {
        Some(journal) => prepared.with_journal(journal).map_err(Failure::usage)?,
        None => prepared,
    };
    let prepared = match args.journal.as_deref().filter(|_| args.redundant) {
        Some(file) => prepared.with_journal_at_takeover(file, &plan),
        None => prepared,
    };
    if prepared.is_held() {
        let (program, node) = (program::name(), &plan.node);
        terminal::note(&format!("note: it sends nothing until you run `{program} start {node}`"));
    }
    let events = prepared.events();
    let node = prepared.start();
    let ahead_ns = node.epoch_ns().saturating_sub(Monotonic.now_ns());
    let stop = stop::after(stop.clone(), args.seconds, ahead_ns);
    let twin = redundancy.as_ref().map(|redundancy| twin::Twin::new(&plan.node, redundancy));
    run_until(&node, events, &plan, &stop, twin);
    let (of_node, outcome, panicked) = match node.finish() {
        Ok(outcome) => (outcome.report(), outcome, Ok(())),
        Err(error) => {
            let (report, panicked) = (error.report(), Failure::found(&error));
            (report, error.into_outcome(), Err(panicked))
        }
    };
    if let Some(orphan) = redundancy.filter(Redundancy::is_orphaned) {
        let how = if orphan.was_complete() {
            "while it had not heard this one for 100 ms"
        } else {
            "too early"
        };
        terminal::note(&format!(
            "note: the process that this one followed has died {how}; this one starts the node anew"
        ));
        return Ok(Some(orphan));
    }
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
    panicked.and_then(|()| verdict(args, &outcome)).map(|()| None)
}

fn note_restored(restored: &Restored) {
    terminal::note(&format!("note: restored {restored}"));
    for unexpected in &restored.unexpected {
        terminal::note(&format!("note: {unexpected}"));
    }
}

/// Runs the node until it has ended, as it does by itself or is to.
fn run_until(
    node: &Running,
    events: Events,
    plan: &Plan,
    stop: &Stop,
    mut twin: Option<twin::Twin<'_>>,
) {
    let mut service = Service::find(plan, node);
    while let Some(batch) = events.within(LOOK) {
        for cycle in &batch.cycles {
            service.note(cycle.task, &cycle.record);
        }
        // Also at the end: one that ran a single cycle was ready.
        if let Some(is_ready) = twin.as_ref().and_then(twin::Twin::stands_by) {
            service.stand_by(is_ready);
        }
        service.tell();
        twin.iter_mut().for_each(twin::Twin::tell);
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

fn note_start(
    plan: &Plan,
    warnings: impl Iterator<Item = Warning>,
    redundancy: Option<&Redundancy>,
) {
    for warning in warnings {
        terminal::note(&format!("warning: {}", sentence(&warning)));
    }
    let names: Vec<_> = plan.tasks.iter().map(|task| task.name.as_str()).collect();
    let tasks = if names.len() == 1 { "task" } else { "tasks" };
    let (node, names) = (&plan.node, names.join(", "));
    let text = match redundancy.map(Redundancy::holder) {
        None => format!("node \"{node}\" is running {tasks} {names}"),
        Some(None) => format!("node \"{node}\" is running {tasks} {names} and waits for a standby"),
        Some(Some(holder)) => format!("node \"{node}\" stands by for process {holder}"),
    };
    terminal::note(&format!("{text}. Press Ctrl-C to end it."));
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
