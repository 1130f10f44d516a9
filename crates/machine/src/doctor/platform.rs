//! Checks of the platform: hypervisor, container, clock.

use super::verdict::Verdict;
use crate::machine::{Container, Machine, Platform};

/// Above this share of its time a CPU is not its guest's alone.
const MUCH_STEAL: f64 = 0.001;

pub(super) fn container(machine: &Machine, _cpu: usize) -> Verdict {
    let source = "/.dockerenv, /run/.containerenv, /run/systemd/container, /proc/1/{cgroup,comm}, \
        /proc/self/cgroup, /proc/mounts";
    let effect = "A container adds no jitter by itself, but its rights, its CPUs and the size of its \
        /dev/shm are those that it was started with.";
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
        Platform::Metal => Verdict::ok("none").effect("Nothing below the kernel takes the CPU away, except firmware."),
        Platform::Guest(name) => Verdict::note(name).effect(
            "The host may take the CPU away at any time, and nothing in this guest prevents it. Trust \
             ratios between arms of one run, not absolute worst cases.",
        ),
        Platform::Unknown => Verdict::unknown("/proc/cpuinfo does not say")
            .effect("The host of a guest may take the CPU away at any time."),
    }
    .from("/proc/cpuinfo, /sys/hypervisor/type")
}

pub(super) fn steal(machine: &Machine, cpu: usize) -> Verdict {
    let source = "/proc/stat";
    let effect = "The task stops while the host runs something else on the CPU.";
    let Some(steal) = machine.steal(cpu) else {
        return Verdict::unknown("steal time cannot be read").effect(effect).from(source);
    };
    let value = format!("{:.3} % of CPU {cpu}'s time since boot", steal * 100.0);
    match () {
        () if steal == 0.0 => Verdict::ok(format!("none on CPU {cpu} since boot"))
            .effect("The host has reported no time taken from this CPU."),
        () if steal > MUCH_STEAL => Verdict::warning(value)
            .effect(effect)
            .fix("on the host: give each virtual CPU a core of its own, or move the guest"),
        () => Verdict::note(value).effect(effect),
    }
    .from(source)
}

pub(super) fn clock_source(machine: &Machine, _cpu: usize) -> Verdict {
    let source = "/sys/devices/system/clocksource/clocksource0/current_clocksource";
    let slow = "Each clock reading is a system call, and every measured time includes one.";
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
                    Verdict::ok(value).effect("Reading the clock needs no system call.")
                }
                "kvm-clock" | "hyperv_clocksource_tsc_page" => Verdict::note(value)
                    .effect("Reading the clock needs no system call but takes longer than with the plain tsc."),
                _ => Verdict::warning(value).effect(slow).fix(if available.split(' ').any(|name| name == "tsc") { format!("echo tsc > {source}") } else { "tsc=reliable on the kernel command line, if dmesg shows that the kernel rejected a sound tsc".to_owned() }),
            }
        }
    };
    verdict.from(source)
}
