//! The files that a run writes: journal, recording, and retained state.

use std::path::Path;

use isochrone_engine::Plan;
use isochrone_runtime::Redundancy;
use isochrone_runtime::journal::Journal;
use isochrone_runtime::state::{Retention, StateFile};

use super::args::Args;
use crate::base::configuration;
use crate::base::failure::Failure;
use crate::base::files::{Numbers, OutputFile};
use crate::base::terminal;

/// Opens the journal, and says if a node was killed while it wrote there.
pub(super) fn open_journal(path: &Path, args: &Args, plan: &Plan) -> Result<Journal, Failure> {
    for other in [Some(&args.file), args.report.as_ref()].into_iter().flatten() {
        configuration::keep(other, path)?;
    }
    let open = if args.redundant { Journal::open_beside_twin } else { Journal::open };
    let journal = open(path, plan).map_err(Failure::usage)?;
    if journal.had_cut_line() {
        terminal::note(&format!(
            "note: {}: its last line was incomplete and is removed: a node was killed while it wrote",
            path.display()
        ));
    }
    Ok(journal)
}

/// Creates the file of a recording, and says if it has another name than was given.
pub(super) fn open_recording(path: &Path, args: &Args) -> Result<OutputFile, Failure> {
    configuration::keep(&args.file, path)?;
    let file = OutputFile::create_recording(path, Numbers::IfTaken).map_err(Failure::usage)?;
    if file.path() != path {
        let (there, taken) = (path.display(), file.path().display());
        terminal::note(&format!("note: {there} is there already; recording in {taken}"));
    }
    Ok(file)
}

/// The file that the node retains its state in, which nothing else is written to.
pub(super) fn state_file(args: &Args, plan: &Plan) -> Result<Option<StateFile>, Failure> {
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
pub(super) fn retention(
    args: &Args,
    plan: &Plan,
    file: StateFile,
    redundancy: Option<&Redundancy>,
) -> Result<Option<Retention>, Failure> {
    if let Some(redundancy) = redundancy {
        let holds = redundancy.holder().is_none();
        let opened = Retention::open_beside_twin(plan, file, holds && !args.cold);
        return opened.map_err(Failure::usage);
    }
    let opened = if args.cold { Retention::cold(plan, file) } else { Retention::open(plan, file) };
    let opened = opened.map_err(Failure::usage)?;
    if let Some(path) = opened.as_ref().filter(|_| args.cold).and_then(Retention::put_aside) {
        terminal::note(&format!("note: starts cold; the state is kept as {}", path.display()));
    }
    Ok(opened)
}
