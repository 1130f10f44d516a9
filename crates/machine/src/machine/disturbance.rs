//! Disturbances of a CPU and a thread, as the kernel counts them.

use super::Machine;
use crate::disturbance::Disturbance;

/// `USER_HZ`, the unit of `/proc/stat`, is this on every architecture that Linux has today.
const TICK_NS: u64 = 10_000_000;

impl Machine {
    /// The kernel's counts so far: steal and interrupts of a CPU (of all CPUs if `cpu` is `None`),
    /// faults and preemptions of a thread of this process, and throttling of its control group.
    /// Counts that cannot be read are `None`.
    pub fn disturbance(&self, cpu: Option<usize>, thread: Option<u32>) -> Disturbance {
        Disturbance {
            steal_ns: self.steal_ns(cpu),
            throttled_ns: self.throttled_ns(),
            faults: thread.and_then(|thread| self.faults(thread)),
            preemptions: thread.and_then(|thread| self.preemptions(thread)),
            interrupts: self.interrupt_count(cpu),
        }
    }

    fn steal_ns(&self, cpu: Option<usize>) -> Option<u64> {
        let name = cpu.map_or_else(|| "cpu".to_owned(), |cpu| format!("cpu{cpu}"));
        let stat = self.text("/proc/stat")?;
        let of_cpu = |line: &&str| line.split_whitespace().next() == Some(&name);
        let ticks = stat.lines().find(of_cpu)?.split_whitespace().nth(8)?;
        Some(ticks.parse::<u64>().ok()? * TICK_NS)
    }

    /// Without the CPU's own timer: a loop that sleeps is woken by it.
    fn interrupt_count(&self, cpu: Option<usize>) -> Option<u64> {
        let table = self.interrupt_table()?;
        let rows = table.rows.iter().filter(|row| !row.is_timer());
        Some(rows.map(|row| table.count(row, cpu)).sum())
    }

    /// Time for which a limit of CPU time stopped the control group: version 2, or 1.
    fn throttled_ns(&self) -> Option<u64> {
        let stat = self.text(&format!("{}/cpu.stat", self.control_group("cpu")?.folder()))?;
        stat.lines().find_map(|line| match line.split_once(' ')? {
            ("throttled_usec", us) => Some(us.parse::<u64>().ok()? * 1_000),
            ("throttled_time", ns) => ns.parse().ok(),
            _ => None,
        })
    }

    /// Page faults of a thread.
    fn faults(&self, thread: u32) -> Option<u64> {
        let stat = self.text(&format!("/proc/self/task/{thread}/stat"))?;
        // The name stands in brackets and may hold anything.
        let (_, fields) = stat.rsplit_once(')')?;
        let field = |index| fields.split_whitespace().nth(index)?.parse::<u64>().ok();
        Some(field(7)? + field(9)?)
    }

    /// Involuntary switches of a thread.
    fn preemptions(&self, thread: u32) -> Option<u64> {
        let status = self.text(&format!("/proc/self/task/{thread}/status"))?;
        let switches =
            status.lines().find_map(|line| line.strip_prefix("nonvoluntary_ctxt_switches:"))?;
        switches.trim().parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made_of_files::machine;

    const FILES: [(&str, &str); 6] = [
        (
            "proc/stat",
            "cpu  1 1 1 1 1 1 1 7 0 0\ncpu0 1 1 1 1 1 1 1 2 0 0\ncpu1 1 1 1 1 1 1 1 5 0 0",
        ),
        (
            "proc/interrupts",
            "      CPU0  CPU1\n 36:  3  40  PCI-MSIX 1-edge virtio1\nLOC:  900 900  Local timer\n\
             RES:  5  6  Rescheduling\nERR:  0",
        ),
        ("proc/self/cgroup", "0::/node.slice"),
        ("sys/fs/cgroup/node.slice/cpu.stat", "usage_usec 5\nthrottled_usec 12"),
        ("proc/self/task/77/stat", "77 (a) b) S 1 1 1 0 -1 0 10 0 2 0 5 5"),
        ("proc/self/task/77/status", "voluntary_ctxt_switches:\t9\nnonvoluntary_ctxt_switches:\t4"),
    ];

    #[test]
    fn a_cpu_and_a_thread_have_their_own_counts() {
        let (_root, machine) = machine(&FILES);
        let expected = Disturbance {
            steal_ns: Some(50_000_000),
            throttled_ns: Some(12_000),
            faults: Some(12),
            preemptions: Some(4),
            interrupts: Some(46),
        };
        assert_eq!(machine.disturbance(Some(1), Some(77)), expected);
    }

    #[test]
    fn without_a_cpu_all_of_them_count() {
        let (_root, machine) = machine(&FILES);
        let all = machine.disturbance(None, None);
        assert_eq!((all.steal_ns, all.interrupts, all.faults), (Some(70_000_000), Some(54), None));
    }

    #[test]
    fn version_1_counts_throttling_in_nanoseconds() {
        let (_root, machine) = machine(&[
            ("proc/self/cgroup", "4:cpu,cpuacct:/node\n0::/"),
            ("sys/fs/cgroup/cpu,cpuacct/node/cpu.stat", "nr_periods 0\nthrottled_time 345"),
        ]);
        assert_eq!(machine.disturbance(None, None).throttled_ns, Some(345));
    }

    #[test]
    fn a_machine_that_tells_nothing_counts_nothing() {
        let (_root, machine) = machine(&[]);
        assert_eq!(machine.disturbance(Some(0), Some(1)), Disturbance::default());
    }

    #[test]
    fn the_interrupts_of_this_machine_never_get_fewer() {
        let here = Machine::here();
        let before = here.disturbance(None, None).interrupts;
        assert!(before > Some(0));
        assert!(here.disturbance(None, None).interrupts >= before);
    }
}
