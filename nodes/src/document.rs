//! `document`: a configuration as a page to print, for the people who maintain the plant.

mod blocks;
mod connections;
mod references;
mod signals;

use std::path::PathBuf;

use isochrone_blocks::BlockType;
use isochrone_engine::{Plan, format_duration_ns};
use isochrone_model::Access;
use isochrone_report::{Page, Row, TableColumn};
use isochrone_timing::units::counted;

use crate::base::configuration;
use crate::base::failure::Failure;
use crate::base::files::ResultFile;
use crate::check::{AlarmRow, settings};
use connections::Connections;

/// Write a configuration as a page to print: tasks, signals, blocks and who reads what
///
/// The page is one file of HTML that fetches nothing: tasks, inputs, variables, blocks with their pins, constants and
/// wires, process alarms, outputs, limits and protected signals, each with its unit and comment, and for every signal who writes it
/// and who reads it. It names the version of the program and the SHA-256 of the configuration, and contains no date:
/// the same configuration gives the same page.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone document examples/level.toml -o level.html\n  \
    chromium --headless --print-to-pdf=level.pdf level.html")]
pub(crate) struct Args {
    /// Configuration file (TOML)
    file: PathBuf,
    /// Page to write; an old one is replaced when the new one is complete
    #[arg(short, long, value_name = "PLANT.html")]
    output: PathBuf,
}

/// For paper: A4 with page numbers, tables as wide as the page, and no heading at the end of a page.
const STYLE: &str = "<style>
@page { size: A4; margin: 14mm 12mm 16mm; @bottom-right { content: counter(page) \" / \" counter(pages); font: 9px system-ui, sans-serif; } }
h3 code { font-size: 1rem; }
h3 + p { margin: .1rem 0; }
table { width: 100%; }
h1 { font-size: 1.7rem; }
td, tbody th { overflow-wrap: anywhere; min-width: 4.4rem; padding: .15rem .5rem; line-height: 1.35; }
td.n { white-space: normal; }
section { margin-top: 1rem; }
@media print { :root { color-scheme: light; --ink: #000000; --soft: #444b52; --paper: #ffffff; --line: #b9c0c7; --head: #eef1f4; } h2 { margin-top: 1.4rem; } h3 { margin-top: 1rem; } .scroll { margin: .4rem 0; } section.block { break-inside: avoid; } tbody th { white-space: normal; } nav ul { font-size: 10px; } * { print-color-adjust: exact; } }
</style>
";

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    configuration::keep(&args.file, &args.output)?;
    let plan = configuration::plan(&args.file, catalogue)?;
    configuration::note_warnings(&plan);
    ResultFile::open(&args.output)?.write(&page(&plan))
}

fn page(plan: &Plan) -> String {
    let connections = Connections::of(plan);
    let mut page = Page::begin(&plan.node);
    page.markup(STYLE);
    head(&mut page, plan);
    page.markup("</header>\n<main>\n");
    page.contents();
    tasks(&mut page, plan);
    signals::inputs(&mut page, plan);
    signals::variables(&mut page, plan);
    blocks::section(&mut page, plan, &connections);
    signals::outputs(&mut page, plan);
    alarms(&mut page, plan);
    operation(&mut page, plan);
    references::section(&mut page, plan, &connections);
    notes(&mut page, plan);
    page.markup("</main>\n</body>\n</html>\n");
    page.finish()
}

fn head(page: &mut Page, plan: &Plan) {
    let count = |of: fn(&isochrone_engine::TaskPlan) -> usize, what| {
        counted(plan.tasks.iter().map(of).sum::<usize>(), what)
    };
    let parts = [
        counted(plan.tasks.len(), "task"),
        count(|task| task.inputs.len(), "input"),
        count(|task| task.variables.len(), "variable"),
        counted(plan.instances(), "block"),
        count(|task| task.outputs.len(), "output"),
        count(|task| task.alarms.len(), "alarm"),
    ];
    page.element("<p>", format!("Control node with {}.", parts.join(", ")), "</p>\n");
    page.markup("<p class=\"soft\">");
    let (file, version) = (&plan.source.name, env!("CARGO_PKG_VERSION"));
    page.text(format!(
        "Configuration {file}, as isochrone {version} reads it. SHA-256 of the file: "
    ));
    page.element("<code>", plan.source.sha256(), "</code></p>\n");
}

fn tasks(page: &mut Page, plan: &Plan) {
    page.heading("Tasks");
    let columns =
        [TableColumn::Words("task"), TableColumn::Words("runs"), TableColumn::Number("blocks")];
    let row = |task: &isochrone_engine::TaskPlan| {
        let blocks: usize = task.block_banks().map(|bank| bank.instances.len()).sum();
        Row::of([task.name.clone(), settings(&task.settings), blocks.to_string()])
    };
    page.table(
        "Each task runs its blocks once in each period, in the order of this page",
        &columns,
        plan.tasks.iter().map(row),
    );
}

/// What is wrong with the plant.
fn alarms(page: &mut Page, plan: &Plan) {
    if plan.alarms().next().is_none() {
        return;
    }
    page.heading("Alarms");
    let columns = ["alarm", "severity", "when", "text"].map(TableColumn::Words);
    for task in plan.tasks.iter().filter(|task| !task.alarms.is_empty()) {
        let rows = task.alarms.iter().map(|alarm| Row::of(AlarmRow::of(alarm).cells()));
        page.table(format!("Task {}", task.name), &columns, rows);
    }
}

/// What may be done to the running node.
fn operation(page: &mut Page, plan: &Plan) {
    page.heading("Operation");
    let allowed = match plan.control {
        Access::Off => "Nobody can ask or change the running node (control = \"off\").",
        Access::Read => {
            "Values of the running node can be read, and not changed (control = \"read\")."
        }
        Access::Set => {
            "Parameters and variables can be set while the node runs (control = \"set\")."
        }
        Access::Force => {
            "Parameters and variables can be set, signals forced, and the configuration replaced \
             while the node runs (control = \"force\")."
        }
    };
    page.element("<p>", allowed, "</p>\n");
    let restart = match plan.retain {
        Some(retain) => format!(
            "A restart goes on where the node ended, unless that is longer ago than {}; what was set comes back at \
             any age (retain = true).",
            format_duration_ns(retain.for_ns)
        ),
        None => "A restart begins with the values of this page: what was set is gone unless it was saved.".into(),
    };
    page.element("<p>", restart, "</p>\n");
    let number = |value: f64| format!("{value:?}");
    let limits = plan
        .limits
        .iter()
        .map(|limit| Row::of([limit.names.clone(), number(limit.min), number(limit.max)]));
    let columns = [
        TableColumn::Words("signal"),
        TableColumn::Number("smallest"),
        TableColumn::Number("largest"),
    ];
    page.table("Limits of what may be set and forced", &columns, limits);
    let protected = plan.protected.iter().map(|names| Row::of([names.clone()]));
    page.table(
        "Protected: nobody sets or forces these",
        &[TableColumn::Words("signal")],
        protected,
    );
}

fn notes(page: &mut Page, plan: &Plan) {
    let notes: Vec<_> = plan.warnings.iter().chain(&plan.notes).collect();
    if notes.is_empty() {
        return;
    }
    page.heading("Notes of the check");
    let row = |note: &&isochrone_engine::Diagnostic| {
        let (line, _) = plan.source.position(note.span.start);
        Row::of([line.to_string(), note.to_string(), note.help.clone().unwrap_or_default()])
    };
    let columns =
        [TableColumn::Number("line"), TableColumn::Words("what"), TableColumn::Words("what to do")];
    page.table("What isochrone check says of the configuration", &columns, notes.iter().map(row));
}
