//! What the kernel runs on and in: hypervisor, container, clock.

use super::verdict::Verdict;
use crate::machine::{Container, Machine, Platform};

/// Above this share of its time a CPU is not its guest's alone.
const MUCH_STEAL: f64 = 0.001;

pub(super) fn container(machine: &Machine, _cpu: usize) -> Verdict {
    let source = "/.dockerenv, /run/.containerenv, /run/systemd/container, /proc/1/{cgroup,comm}, \
        /proc/self/cgroup, /proc/mounts";
    let effect = "A container adds no jitter by itself; rights, CPUs and the size of /dev/shm are those \
        it was started with.";
    match machine.container() {
        Container::No => {
            Verdict::ok("no sign of one").effect("Rights and CPUs are those of the machine.")
        }
        Container::Maybe(mark) => Verdict::note(format!("maybe ({mark} alone)")).effect(effect),
        Container::Yes(mark) => Verdict::note(format!("yes ({mark})")).effect(effect),
    }
    .from(source)
}

pub(super) fn hypervisor(machine: &Machine, _cpu: usize) -> Verdict {
    match machine.platform() {
        Platform::Metal => Verdict::ok("none").effect("Nothing underneath the kernel takes the CPU away, firmware aside."),
        Platform::Guest(name) => Verdict::note(name).effect(
            "The host may take the CPU away at any time, and nothing in this guest prevents it: trust ratios \
             between runs, not absolute worst cases.",
        ),
        Platform::Unknown => Verdict::unknown("/proc/cpuinfo does not tell")
            .effect("The host of a guest may take the CPU away at any time."),
    }
    .from("/proc/cpuinfo, /sys/hypervisor/type")
}

pub(super) fn steal(machine: &Machine, cpu: usize) -> Verdict {
    let source = "/proc/stat";
    let effect = "While the host runs something else on the CPU, the task stands still.";
    let Some(steal) = machine.steal(cpu) else {
        return Verdict::unknown("steal time cannot be read").effect(effect).from(source);
    };
    let value = format!("{:.3} % of CPU {cpu}'s time since the start", steal * 100.0);
    match () {
        () if steal == 0.0 => Verdict::ok(format!("none on CPU {cpu} since the start"))
            .effect("No time of the CPU was counted as taken by a host."),
        () if steal > MUCH_STEAL => Verdict::warning(value)
            .effect(effect)
            .fix("on the host: give each virtual CPU a core of its own, or move the guest"),
        () => Verdict::note(value).effect(effect),
    }
    .from(source)
}

pub(super) fn clock_source(machine: &Machine, _cpu: usize) -> Verdict {
    let source = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    let slow =
        "Every reading of the clock is a system call, and is contained in every measured time.";
    let available = machine.clock_sources();
    let verdict = match machine.clock_source() {
        None => Verdict::unknown("the clock source cannot be read").effect(slow),
        Some(clock) => {
            let value = match available.as_str() {
                "" => clock.clone(),
                available if available == clock => clock.clone(),
                available => format!("{clock} (of {})", available.replace(' ', ", ")),
            };
            match clock.as_str() {
                "tsc" | "arch_sys_counter" | "riscv_clocksource" => {
                    Verdict::ok(value).effect("Reading the clock takes no system call.")
                }
                "kvm-clock" | "hyperv_clocksource_tsc_page" => Verdict::note(value)
                    .effect("Reading the clock takes no system call, but longer than a plain tsc."),
                _ => Verdict::warning(value).effect(slow).fix(if available.split(' ').any(|name| name == "tsc") { format!("echo tsc > {source}") } else { "tsc=reliable on the kernel command line, if the kernel gave the tsc up without need (dmesg)".to_owned() }),
            }
        }
    };
    verdict.from(source)
}
