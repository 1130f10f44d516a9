//! Where a run took place: the facts that decide what its numbers are worth.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

const CLOCK_READINGS: usize = 20_000;
const CLOCKSOURCE: &str = "sys/devices/system/clocksource/clocksource0";

/// The machine and its kernel. `None` (JSON `null`) is what could not be found out.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Environment {
    /// Kernel release, as `uname -r`.
    pub kernel: Option<String>,
    /// Preemption: `rt`, `full`, `lazy`, `voluntary` or `none`; `dynamic` if it was chosen at boot
    /// and the choice cannot be read (it is in debugfs, for root).
    pub preempt: Option<String>,
    /// CPUs online.
    pub cpus: usize,
    /// Hypervisor underneath, `unknown` if there is one without a name, `null` if there is none.
    pub hypervisor: Option<String>,
    /// The kernel's clock source: anything but `tsc` or `arch_sys_counter` makes readings slow.
    pub clocksource: Option<String>,
    /// Cost of reading `CLOCK_MONOTONIC`: the least of 20 000 readings, in ns. It is contained in
    /// every measured time and never subtracted.
    pub clock_read_ns: u64,
    /// Frequency governors in use, comma-separated; `null` without frequency scaling.
    pub governor: Option<String>,
    /// CPUs kept free of other work (`isolcpus`), as the kernel lists them.
    pub isolated_cpus: String,
    /// Real-time throttling as `runtime/period` in us; `-1/...` is off.
    pub rt_throttling: Option<String>,
}

impl Environment {
    /// Looks around on this machine. Takes a few milliseconds; never fails.
    pub fn read() -> Self {
        Self {
            clock_read_ns: clock_read_ns(),
            ..Self::read_below(Path::new("/"))
        }
    }

    fn read_below(root: &Path) -> Self {
        let read = |path: &str| {
            let text = fs::read_to_string(root.join(path)).ok()?;
            Some(text.trim_end().to_owned())
        };
        let cpuinfo = read("proc/cpuinfo").unwrap_or_default();
        Self {
            kernel: read("proc/sys/kernel/osrelease"),
            preempt: preempt(&read),
            cpus: read("sys/devices/system/cpu/online").map_or(0, |list| count_cpus(&list)),
            hypervisor: hypervisor(&read, &cpuinfo),
            clocksource: read(&format!("{CLOCKSOURCE}/current_clocksource")),
            clock_read_ns: 0,
            governor: governor(root),
            isolated_cpus: read("sys/devices/system/cpu/isolated").unwrap_or_default(),
            rt_throttling: read("proc/sys/kernel/sched_rt_runtime_us")
                .zip(read("proc/sys/kernel/sched_rt_period_us"))
                .map(|(runtime, period)| format!("{runtime}/{period}")),
        }
    }
}

fn preempt(read: &impl Fn(&str) -> Option<String>) -> Option<String> {
    if read("sys/kernel/realtime").as_deref() == Some("1") {
        return Some("rt".to_owned());
    }
    // "none voluntary (full) lazy": the chosen one is in parentheses.
    if let Some(modes) = read("sys/kernel/debug/sched/preempt") {
        let chosen = modes.split_once('(')?.1.split_once(')')?.0;
        return Some(chosen.to_owned());
    }
    // "#1 SMP PREEMPT_DYNAMIC Thu ...". A kernel that says nothing may be "voluntary" or "none".
    let version = read("proc/version")?;
    let built = version.split_whitespace().find_map(|word| match word {
        "PREEMPT_RT" => Some("rt"),
        "PREEMPT_LAZY" => Some("lazy"),
        "PREEMPT" => Some("full"),
        "PREEMPT_DYNAMIC" => Some("dynamic"),
        _ => None,
    })?;
    if built == "dynamic"
        && let Some(command_line) = read("proc/cmdline")
        && let Some(chosen) = command_line
            .split_whitespace()
            .find_map(|a| a.strip_prefix("preempt="))
    {
        return Some(chosen.to_owned());
    }
    Some(built.to_owned())
}

fn hypervisor(read: &impl Fn(&str) -> Option<String>, cpuinfo: &str) -> Option<String> {
    if let Some(kind) = read("sys/hypervisor/type") {
        return Some(kind);
    }
    let flagged = cpuinfo
        .lines()
        .find(|line| line.starts_with("flags"))
        .is_some_and(|flags| flags.split_whitespace().any(|flag| flag == "hypervisor"));
    if !flagged {
        return None;
    }
    // The flag has no name. A paravirtual clock tells the hypervisor, firmware at least the vendor.
    let clocksources = read(&format!("{CLOCKSOURCE}/available_clocksource")).unwrap_or_default();
    if clocksources.contains("kvm-clock") {
        return Some("kvm".to_owned());
    }
    if clocksources.contains("hyperv") {
        return Some("hyperv".to_owned());
    }
    Some(read("sys/class/dmi/id/sys_vendor").unwrap_or_else(|| "unknown".to_owned()))
}

fn governor(root: &Path) -> Option<String> {
    let policies = fs::read_dir(root.join("sys/devices/system/cpu/cpufreq")).ok()?;
    let governors: BTreeSet<String> = policies
        .flatten()
        .filter_map(|policy| fs::read_to_string(policy.path().join("scaling_governor")).ok())
        .map(|governor| governor.trim().to_owned())
        .collect();
    (!governors.is_empty()).then(|| Vec::from_iter(governors).join(","))
}

/// How many CPUs a kernel list such as `0-3,8` names.
fn count_cpus(list: &str) -> usize {
    list.split(',')
        .filter_map(|range| {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            let (first, last) = (first.parse::<usize>().ok()?, last.parse::<usize>().ok()?);
            Some(last.saturating_add(1).saturating_sub(first))
        })
        .sum()
}

/// The least time between two readings in a row: what one reading costs undisturbed.
fn clock_read_ns() -> u64 {
    let mut before = monotonic_ns();
    let mut least = u64::MAX;
    for _ in 0..CLOCK_READINGS {
        let now = monotonic_ns();
        least = least.min(now.saturating_sub(before));
        before = now;
    }
    least
}

fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    // Time since boot is never negative.
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

#[cfg(test)]
#[path = "environment_tests.rs"]
mod tests;
