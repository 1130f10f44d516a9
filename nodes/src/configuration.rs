//! From a path on the command line to a plan.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use isochrone_blocks::BlockType;
use isochrone_engine::{
    Diagnostic, Diagnostics, Excerpts, Plan, PlanError, Problem, Rules, Source,
};
use isochrone_ipc::check_service_name;

use crate::failure::Failure;
use crate::terminal;

/// Reads and plans a configuration.
pub(crate) fn plan(path: &Path, catalogue: &[BlockType]) -> Result<Plan, Failure> {
    Plan::read(path, &rules(catalogue)).map_err(|error| match error {
        PlanError::Configuration(diagnostics) => Failure::configuration(diagnostics),
        error => Failure::usage(error),
    })
}

/// Plans a configuration that was read.
pub(crate) fn plan_of(source: Source, catalogue: &[BlockType]) -> Result<Plan, Failure> {
    Plan::new(source, &rules(catalogue)).map_err(Failure::configuration)
}

/// Takes the warnings of a plan for errors.
pub(crate) fn refuse_warnings(plan: &Plan) -> Result<(), Failure> {
    if plan.warnings.is_empty() { Ok(()) } else { Err(Failure::configuration(warnings(plan))) }
}

/// Refuses a name on the command line that no service can have.
pub(crate) fn service_name(name: &str) -> Result<(), Failure> {
    check_service_name(name).map_err(Failure::usage)
}

/// The warnings of a plan, to be shown in its file.
pub(crate) fn warnings(plan: &Plan) -> Diagnostics {
    Diagnostics::new(plan.source.clone(), plan.warnings.clone())
}

/// Refuses to write over a file that is read, by whatever path or name.
pub(crate) fn keep(read: &Path, written: &Path) -> Result<(), Failure> {
    let identity = |path| fs::metadata(path).map(|found| (found.dev(), found.ino()));
    match (identity(read), identity(written)) {
        (Ok(a), Ok(b)) if a == b => {
            let file = written.display();
            Err(Failure::usage(format!("{file} would overwrite what is read; name another file")))
        }
        _ => Ok(()),
    }
}

/// Shows a plan's warnings on stderr, if it has any.
pub(crate) fn note_warnings(plan: &Plan) {
    if !plan.warnings.is_empty() {
        terminal::note_report(&miette::Report::new(Excerpts::from(warnings(plan))));
    }
}

/// Warns if a start with this configuration would be refused because of its values. If the configuration has blocks that
/// this program does not have, that cannot be told.
pub(crate) fn note_refused_values(source: Source, catalogue: &[BlockType]) {
    let (mut found, start) = match Plan::new(source, &rules(catalogue)) {
        Ok(plan) => (warnings(&plan), "`run --strict`"),
        Err(diagnostics) => (diagnostics, "`run`"),
    };
    if found.all.iter().any(|diagnostic| diagnostic.problem == Problem::UnknownBlockType) {
        return;
    }
    // Of all else, the node was warned when it started.
    found.all.retain(|it| it.problem == Problem::ConstantError || !it.is_warning());
    if found.all.is_empty() {
        return;
    }
    terminal::note(&format!("warning: {start} would refuse this configuration"));
    terminal::note_report(&miette::Report::new(Excerpts::from(found)));
}

/// Says on stderr which inputs of a node that is to run are never stale.
pub(crate) fn note_max_age(plan: &Plan) {
    for note in plan.notes.iter().filter(|note| note.problem == Problem::NoMaxAge) {
        terminal::note(&format!("note: {note}"));
    }
}

/// Which diagnostics of a configuration.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Errors,
    Warnings,
}

/// Diagnostics of a kind for programs: kind, message, place and remedy of each.
pub(crate) fn diagnostics_json(diagnostics: &Diagnostics, kind: Kind) -> Vec<serde_json::Value> {
    let starts = diagnostics.all.iter().map(|diagnostic| diagnostic.span.start);
    let placed = diagnostics.all.iter().zip(diagnostics.source.positions(starts));
    let wanted =
        placed.filter(|(diagnostic, _)| diagnostic.is_warning() == (kind == Kind::Warnings));
    wanted.map(|(diagnostic, place)| placed_json(diagnostic, place)).collect()
}

/// A diagnostic for programs.
pub(crate) fn diagnostic_json(source: &Source, diagnostic: &Diagnostic) -> serde_json::Value {
    placed_json(diagnostic, source.position(diagnostic.span.start))
}

fn placed_json(diagnostic: &Diagnostic, (line, column): (usize, usize)) -> serde_json::Value {
    serde_json::json!({
        "code": diagnostic.problem.as_str(),
        "message": diagnostic.message,
        "line": line,
        "column": column,
        "remedy": diagnostic.help,
    })
}

fn rules(catalogue: &[BlockType]) -> Rules<'_> {
    Rules {
        catalogue,
        service_name: |name| check_service_name(name).map_err(|error| error.to_string()),
    }
}
