//! `check`: reads and plans a configuration, and shows what would run.

mod alarms;
mod document;
mod expressions;
mod text;

pub(crate) use alarms::AlarmRow;
pub(crate) use document::WireRow;
pub(crate) use text::settings;

use std::path::PathBuf;

use isochrone_bench::allowed_cpus;
use isochrone_blocks::BlockType;
use isochrone_engine::{Plan, Problem, reference};
use isochrone_machine::Environment;
use isochrone_runtime::{TaskCpu, TaskCpus};

use self::document::{Document, Refusal};
use crate::base::failure::Failure;
use crate::base::{configuration, terminal, throttling};
use crate::run;

/// Check a configuration: print tasks, order, wires and warnings
///
/// A file that passes will run. All errors of a file are reported together, each with its location
/// and what is expected there.
#[derive(clap::Args)]
#[command(
    override_usage = "isochrone check [OPTIONS] <FILE>\n       isochrone check --reference\n       isochrone check --schema",
    after_help = "Examples:\n  isochrone check examples/level.toml\n  isochrone check level.toml --json"
)]
pub(crate) struct Args {
    /// Configuration file (TOML)
    #[arg(required_unless_present_any = ["reference", "schema"])]
    file: Option<PathBuf>,
    /// Print the reference of the configuration file as Markdown
    #[arg(long, conflicts_with_all = ["file", "strict", "json"])]
    reference: bool,
    /// Print the JSON Schema of the configuration file, for editors that complete TOML
    #[arg(long, conflicts_with_all = ["file", "reference", "strict", "json"])]
    schema: bool,
    /// Treat warnings as errors, and inputs without a service, which `run` would refuse
    #[arg(long)]
    strict: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let Some(file) = &args.file else {
        return if args.schema {
            terminal::print_json(&reference::schema(catalogue))
        } else {
            terminal::print(&reference::page())
        };
    };
    let placed = configuration::plan(file, catalogue).and_then(|plan| placed(plan, args.strict));
    let (plan, cpus) =
        placed.or_else(|failure| match failure.diagnostics().filter(|_| args.json) {
            Some(diagnostics) => terminal::print_json(&Refusal::of(diagnostics)).and(Err(failure)),
            None => Err(failure),
        })?;
    if args.json {
        return terminal::print_json(&Document::of(&plan, &cpus));
    }
    configuration::note_warnings(&plan);
    let here = not_here(&plan, &cpus)?;
    if args.strict && !here.is_empty() {
        return Err(Failure::found(here.join("\n")));
    }
    here.iter().for_each(|warning| terminal::note(&format!("warning: {warning}")));
    terminal::print(&text::of(&plan, &cpus))
}

/// Why the configuration would not run as written on this machine.
fn not_here(plan: &Plan, cpus: &TaskCpus) -> Result<Vec<String>, Failure> {
    let allowed = allowed_cpus()?;
    let mut found = Vec::new();
    for (task, place) in plan.tasks.iter().zip(cpus.as_slice()) {
        if let TaskCpu::Named(cpu) = place
            && !allowed.contains(cpu)
        {
            let cpus: Vec<_> = allowed.iter().map(usize::to_string).collect();
            found.push(format!(
                "task \"{}\" cannot have CPU {cpu} here: this process may use {}",
                task.name,
                cpus.join(", ")
            ));
        }
    }
    let refused = throttling::why_refused(plan, cpus, &Environment::read());
    found.extend(refused.map(|why| format!("run would refuse it here: {why}")));
    Ok(found)
}

/// A plan with the CPUs that would be chosen now, and what there is to be warned of then; with `strict`,
/// warnings are errors, and so are inputs without a service.
fn placed(mut plan: Plan, strict: bool) -> Result<(Plan, TaskCpus), Failure> {
    let cpus = TaskCpus::of(&plan);
    cpus.settle(&mut plan);
    plan.warnings.retain(|diagnostic| diagnostic.problem != Problem::StarvedSource);
    let starved = plan.starved_sources();
    plan.warnings.extend(starved);
    if strict {
        configuration::refuse_warnings(&plan)?;
        run::require_services(&plan)?;
    }
    Ok((plan, cpus))
}
