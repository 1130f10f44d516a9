//! Checks of the task's CPU: other work, the tick, interrupts, the neighbouring hyper-thread.

use super::verdict::Verdict;
use crate::machine::{CpuList, Interrupt, Machine, Mobility};
use crate::quiet::Observation;

const COMMAND_LINE: &str = "/proc/cmdline";
/// The detector looks five times in twice the threshold.
const WATCHDOG_SHARE: f64 = 0.4;

pub(super) fn isolated_cpus(machine: &Machine, cpu: usize) -> Verdict {
    let source = "/sys/devices/system/cpu/isolated";
    let effect = "The kernel may run other threads on the task's CPU; their system calls, interrupts and \
        use of caches delay the task.";
    // The second are those of a cpuset partition.
    let lists = [machine.list(source), machine.list("/sys/fs/cgroup/cpuset.cpus.isolated")];
    if lists.iter().flatten().any(|list| list.contains(cpu)) {
        return Verdict::ok(format!("CPU {cpu} is isolated"))
            .effect("The kernel places no other threads on the task's CPU.")
            .from(source);
    }
    match (&lists, only_cpu(machine)) {
        ([None, None], _) => Verdict::unknown("the list of CPUs cannot be read"),
        (_, true) => Verdict::note("none: this machine has one CPU"),
        ([Some(list), _] | [_, Some(list)], _) => {
            let value =
                if list.is_empty() { "none".to_owned() } else { format!("{list}, not CPU {cpu}") };
            Verdict::warning(value)
                .fix(format!("isolcpus=managed_irq,domain,{cpu} on the kernel command line"))
        }
    }
    .effect(effect)
    .from(source)
}

pub(super) fn nohz_full(machine: &Machine, cpu: usize) -> Verdict {
    let source = "/sys/devices/system/cpu/nohz_full, /proc/cmdline";
    let effect = "The timer tick continues while the task runs; see timer_tick.";
    let list = machine.tickless().filter(|list| !list.is_empty());
    if let Some(list) = &list
        && list.contains(cpu)
    {
        let effect = "The tick stops while the task is alone on its CPU.";
        return Verdict::ok(list.to_string()).effect(effect).from(source);
    }
    if let Some(config) = machine.config()
        && !config.is_set("NO_HZ_FULL")
    {
        return Verdict::note("not built into this kernel")
            .effect(effect)
            .inert("nohz_full= needs a kernel with NO_HZ_FULL")
            .from(&config.source);
    }
    let fix = format!("nohz_full={cpu} on the kernel command line");
    match list {
        _ if !machine.has(COMMAND_LINE) => Verdict::unknown("the list of CPUs cannot be read"),
        _ if only_cpu(machine) => Verdict::note("none: this machine has one CPU"),
        None => Verdict::note("none").fix(fix),
        Some(list) => Verdict::note(format!("{list}, not CPU {cpu}")).fix(fix),
    }
    .effect(effect)
    .from(source)
}

pub(super) fn rcu_nocbs(machine: &Machine, cpu: usize) -> Verdict {
    let effect =
        "RCU callbacks, which free kernel memory, run on the task's CPU in interrupt context.";
    let elsewhere =
        "RCU callbacks, which free kernel memory, run in threads that can run on other CPUs.";
    let config = machine.config();
    let is_set = |name: &str| config.map(|config| config.is_set(name));
    if machine.tickless().is_some_and(|list| list.contains(cpu)) {
        return Verdict::ok("by nohz_full").effect(elsewhere).from(COMMAND_LINE);
    }
    let fix = format!("rcu_nocbs={cpu} on the kernel command line");
    let verdict = match (machine.parameter("rcu_nocbs"), is_set("RCU_NOCB_CPU")) {
        _ if !machine.has(COMMAND_LINE) => {
            Verdict::unknown("the kernel command line cannot be read").effect(effect)
        }
        (_, Some(false)) => Verdict::note("not built into this kernel")
            .effect(effect)
            .inert("rcu_nocbs= needs a kernel with RCU_NOCB_CPU"),
        (None, _) if is_set("RCU_NOCB_CPU_DEFAULT_ALL") == Some(true) => {
            Verdict::ok("all (built in)").effect(elsewhere)
        }
        (None, _) => Verdict::note("none").effect(effect).fix(fix),
        (Some(list), _) => match CpuList::parse(&list).map(|cpus| cpus.contains(cpu)) {
            Some(true) => Verdict::ok(list).effect(elsewhere),
            Some(false) => Verdict::note(format!("{list}, not CPU {cpu}")).effect(effect).fix(fix),
            None => {
                Verdict::unknown(&format!("`rcu_nocbs={list}` is not a plain list")).effect(effect)
            }
        },
    };
    verdict.from(COMMAND_LINE)
}

pub(super) fn quiet_cpu(machine: &Machine, cpu: usize) -> Verdict {
    let source = "/proc/interrupts, /proc/*/task/*/status, /sys/devices/system/cpu";
    let Some(choice) = machine.observation().and_then(Observation::choose) else {
        return Verdict::unknown("the CPUs that this process may use cannot be read")
            .effect("The quietest CPU cannot be chosen.")
            .from(source);
    };
    let verdict = if choice.cpu == cpu {
        Verdict::ok(format!("CPU {cpu}: {choice}"))
            .effect("A task with cpu = \"auto\" would run here.")
    } else {
        Verdict::note(format!("CPU {}: {choice}", choice.cpu))
            .effect(format!(
                "A task with cpu = \"auto\" would run on CPU {}, where less disturbs it.",
                choice.cpu
            ))
            .fix(format!("cpu = \"auto\" or cpu = {} in [[task]]", choice.cpu))
    };
    verdict.from(source)
}

pub(super) fn interrupts(machine: &Machine, cpu: usize) -> Verdict {
    let effect = "Each of these interrupts the task while its handler runs, at times that the device chooses.";
    let source = "/proc/interrupts, /proc/irq/*/effective_affinity_list";
    let Some(interrupts) = machine.interrupts_on(cpu) else {
        return Verdict::unknown("interrupts cannot be read").effect(effect).from(source);
    };
    let (fixed, movable): (Vec<_>, Vec<_>) = interrupts
        .iter()
        .filter(|interrupt| interrupt.fired > 0)
        .partition(|interrupt| interrupt.mobility.is_fixed());
    let details = interrupts.iter().map(|interrupt| {
        format!(
            "{} {}, CPU {}, {} so far{}",
            interrupt.number,
            interrupt.name,
            interrupt.affinity,
            interrupt.fired,
            match interrupt.mobility {
                Mobility::Managed => ", managed by the kernel",
                Mobility::ProbablyManaged => ", managed by the kernel, to judge by its driver",
                Mobility::Movable | Mobility::Unknown => "",
            }
        )
    });
    let verdict = match (interrupts.len(), fixed.len() + movable.len()) {
        (0, _) => Verdict::ok(format!("no device interrupt can fire on CPU {cpu}")).effect(
            "No device interrupts the task; the kernel's own interrupts (timer, other CPUs) remain.",
        ),
        (all, 0) => Verdict::note(format!("{all} can fire on CPU {cpu}, none did since boot"))
            .effect(effect),
        (all, fired) => {
            let managed = match fixed.len() {
                0 => String::new(),
                fixed => format!(", {fixed} of them managed by the kernel, which does not move them"),
            };
            let fixes = [move_away(machine, cpu, &movable), avoid(machine, cpu, &fixed)];
            let fixes: Vec<String> = fixes.into_iter().flatten().collect();
            let value = format!("{all} can fire on CPU {cpu}, {fired} did since boot{managed}");
            Verdict::warning(value)
                .effect(effect)
                .maybe_fix((!fixes.is_empty()).then(|| fixes.join("; and ")))
        }
    };
    verdict.details(details).from(source)
}

/// What the kernel accepts for interrupts that it lets others place.
fn move_away(machine: &Machine, cpu: usize, movable: &[&Interrupt]) -> Option<String> {
    let others = housekeeping(machine, cpu).filter(|_| !movable.is_empty())?;
    let numbers: Vec<String> =
        movable.iter().map(|interrupt| interrupt.number.to_string()).collect();
    Some(format!(
        "for i in {}; do echo {others} > /proc/irq/$i/smp_affinity_list; done  # stop irqbalance first",
        numbers.join(" ")
    ))
}

/// What helps against those that it places itself.
fn avoid(machine: &Machine, cpu: usize, fixed: &[&Interrupt]) -> Option<String> {
    housekeeping(machine, cpu).filter(|_| !fixed.is_empty())?;
    let better = machine.observation()?.choose()?.cpu;
    Some(if better == cpu {
        format!("isolcpus=managed_irq,domain,{cpu} on the kernel command line")
    } else {
        format!("cpu = \"auto\" or cpu = {better} in [[task]]")
    })
}

pub(super) fn watchdog(machine: &Machine, cpu: usize) -> Verdict {
    let read = |name: &str| machine.number(&format!("/proc/sys/kernel/{name}"));
    let source = "/proc/sys/kernel/{watchdog,soft_watchdog,watchdog_cpumask}";
    let effect = "A kernel thread of the highest priority periodically checks that the CPU still schedules; the task waits while it runs.";
    let silent = "No lockup detector interrupts the task.";
    let here =
        machine.list("/proc/sys/kernel/watchdog_cpumask").is_none_or(|mask| mask.contains(cpu));
    let verdict = match (read("watchdog"), read("soft_watchdog")) {
        (Some(0), _) | (_, Some(0)) => Verdict::ok("off").effect(silent),
        (_, Some(_)) if !here => Verdict::ok(format!("not on CPU {cpu}")).effect(silent),
        (_, Some(_)) => {
            let every = match read("watchdog_thresh") {
                Some(threshold_s) => format!(", every {} s", threshold_s as f64 * WATCHDOG_SHARE),
                None => String::new(),
            };
            Verdict::note(format!("softlockup detector on CPU {cpu}{every}")).effect(effect).fix(
                match housekeeping(machine, cpu) {
                    Some(others) => format!("sysctl -w kernel.watchdog_cpumask={others}"),
                    None => "sysctl -w kernel.soft_watchdog=0".to_owned(),
                },
            )
        }
        _ if machine.release().is_some() => {
            Verdict::ok("not built into this kernel").effect(silent)
        }
        _ => Verdict::unknown("the setting cannot be read").effect(effect),
    };
    verdict.from(source)
}

pub(super) fn smt_sibling(machine: &Machine, cpu: usize) -> Verdict {
    let source = format!("/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list");
    let effect = "A thread on the sibling shares the core's execution units and caches, so the task's execution time varies with it.";
    let Some(siblings) = machine.list(&source).map(|list| list.without(cpu)) else {
        return Verdict::unknown("the siblings of the CPU cannot be read")
            .effect(effect)
            .from(source);
    };
    let isolated = machine.list("/sys/devices/system/cpu/isolated").unwrap_or_default();
    let verdict = match siblings.last() {
        None if machine.is_guest() => Verdict::ok("none visible in this guest")
            .effect("The guest cannot see whether the host shares the core."),
        None => Verdict::ok("none").effect("Nothing shares the task's core."),
        Some(sibling) => {
            let fix = format!(
                "echo 0 > /sys/devices/system/cpu/cpu{sibling}/online  # or nosmt on the kernel command line"
            );
            let value = format!("CPU {siblings} shares the core of CPU {cpu}");
            if isolated.contains(sibling) {
                Verdict::note(value + ", and is isolated")
            } else {
                Verdict::warning(value)
            }
            .effect(effect)
            .fix(fix)
        }
    };
    verdict.from(source)
}

/// The CPUs that can take over other work.
fn housekeeping(machine: &Machine, cpu: usize) -> Option<CpuList> {
    Some(machine.online()?.without(cpu)).filter(|others| !others.is_empty())
}

fn only_cpu(machine: &Machine) -> bool {
    machine.online().is_some_and(|online| online.len() == 1)
}
