//! Checks of `follow`.

use super::TaskPlan;
use super::names::Names;
use crate::Diagnostic;
use crate::config::Config;
use crate::diagnostic::Problem;
use crate::nearest::KnownNames;

/// Reports tasks that follow a service of which they read nothing.
pub(super) fn check(config: &Config, names: &Names<'_>, diagnostics: &mut Vec<Diagnostic>) {
    for (index, task) in config.tasks.iter().enumerate() {
        let followed = task.settings.followed_service();
        let Some(followed) = followed else { continue };
        let mut read = Vec::new();
        for input in &config.inputs {
            let (Some(name), Some(service)) = (&input.name, &input.service) else { continue };
            let of_task = names.inputs.get(name.get_ref().as_str()).and_then(|input| input.task);
            // Of an input whose task is not known, an error says so, and it may be of this one.
            if of_task.is_none_or(|task| task == index) {
                read.push(service.get_ref().as_str());
            }
        }
        if read.contains(&followed) {
            continue;
        }
        let name = task.name.as_ref().map_or("", |name| name.get_ref());
        let message = format!(
            "task \"{name}\" follows \"{}\", which is the service of none of its inputs",
            followed
        );
        read.sort_unstable();
        read.dedup();
        let help = if read.is_empty() {
            "give it an [[input]] with this service, or leave follow out".into()
        } else {
            KnownNames::new(read).suggestion(followed)
        };
        let diagnostic =
            Diagnostic::new(Problem::UnknownSource, task.settings.follow_span.clone(), message);
        diagnostics.push(diagnostic.help(help));
    }
}

/// Warns of tasks that follow what they send themselves: the frame that a cycle waits for is its own.
pub(super) fn own_outputs(tasks: &[TaskPlan]) -> impl Iterator<Item = Diagnostic> {
    tasks.iter().filter_map(|task| {
        let followed = task.settings.followed_service()?;
        task.outputs.iter().find(|output| output.service == followed)?;
        let message = format!(
            "task \"{}\" follows \"{followed}\", which it sends itself: every second cycle waits for a frame \
             that cannot come, until its time is up",
            task.name
        );
        let help = "follow the service of another task, or leave follow out: a task reads its own output of \
                    the cycle before anyway";
        let span = task.settings.follow_span.clone();
        Some(Diagnostic::new(Problem::FollowsItself, span, message).help(help))
    })
}

/// Whether a thread that watches for frames at a real-time priority keeps the thread that sends them from running
/// while both are on one CPU: it does unless the sender's priority is higher. `None` is normal scheduling; a watcher
/// without a priority takes turns with the sender.
pub fn starves(watcher: Option<u8>, sender: Option<u8>) -> bool {
    watcher.is_some() && sender <= watcher
}

/// As [`Plan::starved_sources`](super::Plan::starved_sources).
pub(super) fn starved_sources(tasks: &[TaskPlan]) -> Vec<Diagnostic> {
    tasks.iter().filter_map(|task| starved_source(task, tasks)).collect()
}

fn starved_source(task: &TaskPlan, tasks: &[TaskPlan]) -> Option<Diagnostic> {
    let followed = task.settings.followed_service()?;
    let (priority, cpu) = (task.settings.priority?, task.settings.cpu.number()?);
    let sends = |other: &&TaskPlan| other.outputs.iter().any(|output| output.service == followed);
    let source = tasks.iter().find(sends)?;
    if source.name == task.name
        || source.settings.cpu.number() != Some(cpu)
        || !starves(Some(priority), source.settings.priority)
    {
        return None;
    }
    let priority_of_source = match source.settings.priority {
        Some(priority) => format!("has priority {priority}"),
        None => "has no priority".into(),
    };
    let runs = if task.settings.cpu.is_auto() || source.settings.cpu.is_auto() {
        format!("would run on the same CPU {cpu}, as cpu = \"auto\" chooses now")
    } else {
        format!("runs on the same CPU {cpu}")
    };
    let message = format!(
        "task \"{}\" (priority {priority}) follows \"{followed}\" of task \"{}\", which {priority_of_source} \
         and {runs}: while the one watches, the other cannot send",
        task.name, source.name,
    );
    let help = format!(
        "give task \"{}\" a higher priority than task \"{}\", or another CPU",
        source.name, task.name
    );
    let span = task.settings.follow_span.clone();
    Some(Diagnostic::new(Problem::StarvedSource, span, message).help(help))
}
