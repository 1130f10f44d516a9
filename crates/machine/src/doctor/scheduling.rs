//! The scheduler: what it lets run in place of the task, and when it stops the task.

use super::verdict::Verdict;
use crate::machine::Machine;
use crate::throttling::Throttling;

pub(super) fn preemption(machine: &Machine, _cpu: usize) -> Verdict {
    let unknown = "The worst case depends on how long the kernel may finish its own work before it lets \
        the task run.";
    let Some(found) = machine.preemption() else {
        return Verdict::unknown("the kernel does not say")
            .effect(unknown)
            .from("/proc/version, kernel config");
    };
    let switch = match (found.dynamic, at_run_time(machine, "sched/preempt", "full")) {
        (true, Some(command)) => format!("{command}  # or preempt=full on the kernel command line"),
        (true, None) => "preempt=full on the kernel command line".to_owned(),
        (false, _) => "boot a PREEMPT_RT kernel".to_owned(),
    };
    let how = match (found.dynamic, found.current) {
        (false, _) => "",
        (true, true) => " (dynamic)",
        (true, false) => " (dynamic; as started, a later change is visible only in debugfs)",
    };
    let value = format!("{}{how}", found.model);
    match found.model.as_str() {
        "rt" => Verdict::ok("PREEMPT_RT").effect("Almost all kernel code, including interrupt handlers, yields to the task at once."),
        "full" | "lazy" => Verdict::note(value)
            .effect("System calls of other programs yield to the task at once; interrupt handlers and code that \
                holds spin locks do so only with PREEMPT_RT.")
            .fix("boot a PREEMPT_RT kernel"),
        "voluntary" | "none" => Verdict::warning(value)
            .effect("The task waits until a system call of another program on its CPU ends or reaches a \
                point where it yields.")
            .fix(switch),
        _ => Verdict::note(format!("unknown: {value}")).effect(unknown).fix(switch),
    }
    .from(found.source)
}

pub(super) fn rt_throttling(machine: &Machine, _cpu: usize) -> Verdict {
    let effect =
        "A SCHED_FIFO thread that uses up its share of a period is stopped for the rest of it.";
    let Some(throttling) = machine.throttling() else {
        return Verdict::unknown("the limit cannot be read")
            .effect(effect)
            .from(Throttling::SOURCE);
    };
    let period_ms = throttling.period().as_millis();
    let verdict = match throttling.granted().map(|granted| granted.as_millis()) {
        None => Verdict::ok("off (-1)")
            .effect("SCHED_FIFO may use all of the CPU, so a task that never waits leaves no time for other threads."),
        Some(granted_ms) if machine.throttles_fifo() == Some(false) => {
            Verdict::ok(format!("{granted_ms} of {period_ms} ms"))
                .effect("It limits only SCHED_DEADLINE here.")
                .inert("since 6.12 a kernel without RT_GROUP_SCHED does not throttle SCHED_FIFO: see fair_server")
        }
        Some(granted_ms) => Verdict::note(format!("{granted_ms} of {period_ms} ms"))
            .effect(format!("A SCHED_FIFO thread that never sleeps (wake = \"spin\") is stopped for \
                {} ms of every {period_ms} ms. sleep and hybrid stay below the limit; `isochrone run` \
                refuses margins that do not.", period_ms - granted_ms))
            .fix("sysctl -w kernel.sched_rt_runtime_us=-1  # only for wake = \"spin\""),
    };
    verdict.from(Throttling::SOURCE)
}

pub(super) fn fair_server(machine: &Machine, cpu: usize) -> Verdict {
    let folder = format!("/sys/kernel/debug/sched/fair_server/cpu{cpu}");
    let effect = "If the task leaves ordinary threads on this CPU no time (wake = \"spin\"), they run \
        before it for that long.";
    let none = "Ordinary threads never run before the task.";
    let fix = at_run_time(machine, &format!("sched/fair_server/cpu{cpu}/runtime"), "0")
        .map(|command| format!("{command}  # only for wake = \"spin\""));
    let read = |name: &str| machine.number(&format!("{folder}/{name}"));
    match (read("runtime"), read("period"), machine.is_at_least(6, 12)) {
        (Some(0), _, _) => Verdict::ok("off").effect(none).from(folder),
        (Some(runtime_ns), Some(period_ns), _) => {
            Verdict::note(format!("{} of {} ms", runtime_ns / 1_000_000, period_ns / 1_000_000))
                .effect(effect)
                .maybe_fix(fix)
                .from(folder)
        }
        (_, _, Some(false)) => {
            Verdict::ok("none (kernel before 6.12)").effect(none).from("/proc/sys/kernel/osrelease")
        }
        (_, _, Some(true)) => Verdict::note(
            "50 of 1000 ms by default (Linux 6.12 or newer; the setting is in debugfs only)",
        )
        .effect(effect)
        .maybe_fix(fix)
        .from("/proc/sys/kernel/osrelease"),
        (_, _, None) => {
            Verdict::unknown("the kernel does not report its release").effect(effect).from(folder)
        }
    }
}

pub(super) fn real_time_threads(machine: &Machine, cpu: usize) -> Verdict {
    let effect = "Threads of higher or equal priority may run before the task.";
    let source = "/proc/*/task/*/stat";
    let Some(threads) = machine.real_time_threads_on(cpu) else {
        return Verdict::unknown("the threads of this machine cannot be read")
            .effect(effect)
            .from(source);
    };
    let programs = threads.iter().filter(|thread| !thread.is_kernel).count();
    let value = match (threads.len() - programs, programs) {
        (0, 0) => format!("none on CPU {cpu}"),
        (kernel, 0) => format!("{kernel} on CPU {cpu}, of the kernel"),
        (kernel, programs) => {
            format!("{} on CPU {cpu}, {programs} of them of programs", kernel + programs)
        }
    };
    let verdict = match programs {
        0 => Verdict::ok(value),
        _ => Verdict::note(value)
            .fix("move them with `taskset -pc CPUS THREAD`, or give the task a higher `priority`"),
    };
    let details = threads.iter().map(|thread| {
        let owner = if thread.is_kernel { ", kernel" } else { "" };
        format!("{} {}, {}{owner}", thread.id, thread.name, thread.scheduler)
    });
    verdict.details(details).effect(effect).from(source)
}

pub(super) fn timer_tick(machine: &Machine, cpu: usize) -> Verdict {
    let effect = "The timer tick interrupts a busy CPU; a release that coincides with it is late by the time its handler takes.";
    let Some(config) = machine.config() else {
        return Verdict::unknown("the kernel configuration cannot be read")
            .effect(effect)
            .from("/proc/config.gz, /boot/config-*");
    };
    let coarse =
        !config.is_set("HIGH_RES_TIMERS") || machine.parameter("highres").as_deref() == Some("off");
    let source = config.source.clone();
    let Some(rate_hz) = config.value("HZ").and_then(|rate| rate.parse::<u32>().ok()) else {
        return Verdict::unknown("the kernel configuration has no HZ").effect(effect).from(source);
    };
    if coarse {
        return Verdict::warning(format!("{rate_hz} Hz, without high-resolution timers"))
            .effect("Sleeps end only at a tick, so every release waits for the next one.")
            .fix("boot without highres=off, a kernel with HIGH_RES_TIMERS")
            .from(source);
    }
    let is_tickless = machine.tickless().is_some_and(|tickless| tickless.contains(cpu));
    if is_tickless {
        Verdict::ok(format!(
            "{rate_hz} Hz, stopped on CPU {cpu} while one thread runs there (nohz_full)"
        ))
        .effect("The timer tick does not interrupt the task while it is alone on the CPU.")
    } else {
        Verdict::note(format!("{rate_hz} Hz, every {} ms", 1000.0 / f64::from(rate_hz.max(1))))
            .effect(effect)
    }
    .from(source)
}

/// The command that sets a switch in debugfs; `None` where the kernel refuses it (lockdown).
fn at_run_time(machine: &Machine, switch: &str, value: &str) -> Option<String> {
    let root = "/sys/kernel/debug";
    let file = format!("{root}/{switch}");
    // Others than root do not even see that there is a file.
    if machine.has(&file) && machine.text(&file).is_none() {
        return None;
    }
    let is_mounted = machine.text("/proc/mounts").is_none_or(|mounts| mounts.contains(root));
    let mount = if is_mounted { "" } else { "mount -t debugfs none /sys/kernel/debug; " };
    Some(format!("{mount}echo {value} > {file}"))
}
