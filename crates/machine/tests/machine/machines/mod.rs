//! Machines made of files: four that people have, and any change to them.

use std::fs;

use isochrone_machine::{CheckResult, Examination, Machine, examine};

/// Path and content.
pub(crate) type File = (&'static str, &'static str);

/// A file tree that looks like a machine.
pub(crate) struct Fake(tempfile::TempDir);

impl Fake {
    /// A machine of these files; later ones replace earlier ones.
    pub(crate) fn new(files: &[&[File]]) -> Self {
        let fake = Self(tempfile::tempdir().unwrap());
        files.iter().copied().flatten().for_each(|(path, text)| fake.write(path, text));
        fake
    }

    pub(crate) fn write(&self, path: &str, text: impl AsRef<[u8]>) {
        let path = self.0.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    /// Takes a file or a folder away.
    pub(crate) fn without(self, path: &str) -> Self {
        let path = self.0.path().join(path);
        if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }.unwrap();
        self
    }

    pub(crate) fn machine(&self) -> Machine {
        Machine::below(self.0.path()).with_free_bytes(|_| Some(512 << 20))
    }

    /// The last CPU.
    pub(crate) fn examine(&self) -> Examination {
        let machine = self.machine();
        let last = machine.online().and_then(|online| online.iter().last());
        examine(&machine, last).unwrap()
    }

    #[track_caller]
    pub(crate) fn finding(&self, code: &str) -> CheckResult {
        let findings = self.examine().findings;
        findings.into_iter().find(|finding| finding.code == code).unwrap()
    }
}

const LIMITS_TUNED: &str = "\
Limit                     Soft Limit           Hard Limit           Units
Max locked memory         unlimited            unlimited            bytes
Max open files            65536                65536                files
Max nice priority         40                   40
Max realtime priority     99                   99
";

const LIMITS_DEFAULT: &str = "\
Limit                     Soft Limit           Hard Limit           Units
Max locked memory         8388608              8388608              bytes
Max open files            1024                 524288               files
Max nice priority         0                    0
Max realtime priority     0                    0
";

/// A controller that someone made ready: everything is as it should be.
pub(crate) const METAL: &[File] = &[
    (
        "boot/config-6.12.8-rt",
        "CONFIG_PREEMPT_RT=y\nCONFIG_HZ=1000\nCONFIG_HIGH_RES_TIMERS=y\nCONFIG_NO_HZ_FULL=y\nCONFIG_RCU_NOCB_CPU=y\n",
    ),
    ("dev/cpu_dma_latency", ""),
    ("dev/shm/.keep", ""),
    ("proc/1/cgroup", "0::/init.scope\n"),
    ("proc/cmdline", "ro isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 nosmt\n"),
    ("proc/cpuinfo", "flags\t\t: fpu sse\n"),
    (
        "proc/interrupts",
        "           CPU0       CPU1       CPU2       CPU3\n  16:  40  0  0  0  IO-APIC  16-fasteoi  i801_smbus\n LOC:  1  1  1  1  Local timer interrupts\n",
    ),
    ("proc/irq/16/effective_affinity_list", "0\n"),
    ("proc/self/cgroup", "0::/user.slice/cell.service\n"),
    ("proc/self/limits", LIMITS_TUNED),
    ("proc/self/status", "CapEff:\t0000000000000000\nCpus_allowed_list:\t0-3\n"),
    ("proc/self/uid_map", "         0          0 4294967295\n"),
    ("proc/stat", "cpu3 10 0 20 9000 0 0 0 0 0 0\n"),
    ("proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n"),
    ("proc/sys/kernel/osrelease", "6.12.8-rt\n"),
    ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
    ("proc/sys/kernel/soft_watchdog", "1\n"),
    ("proc/sys/kernel/watchdog", "1\n"),
    ("proc/sys/kernel/watchdog_cpumask", "0-2\n"),
    ("proc/version", "Linux version 6.12.8-rt (gcc 14) #1 SMP PREEMPT_RT Thu\n"),
    ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm\n"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
    ("sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "performance\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state0/disable", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state0/latency", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state0/name", "POLL\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state1/disable", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state1/latency", "2\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state1/name", "C1\n"),
    ("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "3\n"),
    ("sys/devices/system/cpu/cpuidle/current_driver", "intel_idle\n"),
    ("sys/devices/system/cpu/isolated", "3\n"),
    ("sys/devices/system/cpu/nohz_full", "3\n"),
    ("sys/devices/system/cpu/online", "0-3\n"),
    ("sys/fs/cgroup/cgroup.controllers", "cpu memory\n"),
    ("sys/kernel/debug/sched/fair_server/cpu3/period", "1000000000\n"),
    ("sys/kernel/debug/sched/fair_server/cpu3/runtime", "0\n"),
    ("sys/kernel/mm/transparent_hugepage/enabled", "always madvise [never]\n"),
];

/// A small guest on a shared host, as root, with control groups of version 1.
pub(crate) const GUEST: &[File] = &[
    (
        "boot/config-6.18.44",
        "CONFIG_PREEMPT_NONE=y\nCONFIG_PREEMPT_DYNAMIC=y\nCONFIG_HZ=250\nCONFIG_HIGH_RES_TIMERS=y\n# CONFIG_NO_HZ_FULL is not set\nCONFIG_RCU_NOCB_CPU=y\nCONFIG_RT_GROUP_SCHED=y\n",
    ),
    ("dev/cpu_dma_latency", ""),
    ("dev/shm/.keep", ""),
    (
        "proc/12/task/12/stat",
        "12 (migration/1) S 2 0 0 0 -1 69238880 0 0 0 0 0 0 0 0 -100 0 1 0 5 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 17 1 99 1 0 0 0",
    ),
    (
        "proc/40/task/40/stat",
        "40 (irq/25-a) b) S 2 0 0 0 -1 2129984 0 0 0 0 0 0 0 0 -51 0 1 0 5 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 17 1 50 1 0 0 0",
    ),
    ("proc/cmdline", "quiet -- preempt=full\n"),
    ("proc/cpuinfo", "flags\t\t: fpu hypervisor\n"),
    (
        "proc/interrupts",
        "           CPU0       CPU1\n  36:  0  251  PCI-MSIX-0000:00:02.0  1-edge  virtio1-req.0\n  37:  0  0  PCI-MSIX-0000:00:03.0  0-edge  virtio2-config\n  39:  7  0  PCI-MSIX-0000:00:03.0  2-edge  virtio2-output.0\n  38:  0  4123  PCI-MSIX-0000:00:03.0  1-edge  virtio2-input.0\n LOC:  5  6  Local timer interrupts\n",
    ),
    ("proc/irq/36/effective_affinity_list", "1\n"),
    ("proc/irq/37/effective_affinity_list", "1\n"),
    ("proc/irq/38/effective_affinity_list", "1\n"),
    ("proc/irq/39/effective_affinity_list", "0\n"),
    ("proc/mounts", "proc /proc proc rw 0 0\n"),
    ("proc/self/cgroup", "1:cpu:/\n0::/\n"),
    ("proc/self/limits", LIMITS_DEFAULT),
    ("proc/self/status", "CapEff:\t000001fffeffffff\nCpus_allowed_list:\t0-1\n"),
    ("proc/self/uid_map", "         0          0 4294967295\n"),
    ("proc/stat", "cpu1 50000 0 0 49980 0 0 0 20 0 0\n"),
    ("proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n"),
    ("proc/sys/kernel/osrelease", "6.18.44\n"),
    ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
    ("proc/sys/kernel/soft_watchdog", "1\n"),
    ("proc/sys/kernel/watchdog", "1\n"),
    ("proc/sys/kernel/watchdog_cpumask", "0-1\n"),
    ("proc/sys/kernel/watchdog_thresh", "10\n"),
    ("proc/version", "Linux version 6.18.44 (gcc 15) #1 SMP PREEMPT_DYNAMIC @0\n"),
    ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc kvm-clock\n"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
    ("sys/devices/system/cpu/cpu1/topology/thread_siblings_list", "1\n"),
    ("sys/devices/system/cpu/cpuidle/current_driver", "none\n"),
    ("sys/devices/system/cpu/isolated", "\n"),
    ("sys/devices/system/cpu/online", "0-1\n"),
    ("sys/fs/cgroup/cpu/cpu.rt_runtime_us", "950000\n"),
    ("sys/fs/cgroup/cpu/cpu.shares", "1024\n"),
    ("sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n"),
];

/// What a container without rights changes: it sees the machine's kernel, and may do nothing.
pub(crate) const CONTAINER: &[File] = &[
    (".dockerenv", ""),
    ("proc/self/cgroup", "1:cpu:/docker/4f\n0::/\n"),
    ("proc/self/status", "CapEff:\t00000000a80425fb\nCpus_allowed_list:\t0\n"),
    ("sys/fs/cgroup/cpu/docker/4f/cpu.rt_runtime_us", "0\n"),
];

/// What a laptop with a distribution's kernel changes of the controller.
pub(crate) const LAPTOP: &[File] = &[
    (
        "boot/config-6.1.0-18",
        "CONFIG_PREEMPT_VOLUNTARY=y\nCONFIG_PREEMPT_DYNAMIC=y\nCONFIG_HZ=250\nCONFIG_HIGH_RES_TIMERS=y\nCONFIG_NO_HZ_FULL=y\nCONFIG_RCU_NOCB_CPU=y\n# CONFIG_RT_GROUP_SCHED is not set\n",
    ),
    (
        "proc/2212/task/2213/stat",
        "2213 (pipewire) S 1 0 0 0 -1 4194304 0 0 0 0 0 0 0 0 -21 0 3 0 5 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 17 3 88 1 0 0 0",
    ),
    ("proc/cmdline", "ro quiet splash\n"),
    (
        "proc/interrupts",
        "           CPU0       CPU1       CPU2       CPU3\n 125:  0  0  0  99  PCI-MSI  327680-edge  xhci_hcd\n",
    ),
    ("proc/irq/125/smp_affinity_list", "0-3\n"),
    ("proc/self/limits", LIMITS_DEFAULT),
    ("proc/swaps", "Filename\tType\tSize\tUsed\tPriority\n/dev/dm-1 partition 8000000 0 -2\n"),
    ("proc/sys/kernel/osrelease", "6.1.0-18\n"),
    ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
    ("proc/sys/kernel/watchdog_cpumask", "0-3\n"),
    ("proc/version", "Linux version 6.1.0-18 (gcc 12) #1 SMP PREEMPT_DYNAMIC Debian\n"),
    ("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n"),
    ("sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "powersave\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state10/disable", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state10/latency", "890\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state10/name", "C10\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state2/disable", "0\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state2/latency", "85\n"),
    ("sys/devices/system/cpu/cpu3/cpuidle/state2/name", "C6\n"),
    ("sys/devices/system/cpu/cpu3/topology/thread_siblings_list", "1,3\n"),
    ("sys/devices/system/cpu/isolated", "\n"),
    ("sys/devices/system/cpu/nohz_full", "(null)\n"),
    ("sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never\n"),
];

/// What the kernel's idle driver for guests changes.
pub(crate) const HALTPOLL: &[File] = &[
    ("sys/devices/system/cpu/cpuidle/current_driver", "haltpoll\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/disable", "0\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/latency", "1\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/name", "haltpoll idle\n"),
    ("sys/module/haltpoll/parameters/guest_halt_poll_ns", "0\n"),
];
