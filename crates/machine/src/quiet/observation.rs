//! Observing the CPUs that a thread of this process may be bound to.

use crate::machine::CpuList;

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

/// A program's thread that runs on one CPU only, as the tasks of a node do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundThread {
    /// Its process; `None` of one that is told by its name alone.
    pub process: Option<u32>,
    /// Its name; of one that has a process at most 15 bytes.
    pub name: String,
    /// The CPU that it is bound to.
    pub cpu: usize,
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
