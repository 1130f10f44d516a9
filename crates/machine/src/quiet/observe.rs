//! Observing the CPUs of a machine.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use super::observation::{DeviceInterrupts, Observation, ObservedCpu};
use crate::machine::Machine;

/// Long enough to tell a busy device from a quiet one, short enough not to be noticed at a start.
const OBSERVATION: Duration = Duration::from_millis(200);

impl Machine {
    /// What happens on the CPUs that a thread of this process may be bound to, observed for 200 ms when it
    /// is first asked for; not at all where there is no choice. `None` if the kernel does not say which
    /// CPUs these are.
    pub fn observation(&self) -> Option<&Observation> {
        // Files do not count on while one waits.
        let pause = || if self.is_here() { sleep(OBSERVATION) } else { OBSERVATION };
        self.observation.get_or_init(|| Observation::of(self, pause)).as_ref()
    }
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
}

/// Returns how long it slept.
fn sleep(length: Duration) -> Duration {
    let began = Instant::now();
    std::thread::sleep(length);
    began.elapsed()
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
