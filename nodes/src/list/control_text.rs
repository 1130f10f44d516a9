//! The control nodes as text: their tasks, and which are in each other's way.

use isochrone_control::{Followed, Placement, TaskDescription};
use isochrone_engine::escaped;
use isochrone_report::Table;
use isochrone_runtime::Conflict;
use isochrone_timing::Warning;
use isochrone_timing::units::{counted, period};

use super::control::State;
use super::document::ControlRow;
use super::look::Rate;
use crate::base::twins::twins;

/// The nodes, each with its tasks.
pub(super) fn text(nodes: &[ControlRow<'_>]) -> String {
    if nodes.is_empty() {
        return String::new();
    }
    let mut text = counted(nodes.len(), "control node") + "\n";
    for ControlRow { name, pid, state, control, tasks, redundancy, .. } in nodes {
        let said = match (control, state) {
            (Some(control), _) => format!("control {control:?}").to_lowercase(),
            (None, State::Off) => "control off".into(),
            (None, State::Stopped) => format!("does not answer: stopped (kill -CONT {pid})"),
            (None, State::Silent) => "does not answer".into(),
            (None, _) => "control unknown".into(),
        };
        text += &format!("  {}  pid {pid}  {said}\n", escaped(name));
        let twins = redundancy.map(twins).unwrap_or_default();
        twins.iter().for_each(|line| text += &format!("    {line}\n"));
        text += &tasks_text(tasks.unwrap_or_default());
    }
    text + "\n"
}

/// The tasks of a node.
fn tasks_text(tasks: &[TaskDescription]) -> String {
    let mut table = Table::default();
    for task in tasks {
        table.row([
            &*escaped(&task.name),
            &Rate::Announced { period_ns: task.period_ns }.text(),
            &scheduled(task),
            &placed(task),
            &format!("cycle {}", task.last_cycle.unwrap_or(task.cycle)),
            &format!("{} missed", task.missed),
            &remarks(task),
        ]);
    }
    let mut text = table.draw(4);
    for task in tasks {
        let Some(placement) = &task.placement else { continue };
        if let Some(Followed { service, within_ns }) = &placement.follow {
            let (name, service) = (escaped(&task.name), escaped(service));
            text += &format!("    {name} follows {service} within {}\n", period(*within_ns));
        }
        let reasons = [("CPU", &placement.cpu_reason), ("phase", &placement.phase_reason)];
        for (what, reason) in reasons {
            if let Some(reason) = reason {
                let (name, reason) = (escaped(&task.name), escaped(reason));
                text += &format!("    {what} of {name}: {reason}\n");
            }
        }
    }
    text
}

/// That a task does not run, and for how long; how many of its signals are forced, and its alarms.
fn remarks(task: &TaskDescription) -> String {
    let stands = task.stands_ns.map(|ns| format!("stands for {:.1} s", ns as f64 / 1e9));
    let forced = (task.forces > 0).then(|| format!("{} forced", task.forces));
    let alarms = (task.alarms > 0).then(|| counted(task.alarms, "alarm"));
    [stands, forced, alarms].into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// How a task is scheduled, and how it waits: `fifo:80 hybrid`.
fn scheduled(task: &TaskDescription) -> String {
    let words = |placement: &Placement| format!("{} {}", placement.scheduler, placement.wake);
    task.placement.as_ref().map_or_else(String::new, words)
}

/// Where a task is: its phase and CPU, as far as the node tells.
fn placed(task: &TaskDescription) -> String {
    let cpu = task.placement.as_ref().map(|placement| match placement.cpu {
        Some(cpu) => format!("CPU {cpu}"),
        None => "any CPU".to_owned(),
    });
    let phase = (task.phase_ns > 0).then(|| format!("phase {}", period(task.phase_ns)));
    cpu.into_iter().chain(phase).collect::<Vec<_>>().join(", ")
}

/// The tasks that share a CPU and need it at the same time, and those that keep their sources from sending.
pub(super) fn conflicts_text(conflicts: &[Conflict]) -> String {
    let (starved, meetings): (Vec<_>, Vec<_>) =
        conflicts.iter().partition(|conflict| conflict.is_starved_source());
    let mut text = String::new();
    for (conflicts, what) in [(meetings, "meeting"), (starved, "starved source")] {
        if conflicts.is_empty() {
            continue;
        }
        text += &format!("{} on one CPU\n", counted(conflicts.len(), what));
        for Warning { message, remedy, .. } in conflicts.into_iter().map(Warning::from) {
            text += &format!("  {message}\n  remedy: {remedy}\n");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use isochrone_control::Placement;
    use isochrone_runtime::CpuUser;
    use serde_json::json;

    use super::*;

    pub(in super::super) fn task(node: &str, first_release_ns: u64) -> CpuUser {
        let placement = Placement {
            cpu: Some(1),
            scheduler: "fifo:80".into(),
            wake: "sleep".into(),
            first_release_ns,
            longest_watch_ns: 0,
            response_ns: Some(10_000),
            phase_reason: None,
            cpu_reason: None,
            follow: None,
            sends: vec![format!("{node}/out")],
        };
        CpuUser { node: node.into(), task: "fast".into(), period_ns: 1_000_000, placement }
    }

    #[test]
    fn a_row_says_how_a_task_is_scheduled_and_a_line_what_it_follows_in_80_columns() {
        let mut placement = task("a", 0).placement;
        (placement.scheduler, placement.wake) = ("fifo:70".into(), "hybrid".into());
        placement.follow = Some(Followed { service: "plant/level".into(), within_ns: 400_000 });
        let mut task: TaskDescription = serde_json::from_value(json!({
            "name": "fast", "period_ns": 1_000_000, "phase_ns": 355_000, "cycle": 2_969_000,
            "missed": 0, "overruns": 0, "parameters": 1, "forces": 0,
        }))
        .unwrap();
        task.placement = Some(placement);
        let shown = |task: &TaskDescription| tasks_text(std::slice::from_ref(task));
        let text = shown(&task);
        assert!(
            text.contains("1000 Hz  fifo:70 hybrid  CPU 1, phase 355 us  cycle 2969000"),
            "{text}"
        );
        assert!(text.contains("    fast follows plant/level within 400 us\n"), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        task.alarms = 2;
        assert!(shown(&task).contains("  0 missed  2 alarms\n"), "{}", shown(&task));
        task.placement.as_mut().unwrap().cpu = None;
        assert!(shown(&task).contains("  any CPU, phase 355 us  "), "{}", shown(&task));
    }

    #[test]
    fn each_of_several_meetings_has_a_remedy_that_names_its_task() {
        let text = conflicts_text(&Conflict::among(&["a", "b", "c"].map(|node| task(node, 0))));
        let lines: Vec<&str> = text.trim_end().lines().collect();
        assert_eq!((lines.len(), lines[0]), (7, "3 meetings on one CPU"), "{text}");
        for (pair, (one, other)) in lines[1..].chunks(2).zip([("a", "b"), ("a", "c"), ("b", "c")]) {
            let met = format!("  {one}.fast and {other}.fast share CPU 1 and meet at each release");
            assert!(pair[0].starts_with(&met), "{text}");
            let remedy = format!("  remedy: give {one}.fast phase = \"auto\", which keeps clear");
            assert!(pair[1].starts_with(&remedy), "{text}");
        }
    }

    #[test]
    fn a_task_that_keeps_its_source_from_sending_is_marked() {
        let (source, mut follower) = (task("a", 200_000), task("b", 0));
        assert_eq!(Conflict::among(&[source.clone(), follower.clone()]), []);
        follower.placement.follow = Some(Followed { service: "a/out".into(), within_ns: 300_000 });
        let conflicts = Conflict::among(&[source, follower]);
        assert_eq!(
            conflicts_text(&conflicts),
            "1 starved source on one CPU\n  b.fast (fifo:80) follows \"a/out\" of a.fast (fifo:80) on the \
             same CPU 1: while the one watches, the other cannot send\n  remedy: give b.fast a lower \
             priority than a.fast has, or another cpu\n\n"
        );
    }
}
