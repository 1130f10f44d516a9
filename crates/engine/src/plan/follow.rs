//! What a task can follow: a service that it reads.

use super::TaskPlan;
use super::names::Names;
use crate::Finding;
use crate::config::Config;
use crate::finding::Problem;
use crate::nearest::Known;

/// Reports tasks that follow a service of which they read nothing.
pub(super) fn check(config: &Config, names: &Names<'_>, findings: &mut Vec<Finding>) {
    for (index, task) in config.tasks.iter().enumerate() {
        let followed = task.follow.as_ref().and_then(|follow| follow.service.as_ref());
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
        if read.contains(&followed.get_ref().as_str()) {
            continue;
        }
        let name = task.name.as_ref().map_or("", |name| name.get_ref());
        let message = format!(
            "task \"{name}\" follows \"{}\", which is the service of none of its inputs",
            followed.get_ref()
        );
        read.sort_unstable();
        read.dedup();
        let help = if read.is_empty() {
            "give it an [[input]] with this service, or leave follow out".into()
        } else {
            Known::new(read).suggestion(followed.get_ref())
        };
        let finding = Finding::new(Problem::UnknownSource, followed.span(), message);
        findings.push(finding.help(help));
    }
}

/// Warns of tasks that watch for another task's frames on its CPU and at its priority or a higher one:
/// while they watch, it does not run.
pub(super) fn starved_sources(config: &Config, tasks: &[TaskPlan], findings: &mut Vec<Finding>) {
    for (task, written) in tasks.iter().zip(&config.tasks) {
        let followed = written.follow.as_ref().and_then(|follow| follow.service.as_ref());
        let (Some(followed), Some(priority), Some(cpu)) =
            (followed, task.priority, task.cpu.number())
        else {
            continue;
        };
        let sends = |other: &&TaskPlan| {
            other.outputs.iter().any(|output| output.service == *followed.get_ref())
        };
        let Some(source) = tasks.iter().find(sends) else { continue };
        let is_behind = source.priority.is_none_or(|source| source <= priority);
        if source.name == task.name || source.cpu.number() != Some(cpu) || !is_behind {
            continue;
        }
        let priority_of_source = match source.priority {
            Some(priority) => format!("has priority {priority}"),
            None => "has no priority".into(),
        };
        let message = format!(
            "task \"{}\" (priority {priority}) follows \"{}\" of task \"{}\", which {priority_of_source} and \
             runs on the same CPU {cpu}: while the one watches, the other cannot send",
            task.name,
            followed.get_ref(),
            source.name,
        );
        let help = format!(
            "give task \"{}\" a higher priority than task \"{}\", or another CPU",
            source.name, task.name
        );
        let finding = Finding::new(Problem::StarvedSource, followed.span(), message);
        findings.push(finding.help(help));
    }
}
