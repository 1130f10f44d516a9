//! What a task's thread has cost since its warm-up.

use isochrone_cyclic::{
    Clock, Monotonic, ThreadUsage, counts_allocations, thread_allocations, thread_usage,
};
use isochrone_timing::TaskReport;

/// What the thread had used when counting began.
pub(super) struct Account {
    usage: ThreadUsage,
    opened_ns: u64,
    counts_allocations: bool,
    allocations: u64,
    /// Allocations by iceoryx2 while receiving and sending, until then.
    port_allocations: u64,
    /// Allocations by iceoryx2 in the slack since then.
    slack_allocations: u64,
}

impl Account {
    pub(super) fn open(port_allocations: u64) -> Self {
        Self {
            usage: thread_usage(),
            opened_ns: Monotonic.now_ns(),
            counts_allocations: counts_allocations(),
            allocations: thread_allocations(),
            port_allocations,
            slack_allocations: 0,
        }
    }

    /// Runs a call of iceoryx2, whose allocations do not count as ours.
    pub(super) fn library(&mut self, work: impl FnOnce()) {
        let before = thread_allocations();
        work();
        self.slack_allocations += thread_allocations() - before;
    }

    /// The report, with the costs of the thread since then.
    pub(super) fn close(self, port_allocations: u64) -> TaskReport {
        let allocations = thread_allocations() - self.allocations;
        let library = self.slack_allocations + port_allocations - self.port_allocations;
        let usage = thread_usage().since(self.usage);
        let elapsed_ns = Monotonic.now_ns().saturating_sub(self.opened_ns);
        let counted = |count| self.counts_allocations.then_some(count);
        TaskReport {
            cpu_fraction: Some(usage.cpu_ns as f64 / elapsed_ns.max(1) as f64),
            allocations: counted(allocations.saturating_sub(library)),
            ipc_allocations: counted(library),
            minor_faults: Some(usage.minor_faults),
            major_faults: Some(usage.major_faults),
            voluntary_switches: Some(usage.voluntary_switches),
            involuntary_switches: Some(usage.involuntary_switches),
            ..TaskReport::default()
        }
    }
}
