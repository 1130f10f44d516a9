//! `check`: reads and plans a configuration, and shows what would run.

use std::path::PathBuf;

use isochrone_bench::allowed_cpus;
use isochrone_blocks::BlockType;
use isochrone_cyclic::{Margin, Wake};
use isochrone_engine::config::{Bad, Binding, Cpu, OnStale};
use isochrone_engine::{
    Findings, InputPlan, OutputPlan, Plan, Problem, TaskPlan, WirePlan, format_duration_ns,
    reference,
};
use isochrone_machine::Environment;
use isochrone_report::Table;
use isochrone_runtime::{CpuPlace, Places};
use isochrone_timing::units::counted;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::{configuration, numbers, terminal, throttling};

/// Check a configuration: print tasks, order, wires and warnings
///
/// A file that passes will run. All errors of a file are reported together, each with its location
/// and what is expected there.
#[derive(clap::Args)]
#[command(
    override_usage = "isochrone check [OPTIONS] <FILE>\n       isochrone check --reference",
    after_help = "Examples:\n  isochrone check examples/level.toml\n  isochrone check level.toml --json"
)]
pub(crate) struct Args {
    /// Configuration file (TOML)
    #[arg(required_unless_present = "reference")]
    file: Option<PathBuf>,
    /// Print the reference of the configuration file as Markdown
    #[arg(long, conflicts_with_all = ["file", "strict", "json"])]
    reference: bool,
    /// Treat warnings as errors
    #[arg(long)]
    strict: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Maximum rows shown of a long list; JSON has all of them.
const ROWS: usize = 40;

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let Some(file) = args.file.as_ref().filter(|_| !args.reference) else {
        return terminal::print(&reference::page());
    };
    let placed = configuration::plan(file, catalogue).and_then(|plan| placed(plan, args.strict));
    let (plan, places) =
        placed.or_else(|failure| match failure.findings().filter(|_| args.json) {
            Some(findings) => terminal::print_json(&refusal(findings)).and(Err(failure)),
            None => Err(failure),
        })?;
    if args.json {
        return terminal::print_json(&document(&plan, &places));
    }
    configuration::note_warnings(&plan);
    let here = not_here(&plan, &places)?;
    if args.strict && !here.is_empty() {
        return Err(Failure::found(here.join("\n")));
    }
    here.iter().for_each(|warning| terminal::note(&format!("warning: {warning}")));
    terminal::print(&text(&plan, &places))
}

/// Why the configuration would not run as it is written on this machine.
fn not_here(plan: &Plan, places: &Places) -> Result<Vec<String>, Failure> {
    let allowed = allowed_cpus()?;
    let mut found = Vec::new();
    for (task, place) in plan.tasks.iter().zip(places.as_slice()) {
        if let CpuPlace::Named(cpu) = place
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
    let refused = throttling::why_refused(plan, places, &Environment::read());
    found.extend(refused.map(|why| format!("run would refuse it here: {why}")));
    Ok(found)
}

/// A plan with the CPUs that would be chosen now, and what there is to be warned of then; with `strict`,
/// warnings are errors.
fn placed(mut plan: Plan, strict: bool) -> Result<(Plan, Places), Failure> {
    let places = Places::of(&plan);
    places.settle(&mut plan);
    plan.warnings.retain(|finding| finding.problem != Problem::StarvedSource);
    let starved = plan.starved_sources();
    plan.warnings.extend(starved);
    if strict {
        configuration::refuse_warnings(&plan)?;
    }
    Ok((plan, places))
}

fn text(plan: &Plan, places: &Places) -> String {
    let outputs: usize = plan.tasks.iter().map(|task| task.outputs.len()).sum();
    let inputs: usize = plan.tasks.iter().map(|task| task.inputs.len()).sum();
    let mut text = format!(
        "{}: ok. Node \"{}\": {}, {}, {}, {}\n",
        plan.source.name,
        plan.node,
        counted(plan.tasks.len(), "task"),
        counted(inputs, "input"),
        counted(plan.instances(), "block"),
        counted(outputs, "output"),
    );
    for (index, task) in plan.tasks.iter().enumerate() {
        text += &format!("\ntask {}: {}\n", task.name, schedule(task));
        if let Some(CpuPlace::Chosen(choice)) = places.as_slice().get(index) {
            text += &format!("  auto would choose CPU {} now: {choice}\n", choice.cpu);
        }
        let mut inputs = Table::default();
        for input in &task.inputs {
            inputs.row([
                input.name.clone(),
                input.value_type.to_string(),
                origin(input),
                fallback(input),
            ]);
        }
        section(&mut text, "inputs", task.inputs.len(), &inputs);

        let mut order = Table::default();
        let blocks = task
            .banks
            .iter()
            .flat_map(|bank| bank.instances.iter().map(|name| (bank.block_type.name, name)));
        for (position, (block_type, name)) in blocks.take(ROWS).enumerate() {
            order.row([format!("{}.", position + 1), name.clone(), block_type.into()]);
        }
        let blocks = task.banks.iter().map(|bank| bank.instances.len()).sum();
        section(&mut text, "order of execution", blocks, &order);

        let mut wires = Table::default();
        for NamedWire { from, from_task, to } in named_wires(plan, index).take(ROWS) {
            let of_task = from_task.map_or_else(String::new, |task| format!(" of task {task}"));
            wires.row([from + &of_task, "->".into(), to]);
        }
        section(&mut text, "wires", named_wires(plan, index).count(), &wires);

        let mut outputs = Table::default();
        for output in &task.outputs {
            outputs.row([output.service.clone(), signals(output)]);
        }
        section(&mut text, "outputs", task.outputs.len(), &outputs);
    }
    if !plan.notes.is_empty() {
        text += "\nnotes\n";
    }
    for note in &plan.notes {
        let (line, column) = plan.source.position(note.span.start);
        text += &format!("  {}:{line}:{column}: {note}\n", plan.source.name);
        text += &note.help.as_ref().map_or_else(String::new, |help| format!("    {help}\n"));
    }
    text
}

fn section(text: &mut String, title: &str, rows: usize, table: &Table) {
    if rows == 0 {
        return;
    }
    *text += &format!("  {title}\n{}", table.draw(4));
    if table.rows() < rows {
        *text += &format!("    … and {} more (--json lists all)\n", rows - table.rows());
    }
}

fn schedule(task: &TaskPlan) -> String {
    let schedule = &task.schedule;
    let mut words = vec![format!("every {}", format_duration_ns(schedule.period_ns))];
    if let Some(reason) = task.phase_choice.reason() {
        let phase = format_duration_ns(schedule.phase_ns);
        let run = match task.followed_service {
            Some(_) => "run takes that of the source",
            None => "run keeps clear of what runs",
        };
        words.push(format!("phase {phase} (auto: {reason}; {run})"));
    } else if schedule.phase_ns > 0 {
        words.push(format!("phase {}", format_duration_ns(schedule.phase_ns)));
    }
    words.extend(task.ob.map(|ob| format!("OB {ob}")));
    words.push(match task.priority {
        Some(priority) => format!("SCHED_FIFO {priority}"),
        None => "normal scheduling".into(),
    });
    words.extend(match task.cpu {
        Cpu::Number(cpu) => Some(format!("CPU {cpu}")),
        Cpu::Auto { .. } => Some("CPU auto".into()),
        Cpu::Any => task.priority.map(|_| "any CPU".into()),
    });
    let wake = schedule.wake.as_str();
    words.push(match schedule.wake {
        Wake::Sleep | Wake::Spin => format!("wake {wake}"),
        Wake::Hybrid(Margin::Fixed(margin_ns)) => {
            format!("wake {wake} (margin {})", format_duration_ns(margin_ns))
        }
        Wake::Hybrid(Margin::Adaptive { cpu_budget }) => {
            format!("wake {wake} (cpu_budget {cpu_budget})")
        }
    });
    words.extend(followed(task).map(|(service, within_ns)| {
        let [within, watched, period] =
            [within_ns, schedule.longest_watch_in_a_period_ns(), schedule.period_ns]
                .map(format_duration_ns);
        format!("follows {service} within {within} (watches for up to {watched} of each {period})")
    }));
    words.push(format!("overrun {}", schedule.overrun.as_str()));
    let limit = schedule.limit;
    words.extend(limit.map(|limit| {
        let (misses, cycles) =
            (counted(limit.misses, "missed release"), counted(limit.cycles, "cycle"));
        format!("stop at {misses} in {cycles}")
    }));
    words.join(", ")
}

/// The service that a task follows, and how long after a release in ns.
fn followed(task: &TaskPlan) -> Option<(&str, u64)> {
    task.followed_service.as_deref().zip(task.schedule.follow_within_ns)
}

fn origin(input: &InputPlan) -> String {
    match &input.service {
        Some(service) => format!("{service}[{}]", input.binding),
        None => "no service (only for simulate)".into(),
    }
}

fn fallback(input: &InputPlan) -> String {
    let default = numbers::shown(input.default, input.value_type, numbers::Digits::All);
    let mut text = format!("default {default}");
    if let Some(age_ns) = input.max_age_ns {
        text += &format!(", stale after {}", format_duration_ns(age_ns));
    }
    if input.bad == Bad::Stale {
        text += ", stale if bad";
    }
    if input.max_age_ns.is_some() || input.bad == Bad::Stale {
        text += &format!(": {}", input.on_stale);
    }
    if input.feedback {
        text += ", feedback";
    }
    text
}

fn signals(output: &OutputPlan) -> String {
    let names = output.signals.iter().take(ROWS).map(|s| format!("{} {}", s.name, s.value_type));
    let mut text = names.collect::<Vec<_>>().join(", ");
    if output.signals.len() > ROWS {
        text += &format!(", … and {} more", output.signals.len() - ROWS);
    }
    text
}

/// A wire by names.
struct NamedWire {
    from: String,
    /// The task that computes the value, if it is another one: its last finished cycle counts.
    from_task: Option<String>,
    to: String,
}

/// The wires of a task in the order in which they are copied.
fn named_wires(plan: &Plan, task: usize) -> impl Iterator<Item = NamedWire> {
    let tasks = plan.tasks.get(task);
    let previous = tasks.into_iter().flat_map(|task| &task.previous).map(|wire| (wire, "@prev"));
    let banks = tasks.into_iter().flat_map(|task| &task.banks);
    let direct = banks.flat_map(|bank| &bank.wires).map(|wire| (wire, ""));
    previous.chain(direct).map(move |(WirePlan { from, to }, suffix)| {
        let name = |slot: u32| plan.slot_name(task, slot as usize);
        let link = plan.links.iter().find(|link| link.to == task && link.carries_to(*from));
        let from_task = link.and_then(|link| plan.tasks.get(link.from));
        NamedWire {
            from: name(*from) + suffix,
            from_task: from_task.map(|task| task.name.clone()),
            to: name(*to),
        }
    })
}

fn binding_key(binding: &Binding) -> &'static str {
    match binding {
        Binding::Channel(_) => "channel",
        Binding::Signal(_) => "signal",
    }
}

fn document(plan: &Plan, places: &Places) -> Value {
    let tasks = plan.tasks.iter().enumerate().map(|(index, task)| {
        let schedule = &task.schedule;
        json!({
            "name": task.name,
            "period_ns": schedule.period_ns,
            "phase_ns": schedule.phase_ns,
            "phase_reason": task.phase_choice.reason(),
            "ob": task.ob,
            "priority": task.priority,
            "cpu": places.cpu(index),
            "cpu_reason": places.reason(index),
            "wake": schedule.wake.as_str(),
            "margin_ns": schedule.wake.margin().and_then(Margin::fixed_ns),
            "cpu_budget": schedule.wake.margin().and_then(Margin::cpu_budget),
            "follow": followed(task).map(|(service, within_ns)| json!({
                "service": service,
                "within_ns": within_ns,
            })),
            "overrun": schedule.overrun.as_str(),
            "on_overrun": schedule.limit.map(|limit| json!({
                "misses": limit.misses,
                "cycles": limit.cycles,
            })),
            "inputs": task.inputs.iter().map(|input| json!({
                "name": input.name,
                "type": input.value_type.as_str(),
                "service": input.service,
                (binding_key(&input.binding)): match &input.binding {
                    Binding::Channel(channel) => json!(channel),
                    Binding::Signal(signal) => json!(signal),
                },
                "default": numbers::json(input.default, input.value_type),
                "max_age_ns": input.max_age_ns,
                "on_stale": match input.on_stale {
                    OnStale::Ramp(rate) => json!({"ramp": rate}),
                    word => json!(word.as_str()),
                },
                "bad": input.bad.as_str(),
                "feedback": input.feedback,
            })).collect::<Vec<_>>(),
            "order": task.banks.iter().flat_map(|bank| bank.instances.iter().map(|name| json!({
                "block": name,
                "type": bank.block_type.name,
                "depth": bank.depth,
            }))).collect::<Vec<_>>(),
            "wires": named_wires(plan, index).map(|wire| json!({
                "from": wire.from,
                "from_task": wire.from_task.as_ref().unwrap_or(&task.name),
                "to": wire.to,
            })).collect::<Vec<_>>(),
            "outputs": task.outputs.iter().map(|output| json!({
                "service": output.service,
                "signals": output.signals.iter().map(|signal| json!({
                    "name": signal.name,
                    "type": signal.value_type.as_str(),
                })).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        })
    });
    json!({
        "file": plan.source.name,
        "node": plan.node,
        "tasks": tasks.collect::<Vec<_>>(),
        "errors": [],
        "warnings": configuration::findings_json(&configuration::warnings(plan), configuration::Kind::Warnings),
        "notes": plan.notes.iter().map(|note| configuration::finding_json(&plan.source, note)).collect::<Vec<_>>(),
    })
}

/// The document of a file that has errors.
fn refusal(findings: &Findings) -> Value {
    json!({
        "file": findings.source.name,
        "errors": configuration::findings_json(findings, configuration::Kind::Errors),
        "warnings": configuration::findings_json(findings, configuration::Kind::Warnings),
    })
}
