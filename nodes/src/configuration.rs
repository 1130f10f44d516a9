//! From a path on the command line to a plan.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use isochrone_blocks::BlockType;
use isochrone_engine::{
    ConfigFinding, Excerpts, Findings, Plan, PlanError, Problem, Rules, Source,
};
use isochrone_ipc::check_service_name;

use crate::failure::Failure;
use crate::terminal;

/// Reads and plans a configuration.
pub(crate) fn plan(path: &Path, catalogue: &[BlockType]) -> Result<Plan, Failure> {
    Plan::read(path, &rules(catalogue)).map_err(|error| match error {
        PlanError::Configuration(findings) => Failure::configuration(findings),
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
pub(crate) fn warnings(plan: &Plan) -> Findings {
    Findings::new(plan.source.clone(), plan.warnings.clone())
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

/// Says on stderr why a start with this configuration would be refused for the values in it. Of blocks that this
/// program does not have, nothing can be said.
pub(crate) fn note_refused_values(source: Source, catalogue: &[BlockType]) {
    let (mut found, start) = match Plan::new(source, &rules(catalogue)) {
        Ok(plan) => (warnings(&plan), "`run --strict`"),
        Err(findings) => (findings, "`run`"),
    };
    if found.findings.iter().any(|finding| finding.problem == Problem::UnknownBlockType) {
        return;
    }
    // Of all else, the node was warned when it started.
    found.findings.retain(|it| it.problem == Problem::ConstantError || !it.is_warning());
    if found.findings.is_empty() {
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

/// Which findings of a configuration.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Errors,
    Warnings,
}

/// Findings of a kind for programs: kind, message, place and remedy of each.
pub(crate) fn findings_json(findings: &Findings, kind: Kind) -> Vec<serde_json::Value> {
    let starts = findings.findings.iter().map(|finding| finding.span.start);
    let placed = findings.findings.iter().zip(findings.source.positions(starts));
    let wanted = placed.filter(|(finding, _)| finding.is_warning() == (kind == Kind::Warnings));
    wanted.map(|(finding, place)| placed_json(finding, place)).collect()
}

/// A finding for programs.
pub(crate) fn finding_json(source: &Source, finding: &ConfigFinding) -> serde_json::Value {
    placed_json(finding, source.position(finding.span.start))
}

fn placed_json(finding: &ConfigFinding, (line, column): (usize, usize)) -> serde_json::Value {
    serde_json::json!({
        "code": finding.problem.as_str(),
        "message": finding.message,
        "line": line,
        "column": column,
        "remedy": finding.help,
    })
}

fn rules(catalogue: &[BlockType]) -> Rules<'_> {
    Rules {
        catalogue,
        service_name: |name| check_service_name(name).map_err(|error| error.to_string()),
    }
}
