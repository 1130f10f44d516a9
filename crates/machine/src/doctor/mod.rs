//! The doctor: what a machine does to jitter, finding by finding, and the way out.
//!
//! It reads and changes nothing. A check is one function from a [`Machine`] and a CPU to a
//! [`Verdict`]; [`CHECKS`] is the list of them.

mod finding;
mod isolation;
mod memory;
mod platform;
mod power;
mod rights;
mod scheduling;
mod verdict;

pub use finding::{CheckResult, Severity};
use serde::{Deserialize, Serialize};
use verdict::Verdict;

use crate::environment::Environment;
use crate::machine::{CpuList, Machine};

/// Everything that the doctor found on a machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Examination {
    /// Version of the program that examined the machine.
    pub isochrone: String,
    /// The examined CPU.
    pub cpu: usize,
    /// CPUs online, in the kernel's list format.
    pub online_cpus: String,
    /// The machine and its kernel.
    pub environment: Environment,
    /// All findings, including harmless ones, in the order of the checks.
    pub findings: Vec<CheckResult>,
}

impl Examination {
    /// The findings of one severity, in order.
    pub fn of(&self, severity: Severity) -> impl Iterator<Item = &CheckResult> {
        self.findings.iter().filter(move |finding| finding.severity == severity)
    }
}

/// The CPU to examine does not exist or is offline.
#[derive(Clone, PartialEq, Eq)]
pub struct NoSuchCpu {
    /// The requested CPU.
    pub cpu: usize,
    /// CPUs online, in the kernel's list format: `0-3,8`.
    pub online: String,
}

impl std::fmt::Display for NoSuchCpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "CPU {} does not exist or is offline; this machine has {}", self.cpu, self.online)
    }
}

/// The sentence, for a `main` that returns it.
impl std::fmt::Debug for NoSuchCpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for NoSuchCpu {}

/// A check: its code and its judgement of a CPU of a machine.
struct Check {
    code: &'static str,
    judge: fn(&Machine, usize) -> Verdict,
}

/// All checks, in the order in which they are shown.
const CHECKS: &[Check] = &[
    Check { code: "real_time_priority", judge: rights::real_time_priority },
    Check { code: "cgroup_budget", judge: rights::cgroup_budget },
    Check { code: "cpu_affinity", judge: rights::cpu_affinity },
    Check { code: "memory_lock", judge: rights::memory_lock },
    Check { code: "nice_limit", judge: rights::nice_limit },
    Check { code: "open_files", judge: rights::open_files },
    Check { code: "container", judge: platform::container },
    Check { code: "preemption", judge: scheduling::preemption },
    Check { code: "rt_throttling", judge: scheduling::rt_throttling },
    Check { code: "fair_server", judge: scheduling::fair_server },
    Check { code: "real_time_threads", judge: scheduling::real_time_threads },
    Check { code: "timer_tick", judge: scheduling::timer_tick },
    Check { code: "quiet_cpu", judge: isolation::quiet_cpu },
    Check { code: "isolated_cpus", judge: isolation::isolated_cpus },
    Check { code: "nohz_full", judge: isolation::nohz_full },
    Check { code: "rcu_nocbs", judge: isolation::rcu_nocbs },
    Check { code: "interrupts", judge: isolation::interrupts },
    Check { code: "watchdog", judge: isolation::watchdog },
    Check { code: "smt_sibling", judge: isolation::smt_sibling },
    Check { code: "frequency_governor", judge: power::frequency_governor },
    Check { code: "idle_states", judge: power::idle_states },
    Check { code: "cpu_dma_latency", judge: power::cpu_dma_latency },
    Check { code: "hypervisor", judge: platform::hypervisor },
    Check { code: "steal", judge: platform::steal },
    Check { code: "clock_source", judge: platform::clock_source },
    Check { code: "huge_pages", judge: memory::huge_pages },
    Check { code: "swap", judge: memory::swap },
    Check { code: "shared_memory", judge: memory::shared_memory },
];

/// Examines a machine for a real-time task on `cpu`, by default on the CPU that
/// [`choose`](crate::Observation::choose) takes; if that is unknown, on the last one.
///
/// # Errors
/// The CPU does not exist or is offline.
pub fn examine(machine: &Machine, cpu: Option<usize>) -> Result<Examination, NoSuchCpu> {
    // An unreadable list says nothing; then the caller decides.
    let online = machine.online();
    if let (Some(cpu), Some(online)) = (cpu, &online)
        && !online.contains(cpu)
    {
        return Err(NoSuchCpu { cpu, online: online.to_string() });
    }
    let quiet = || Some(machine.observation()?.choose()?.cpu);
    let cpu = cpu.or_else(quiet).or_else(|| online.as_ref().and_then(CpuList::last)).unwrap_or(0);
    Ok(Examination {
        isochrone: env!("CARGO_PKG_VERSION").to_owned(),
        cpu,
        online_cpus: online.map(|online| online.to_string()).unwrap_or_default(),
        environment: Environment::of(machine),
        findings: CHECKS
            .iter()
            .map(|check| (check.judge)(machine, cpu).named(check.code))
            .collect(),
    })
}
