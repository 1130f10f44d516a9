//! `list`: who is in the domain, and what they exchange.

mod control;
mod control_text;
mod document;
mod look;

use isochrone_engine::escaped;
use isochrone_ipc::{ListedNode, Participant, SignalSpec, ipc};
use isochrone_report::Table;
use isochrone_runtime::Conflict;
use isochrone_timing::units::counted;

use self::control::control_nodes;
use self::document::{Document, ServiceRow};
use self::look::look;
use crate::failure::Failure;
use crate::{domain, stop, terminal};

/// List the nodes and frame services of the domain
///
/// For each control node, shows its tasks with rate, phase, CPU, cycle and missed cycles, and what `control`
/// allows; then which tasks share a CPU and need it at the same time, and which keep a task that they follow
/// from sending. Of a node that does not answer, says whether its process is stopped, and how to wake it.
/// For each service, shows its rate, the flags of its newest frame if it has any, its publishers and
/// readers, and its signals with type and unit as the publisher announces them. The rate is the
/// announced one; if none is announced, frames are counted for half a second.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone list\n  isochrone list --json | jq '.services[].name'"
)]
pub(crate) struct Args {
    /// Print one JSON document, with all signals
    #[arg(long)]
    json: bool,
    /// Print only the service names, one per line, without counting frames
    #[arg(long, conflicts_with = "json")]
    names: bool,
    /// Print only the names of control nodes, one per line, as `show`, `set` and the like take them
    #[arg(long, conflicts_with_all = ["json", "names"])]
    nodes: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// Maximum signals shown per service; telemetry can have a thousand.
const SHOWN: usize = 12;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let stop = stop::on_signal(None)?;
    let participant = args.domain.join("isochrone/list")?;
    if args.names {
        let names = participant.frame_service_names().map_err(Failure::found)?;
        return terminal::print(&names.iter().map(|name| format!("{name}\n")).collect::<String>());
    }
    if args.nodes {
        return terminal::print(&control::names(&participant)?);
    }
    let nodes = participant.nodes().map_err(Failure::found)?;
    let control_nodes = control_nodes(&participant, &stop)?;
    let services = look(&participant, &stop)?;
    let conflicts = control::conflicts(&control_nodes);
    let document = Document::of(&control_nodes, &conflicts, &nodes, &services);
    if args.json {
        return terminal::print_json(&document);
    }
    if nodes.is_empty() && services.is_empty() {
        terminal::note(&domain::nothing_runs("nothing", &participant.domain()));
        return Ok(());
    }
    terminal::print(&text(&document, &conflicts))
}

/// An existing service whose name is close to a missing one.
pub(crate) fn similar(participant: &Participant<ipc::Service>, service: &str) -> Option<String> {
    let names = participant.frame_service_names().ok()?;
    let others = names.iter().map(String::as_str).filter(|name| *name != service);
    isochrone_engine::nearest_name(service, others).map(str::to_owned)
}

fn text(document: &Document<'_>, conflicts: &[Conflict]) -> String {
    let Document { control_nodes, nodes, services, .. } = document;
    let mut text = control_text::text(control_nodes);
    text += &control_text::conflicts_text(conflicts);
    text += &(counted(nodes.len(), "node") + "\n");
    let mut table = Table::default();
    for node in *nodes {
        table.row([&*escaped(&node.name), &format!("pid {}", node.pid), &*escaped(&node.program)]);
    }
    text += &table.draw(2);
    text += &format!("\n{}\n", counted(services.len(), "service"));
    for found in services {
        let doubts = found.flags.as_ref().filter(|flags| !flags.is_empty());
        let doubts = doubts.map_or_else(String::new, |flags| format!("  [{}]", flags.join(" ")));
        text += &format!("  {}  {}{doubts}\n", escaped(found.name), found.rate.text());
        let mut table = Table::default();
        table.row(["from".to_owned(), publishers(found)]);
        table.row(["to".to_owned(), joined(found.subscribers, "nobody")]);
        text += &table.draw(4);
        text += &signals(found.signals.unwrap_or_default());
    }
    text
}

fn signals(signals: &[SignalSpec]) -> String {
    let mut table = Table::default();
    for (channel, signal) in signals.iter().take(SHOWN).enumerate() {
        let name = match signal.name.as_str() {
            "" => format!("ch{channel}"),
            name => escaped(name).into_owned(),
        };
        table.row([&*name, &*escaped(&signal.value_type), &*escaped(&signal.unit)]);
    }
    match signals.len() {
        0 => "    signals are not announced\n".into(),
        all if all > SHOWN => {
            format!("{}    … and {} more; --json lists all\n", table.draw(4), all - SHOWN)
        }
        _ => table.draw(4),
    }
}

/// Who publishes a service: through a link, that is somebody on another machine.
fn publishers(found: &ServiceRow<'_>) -> String {
    let here = joined(found.publishers, "nobody");
    match found.announced_by {
        Some(publisher) if found.is_far == Some(true) => {
            format!("{} on another machine, through {here}", escaped(publisher))
        }
        _ => here,
    }
}

/// Nodes of one name are one entry; one without a name goes by its program's.
fn joined(nodes: &[ListedNode], nobody: &str) -> String {
    let mut said: Vec<String> = Vec::new();
    for node in nodes {
        let name = if node.name.is_empty() { &node.program } else { &node.name };
        let node = format!("{} (pid {})", escaped(name), node.pid);
        if !said.contains(&node) {
            said.push(node);
        }
    }
    if said.is_empty() { nobody.to_owned() } else { said.join(", ") }
}
