//! The CPU time that the kernel's throttling of real-time threads leaves for waiting.
//!
//! A real-time thread that uses more than its share of a CPU (950 of 1000 ms, if nobody changed it)
//! is taken off it for the rest of the time. Watching the clock is use. A node that is sure to be
//! stopped by its own waits does not start.

use isochrone_engine::{Plan, TaskPlan};
use isochrone_machine::{Environment, Throttling};
use isochrone_runtime::{TaskCpu, TaskCpus};

use crate::failure::Failure;

/// Refuses real-time tasks that together may watch the clock on one CPU for as long as the kernel
/// lets them have it, or longer.
pub(crate) fn refuse(
    plan: &Plan,
    cpus: &TaskCpus,
    environment: &Environment,
) -> Result<(), Failure> {
    match why_refused(plan, cpus, environment) {
        Some(why) => Err(Failure::found(why)),
        None => Ok(()),
    }
}

/// Why [`refuse`] refuses, if it does.
pub(crate) fn why_refused(
    plan: &Plan,
    cpus: &TaskCpus,
    environment: &Environment,
) -> Option<String> {
    let throttling = environment.fifo_throttling()?;
    let placed = || plan.tasks.iter().zip(cpus.as_slice());
    let real_time = || placed().filter(|(task, _)| task.settings.priority.is_some());
    for (first, place) in real_time() {
        let meets = |(task, other): &(&TaskPlan, &TaskCpu)| {
            let is_on_its_cpu = place.cpu().is_some() && place.cpu() == other.cpu();
            std::ptr::eq(first, *task) || environment.cpus == 1 || is_on_its_cpu
        };
        let on_its_cpu: Vec<&TaskPlan> = real_time().filter(meets).map(|(task, _)| task).collect();
        let share: f64 = on_its_cpu.iter().map(|task| watched(task)).sum();
        if throttling.share().is_some_and(|limit| share >= limit) {
            return Some(refusal(&on_its_cpu, share, throttling));
        }
    }
    None
}

/// The part of a CPU for which a task may watch the clock.
fn watched(task: &TaskPlan) -> f64 {
    let schedule = task.settings.schedule();
    schedule.longest_watch_in_a_period_ns() as f64 / schedule.period_ns.max(1) as f64
}

fn refusal(tasks: &[&TaskPlan], share: f64, throttling: Throttling) -> String {
    let follows = |task: &TaskPlan| task.settings.follow.is_some();
    let described = |task: &TaskPlan| {
        let wake = task.settings.wake.as_str();
        let follow = if follows(task) { ", follow" } else { "" };
        format!("\"{}\" (wake = \"{wake}\"{follow})", task.name)
    };
    let watching: Vec<String> =
        tasks.iter().filter(|task| watched(task) > 0.0).map(|task| described(task)).collect();
    let one_follows = tasks.iter().any(|task| follows(task));
    let within = if one_follows { ", a shorter within of follow" } else { "" };
    let (noun, has, them, remedy) = match watching.len() {
        1 => ("task", "has", "the task", ""),
        _ => ("tasks", "have", "them", ", another CPU for one of them"),
    };
    format!(
        "{noun} {} {has} a priority and may watch the clock for {:.1} % of a CPU, but the kernel gives \
         real-time threads only {throttling} us of one and would stop {them} for the rest\n\
         remedy: wake = \"hybrid\" with a shorter margin or a smaller cpu_budget{within}{remedy}, or sysctl -w \
         kernel.sched_rt_runtime_us=-1",
        watching.join(", "),
        share * 100.0,
    )
}
