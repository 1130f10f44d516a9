//! The environment of a run: the facts that decide what its numbers are worth.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

use crate::machine::{Machine, Platform};
use crate::throttling::Throttling;

const CLOCK_READINGS: usize = 20_000;

/// The machine and its kernel. What could not be determined is `None`, `null` in JSON.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Environment {
    /// Kernel release, as printed by `uname -r`.
    pub kernel: Option<String>,
    /// Preemption model: `rt`, `full`, `lazy`, `voluntary` or `none`. If it can be switched and the
    /// current setting cannot be read (only root can read debugfs), the model that the kernel
    /// started with; `dynamic` if that is unknown, too.
    pub preempt: Option<String>,
    /// Number of CPUs online.
    pub cpus: usize,
    /// Name of the hypervisor, `unknown` if it does not give one, `null` without a hypervisor.
    pub hypervisor: Option<String>,
    /// Clock source of the kernel. With any other than `tsc` or `arch_sys_counter`, reading the
    /// clock is slow.
    pub clocksource: Option<String>,
    /// Cost of reading `CLOCK_MONOTONIC`: the minimum of 20 000 readings, in ns. Every measured
    /// time includes it; it is never subtracted.
    pub clock_read_ns: Option<u64>,
    /// Frequency governors in use, comma-separated; `null` without frequency scaling.
    pub governor: Option<String>,
    /// Isolated CPUs (`isolcpus`), in the kernel's list format.
    pub isolated_cpus: String,
    /// Real-time throttling as `runtime/period` in us; a runtime of -1 means off.
    pub rt_throttling: Option<Throttling>,
    /// Whether that throttling applies to `SCHED_FIFO`; `null` if the kernel does not say.
    pub rt_throttling_applies: Option<bool>,
}

impl Environment {
    /// Reads the environment of this machine. Takes a few milliseconds; never fails.
    pub fn read() -> Self {
        Self::of(&Machine::here())
    }

    /// What the files of a machine say, and the clock of this one.
    pub(crate) fn of(machine: &Machine) -> Self {
        Self {
            kernel: machine.release(),
            preempt: machine.preemption().map(|preemption| preemption.model),
            cpus: machine.online().map_or(0, |cpus| cpus.len()),
            hypervisor: match machine.platform() {
                Platform::Guest(hypervisor) => Some(hypervisor),
                Platform::Metal | Platform::Unknown => None,
            },
            clocksource: machine.clock_source(),
            clock_read_ns: machine.is_here().then(clock_read_ns),
            governor: machine.governors(),
            isolated_cpus: machine.isolated().unwrap_or_default(),
            rt_throttling: machine.throttling(),
            rt_throttling_applies: machine.throttles_fifo(),
        }
    }

    /// The throttling that takes a `SCHED_FIFO` thread off its CPU; `None` if there is none. If the
    /// kernel does not say whether its throttling applies to such threads, assumes that it does.
    pub fn fifo_throttling(&self) -> Option<Throttling> {
        let applies = self.rt_throttling_applies != Some(false);
        self.rt_throttling.filter(|throttling| applies && throttling.granted().is_some())
    }
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
