//! Power saving: a CPU clock that slows down, and idle states that take time to leave.

use super::verdict::Verdict;
use crate::machine::Machine;

/// Declared exit latencies above this stand for deep states, whose waking dwarfs a release's jitter.
const DEEP_US: i64 = 10;

const GUEST_POLLING: &str = "/sys/module/haltpoll/parameters/guest_halt_poll_ns";

/// Measured: see docs/loop.md.
const POLLING_COST: &str = "Polling while idle (0 held in /dev/cpu_dma_latency, idle=poll) shortens \
    the median wake-up, but the host takes polling CPUs away: where this was measured, the worst case \
    was ten times longer. wake = \"hybrid\" does not need it.";

pub(super) fn frequency_governor(machine: &Machine, cpu: usize) -> Verdict {
    let source = format!("/sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor");
    let effect = "The CPU's clock slows down while the task sleeps and speeds up only after it wakes, so wake-up and execution take longer.";
    let verdict = match machine.governor(cpu) {
        Some(governor) if governor == "performance" => Verdict::ok(governor)
            .effect("The CPU's clock does not slow down while the task sleeps."),
        Some(governor) => Verdict::warning(governor).effect(effect).fix(format!(
            "cpupower -c {cpu} frequency-set -g performance  # or echo performance > {source}"
        )),
        None if !machine.has("/sys/devices/system/cpu/online") => {
            Verdict::unknown("/sys cannot be read").effect(effect)
        }
        None if machine.is_guest() => Verdict::ok("none: the host sets the CPU's clock")
            .effect("The guest cannot see whether the host slows the CPU's clock down.")
            .inert("there is no frequency driver in this guest; the governor is set on the host"),
        None => Verdict::ok("none: the firmware sets the CPU's clock, or it is fixed")
            .effect("The kernel does not slow the CPU's clock down.")
            .inert("there is no frequency driver"),
    };
    verdict.from(source)
}

pub(super) fn idle_states(machine: &Machine, cpu: usize) -> Verdict {
    let folder = format!("/sys/devices/system/cpu/cpu{cpu}/cpuidle");
    let driver_file = "/sys/devices/system/cpu/cpuidle/current_driver";
    if machine.parameter("idle").as_deref() == Some("poll") {
        return Verdict::ok("none: idle=poll")
            .effect("An idle CPU spins, so it needs no time to wake up.")
            .from("/proc/cmdline");
    }
    let halting = format!(
        "An idle CPU in this guest halts and returns to the hypervisor; when the timer fires, the host decides \
         how soon it runs again. {POLLING_COST}"
    );
    if machine.has_no_idle_driver() {
        return if machine.is_guest() { Verdict::note("no idle driver: an idle CPU halts")
                .effect(halting)
                .fix("cpuidle_haltpoll.force=1 on the kernel command line  # polls for a short time, then halts") } else { Verdict::ok("no idle driver: an idle CPU halts (shallowest state)")
                .effect("The kernel enters no deep idle state by itself.") }
        .from(driver_file);
    }
    let Some(driver) = machine.idle_driver() else {
        return Verdict::unknown("the idle driver cannot be read")
            .effect("A CPU in a deep idle state takes time to wake up before the task can run.")
            .from(driver_file);
    };
    let states = machine.idle_states(cpu);
    let details = states.iter().map(|state| {
        let disabled = if state.enabled { "" } else { ", disabled" };
        format!("{}, exit latency {} us{disabled}", state.name, state.exit_latency_us)
    });
    let deep: Vec<_> =
        states.iter().filter(|state| state.enabled && state.exit_latency_us > DEEP_US).collect();
    let deepest_us = deep.iter().map(|state| state.exit_latency_us).max();
    let verdict = match deepest_us {
        _ if driver == "haltpoll" => {
            let polled_ns = machine.number(GUEST_POLLING);
            let polls = match polled_ns {
                Some(0) => "halts without polling first".to_owned(),
                Some(polled_ns) => format!("polls up to {} us, then halts", polled_ns / 1000),
                None => "how long it polls first is unknown".to_owned(),
            };
            Verdict::note(format!("{driver}: an idle CPU {polls}")).effect(halting)
        }
        _ if states.is_empty() => {
            Verdict::unknown(&format!("the states of {driver} cannot be read"))
                .effect("A CPU in a deep idle state takes time to wake up before the task can run.")
        }
        None => Verdict::ok(format!("{driver}: no deep state enabled"))
            .effect("Waking from the enabled states takes little time."),
        Some(deepest_us) => {
            let names = deep.iter().map(|state| state.name.as_str()).collect::<Vec<_>>().join(", ");
            let files =
                deep.iter().map(|state| state.directory.as_str()).collect::<Vec<_>>().join(",");
            let files = if deep.len() > 1 { format!("{{{files}}}") } else { files };
            Verdict::warning(format!("{driver}: {names} enabled, up to {deepest_us} us to wake up"))
                .effect("A CPU that enters a deep state between cycles takes that long to wake up before the task can run.")
                .fix(if machine.is_guest() { format!("echo 1 | tee {folder}/{files}/disable") } else { format!("echo 1 | tee {folder}/{files}/disable  # or hold 0 in /dev/cpu_dma_latency while the task runs") })
        }
    };
    verdict.details(details).from(format!("{driver_file}, {folder}"))
}

pub(super) fn cpu_dma_latency(machine: &Machine, cpu: usize) -> Verdict {
    let file = "/dev/cpu_dma_latency";
    let lever = "A program that holds 0 in this file keeps idle CPUs out of every state that takes time to leave, as cyclictest does.";
    let polls = machine.parameter("idle").as_deref() == Some("poll");
    let has_deep =
        machine.idle_states(cpu).iter().any(|state| state.enabled && state.exit_latency_us > 0);
    let verdict = match () {
        () if machine.has_no_idle_driver() => Verdict::ok("without effect")
            .effect("It changes nothing, because only idle drivers read it.")
            .inert("no idle driver (current_driver is none), so cyclictest and tuned gain nothing from it here"),
        () if polls => Verdict::ok("without effect").effect("It changes nothing, because idle CPUs spin already.").inert("idle=poll"),
        () if machine.idle_driver().is_none() => Verdict::unknown("the idle driver cannot be read").effect(lever),
        () if !machine.has(file) => Verdict::ok("absent").effect(lever).inert("there is no such device file"),
        () if has_deep && machine.is_guest() => {
            Verdict::ok("works here, at a cost").effect(format!("{lever} {POLLING_COST}"))
        }
        () if has_deep => Verdict::ok("works here").effect(lever),
        () => Verdict::ok("without effect")
            .effect("It changes nothing, because no enabled idle state takes time to leave.")
            .inert("every idle state that takes time to leave is disabled"),
    };
    verdict.from(file)
}
