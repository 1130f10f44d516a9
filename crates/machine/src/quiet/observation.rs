//! Observing the CPUs that a thread of this process may be bound to.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use crate::machine::{BoundThread, CpuList, Machine};

/// Observations of the CPUs that a thread of this process may be bound to.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// In the order of their numbers.
    pub cpus: Vec<ObservedCpu>,
}

/// Observations of one CPU.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedCpu {
    /// Its number.
    pub cpu: usize,
    /// The kernel leaves it alone: `isolcpus`, an isolated cpuset or `nohz_full`.
    pub is_isolated: bool,
    /// The CPUs of its core, itself included.
    pub core: CpuList,
    /// The threads that are bound to it.
    pub bound: Vec<BoundThread>,
    /// How often devices interrupt it; `None` if the kernel does not say.
    pub interrupts: Option<DeviceInterrupts>,
}

/// How often devices interrupt a CPU. The kernel's own interrupts, such as timers, do not count.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct DeviceInterrupts {
    /// Per second, while they were observed.
    pub per_second: f64,
    /// Since the machine started.
    pub since_boot: u64,
}

impl Observation {
    /// Observes a machine from before to after `pause`, which returns how long it took; without a pause
    /// where there is no choice. `None` if the kernel does not say which CPUs this process may use.
    pub fn of(machine: &Machine, pause: impl FnOnce() -> Duration) -> Option<Self> {
        let bindable = machine.bindable()?;
        let mut cpus: Vec<_> = describe(machine, &bindable);
        if cpus.len() > 1 {
            count_interrupts(machine, &mut cpus, pause);
        }
        // Last, so that a node that starts at the same time has had its chance to be seen.
        for thread in machine.bound_threads() {
            if let Some(observed) = cpus.iter_mut().find(|observed| observed.cpu == thread.cpu) {
                observed.bound.push(thread);
            }
        }
        Some(Self { cpus })
    }

    /// Counts a thread that is going to be bound to a CPU.
    pub fn bind(&mut self, thread: BoundThread) {
        if let Some(observed) = self.cpus.iter_mut().find(|observed| observed.cpu == thread.cpu) {
            observed.bound.push(thread);
        }
    }

    /// Gives a thread of another process the full name of what it is: `level.fast` for the thread `fast`. Does
    /// nothing if no thread of that name is bound to the CPU.
    pub fn name(&mut self, cpu: usize, thread: &str, full_name: &str) {
        // The kernel keeps 15 bytes.
        let mut kept = thread.chars().take(15).collect::<String>();
        while kept.len() > 15 {
            kept.pop();
        }
        let observed = self.cpus.iter_mut().find(|observed| observed.cpu == cpu);
        let mut bound = observed.into_iter().flat_map(|observed| &mut observed.bound);
        if let Some(found) = bound.find(|it| it.process.is_some() && it.name == kept) {
            (found.process, found.name) = (None, full_name.to_owned());
        }
    }
}

/// Counts from before to after `pause`.
fn count_interrupts(machine: &Machine, cpus: &mut [ObservedCpu], pause: impl FnOnce() -> Duration) {
    let before = machine.device_interrupts();
    let elapsed = pause();
    let after = machine.device_interrupts();
    for observed in cpus {
        let count =
            |counts: &Option<BTreeMap<usize, u64>>| counts.as_ref()?.get(&observed.cpu).copied();
        observed.interrupts = count(&before).zip(count(&after)).map(|(before, after)| {
            let fired = after.saturating_sub(before) as f64;
            let per_second = fired / elapsed.as_secs_f64().max(f64::MIN_POSITIVE);
            DeviceInterrupts { per_second, since_boot: after }
        });
    }
}

fn describe(machine: &Machine, cpus: &BTreeSet<usize>) -> Vec<ObservedCpu> {
    let kept_free = machine.kept_free();
    let describe = |cpu: &usize| ObservedCpu {
        cpu: *cpu,
        is_isolated: kept_free.contains(cpu),
        core: machine.core(*cpu).unwrap_or_default(),
        bound: Vec::new(),
        interrupts: None,
    };
    cpus.iter().map(describe).collect()
}
