//! What each check says of the machine that it is made for.

use isochrone_machine::Severity::{self, Note, Ok as Fine, Problem, Warning};

use crate::doctor::assert_complete;
use crate::machines::{CONTAINER, Fake, File, GUEST, HALTPOLL, LAPTOP, METAL};
use Inert::{No, Yes};

/// A change to a machine, and what one check says of it.
struct Case(&'static [&'static [File]], &'static str, Severity, &'static str, Inert);

#[derive(Clone, Copy, PartialEq, Debug)]
enum Inert {
    Yes,
    No,
}

#[rustfmt::skip]
const CASES: &[Case] = &[
    Case(&[GUEST], "real_time_priority", Fine, "CAP_SYS_NICE", Yes),
    Case(&[METAL], "real_time_priority", Fine, "RLIMIT_RTPRIO 99", No),
    Case(&[METAL, &[("proc/self/limits", "Max realtime priority 0 40\n")]], "real_time_priority", Note, "up to 40", No),
    Case(&[GUEST, &[("proc/self/uid_map", "0 100000 65536\n")]], "real_time_priority", Problem, "user namespace", No),

    Case(&[GUEST], "cgroup_budget", Fine, "950000 us", No),
    Case(&[GUEST, CONTAINER], "cgroup_budget", Problem, "0 us", No),
    Case(&[GUEST, CONTAINER, &[("proc/sys/kernel/sched_rt_runtime_us", "-1\n")]], "cgroup_budget", Fine, "0 us", Yes),
    Case(&[METAL], "cgroup_budget", Fine, "no cpu controller", No),
    Case(&[METAL, LAPTOP, &[("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n")]], "cgroup_budget", Fine, "none needed", Yes),
    Case(&[GUEST, &[("proc/self/cgroup", "0::/a/b\n"), ("sys/fs/cgroup/cgroup.controllers", "cpu\n"), ("sys/fs/cgroup/a/cpu.max", "max\n")]], "cgroup_budget", Problem, "cgroup v2", No),
    Case(&[GUEST, &[("proc/cmdline", "rt_group_sched=0\n"), ("proc/self/cgroup", "0::/a/b\n"), ("sys/fs/cgroup/cgroup.controllers", "cpu\n"), ("sys/fs/cgroup/a/cpu.max", "max\n")]], "cgroup_budget", Fine, "cgroup v2", Yes),

    Case(&[METAL], "memory_lock", Fine, "unlimited", No),
    Case(&[GUEST], "memory_lock", Fine, "CAP_IPC_LOCK", Yes),
    Case(&[METAL, LAPTOP], "memory_lock", Warning, "8 MiB", No),
    Case(&[METAL, LAPTOP], "open_files", Fine, "1024", No),
    Case(&[METAL, &[("proc/self/limits", "Max open files 256 4096 files\n")]], "open_files", Note, "256", No),
    Case(&[METAL], "nice_limit", Fine, "RLIMIT_NICE 40", Yes),
    Case(&[GUEST, CONTAINER], "cpu_affinity", Problem, "CPU 1 is excluded", No),

    Case(&[GUEST], "container", Fine, "no sign", No),
    Case(&[GUEST, &[(".dockerenv", "")]], "container", Note, "maybe (/.dockerenv alone)", No),
    Case(&[GUEST, &[(".dockerenv", ""), ("proc/1/comm", "systemd\n")]], "container", Note, "maybe (/.dockerenv alone)", No),
    Case(&[GUEST, &[(".dockerenv", ""), ("proc/1/comm", "docker-init\n")]], "container", Note, "yes (/.dockerenv, docker-init is process 1)", No),
    Case(&[GUEST, &[(".dockerenv", ""), ("proc/mounts", "overlay / overlay rw 0 0\n")]], "container", Note, "yes (/.dockerenv, / is an overlay)", No),
    Case(&[GUEST, CONTAINER], "container", Note, "yes (docker in /proc/self/cgroup)", No),
    Case(&[GUEST, &[("run/.containerenv", "")]], "container", Note, ".containerenv", No),
    Case(&[GUEST, &[("proc/1/cgroup", "0::/kubepods/pod1\n")]], "container", Note, "kubepods", No),

    Case(&[METAL], "preemption", Fine, "PREEMPT_RT", No),
    Case(&[GUEST], "preemption", Warning, "none (dynamic", No),
    Case(&[METAL, LAPTOP], "preemption", Warning, "voluntary (dynamic", No),
    Case(&[GUEST, &[("proc/cmdline", "preempt=full\n")]], "preemption", Note, "full (dynamic", No),
    Case(&[GUEST, &[("sys/kernel/debug/sched/preempt", "none voluntary full (lazy)\n")]], "preemption", Note, "lazy (dynamic)", No),
    Case(&[METAL, LAPTOP, &[("proc/version", "Linux version 6.1 #1 SMP Thu")]], "preemption", Warning, "voluntary", No),

    Case(&[METAL], "rt_throttling", Fine, "off", No),
    Case(&[METAL, LAPTOP], "rt_throttling", Note, "950 of 1000 ms", No),
    Case(&[GUEST], "rt_throttling", Note, "950 of 1000 ms", No),
    Case(&[METAL, &[("proc/sys/kernel/sched_rt_runtime_us", "950000\n")]], "rt_throttling", Fine, "950 of 1000 ms", Yes),
    Case(&[METAL], "fair_server", Fine, "off", No),
    Case(&[METAL, &[("sys/kernel/debug/sched/fair_server/cpu3/runtime", "50000000\n")]], "fair_server", Note, "50 of 1000 ms", No),
    Case(&[GUEST], "fair_server", Note, "by default", No),
    Case(&[GUEST, &[("proc/sys/kernel/osrelease", "6.6.30\n")]], "fair_server", Fine, "before 6.12", No),
    Case(&[METAL], "real_time_threads", Fine, "none on CPU 3", No),
    Case(&[GUEST], "real_time_threads", Fine, "1 on CPU 1, of the kernel", No),
    Case(&[METAL, LAPTOP], "real_time_threads", Note, "1 of them of programs", No),
    Case(&[METAL], "timer_tick", Fine, "1000 Hz, stopped", No),
    Case(&[GUEST], "timer_tick", Note, "250 Hz, every 4 ms", No),
    Case(&[GUEST, &[("proc/cmdline", "highres=off\n")]], "timer_tick", Warning, "without high-resolution", No),

    Case(&[GUEST, &[("sys/devices/system/cpu/isolated", "0\n")]], "isolated_cpus", Warning, "0, not CPU 1", No),
    Case(&[GUEST, &[("sys/fs/cgroup/cpuset.cpus.isolated", "1\n")]], "isolated_cpus", Fine, "CPU 1 is isolated", No),
    Case(&[GUEST, &[("sys/devices/system/cpu/online", "0\n")]], "isolated_cpus", Note, "one CPU", No),
    Case(&[GUEST], "nohz_full", Note, "not built", Yes),
    Case(&[METAL, LAPTOP], "nohz_full", Note, "none", No),
    Case(&[METAL, LAPTOP], "rcu_nocbs", Note, "none", No),
    Case(&[GUEST, &[("proc/cmdline", "rcu_nocbs=all\n")]], "rcu_nocbs", Fine, "all", No),
    Case(&[GUEST, &[("proc/cmdline", "rcu_nocbs=0\n")]], "rcu_nocbs", Note, "0, not CPU 1", No),
    Case(&[GUEST, &[("proc/cmdline", "rcu_nocbs=0-7:1/2\n")]], "rcu_nocbs", Note, "unknown", No),
    Case(&[GUEST, &[("boot/config-6.18.44", "CONFIG_HZ=250\n")]], "rcu_nocbs", Note, "not built", Yes),
    Case(&[GUEST, &[("proc/irq/36/effective_affinity_list", "0\n"), ("proc/irq/38/effective_affinity_list", "0\n")]], "interrupts", Note, "1 can fire on CPU 1, none did", No),
    Case(&[METAL, LAPTOP], "interrupts", Warning, "1 can fire on CPU 3, 1 did", No),
    Case(&[GUEST], "watchdog", Note, "every 4 s", No),
    Case(&[GUEST, &[("proc/sys/kernel/soft_watchdog", "0\n")]], "watchdog", Fine, "off", No),
    Case(&[METAL, LAPTOP], "smt_sibling", Warning, "CPU 1 shares the core of CPU 3", No),
    Case(&[METAL, LAPTOP, &[("sys/devices/system/cpu/isolated", "1,3\n")]], "smt_sibling", Note, "is isolated", No),

    Case(&[METAL, LAPTOP], "frequency_governor", Warning, "powersave", No),
    Case(&[GUEST], "frequency_governor", Fine, "the host", Yes),
    Case(&[GUEST], "idle_states", Note, "no idle driver", No),
    Case(&[METAL, LAPTOP], "idle_states", Warning, "C6, C10 enabled, up to 890 us", No),
    Case(&[METAL, LAPTOP, &[("proc/cmdline", "idle=poll\n")]], "idle_states", Fine, "idle=poll", No),
    Case(&[GUEST, &[("sys/devices/system/cpu/cpuidle/current_driver", "haltpoll\n"), ("sys/module/haltpoll/parameters/guest_halt_poll_ns", "200000\n")]], "idle_states", Note, "polls up to 200 us", No),
    Case(&[GUEST], "cpu_dma_latency", Fine, "without effect", Yes),
    Case(&[GUEST, HALTPOLL], "cpu_dma_latency", Fine, "works here, at a cost", No),
    Case(&[METAL, LAPTOP], "cpu_dma_latency", Fine, "works here", No),
    Case(&[METAL, LAPTOP, &[("proc/cmdline", "idle=poll\n")]], "cpu_dma_latency", Fine, "without effect", Yes),

    Case(&[METAL], "hypervisor", Fine, "none", No),
    Case(&[METAL, &[("proc/cpuinfo", "Features : fp asimd\n")]], "hypervisor", Note, "unknown", No),
    Case(&[GUEST], "steal", Note, "0.020 %", No),
    Case(&[GUEST, &[("proc/stat", "cpu1 900 0 0 0 0 0 0 100\n")]], "steal", Warning, "10.000 %", No),
    Case(&[GUEST, &[("sys/devices/system/clocksource/clocksource0/current_clocksource", "kvm-clock\n")]], "clock_source", Note, "kvm-clock (of tsc, kvm-clock)", No),
    Case(&[METAL, LAPTOP], "clock_source", Warning, "hpet", No),
    Case(&[METAL, LAPTOP], "huge_pages", Warning, "always", No),
    Case(&[METAL, LAPTOP], "swap", Warning, "/dev/dm-1", No),
    Case(&[METAL, &[("proc/swaps", "Filename Type\n/swapfile file\n")]], "swap", Note, "/swapfile", No),
    Case(&[METAL], "shared_memory", Fine, "512 MiB free", No),
];

#[test]
fn each_check_says_what_its_machine_deserves() {
    for Case(files, code, severity, value, inert) in CASES {
        let finding = Fake::new(files).finding(code);
        let what = format!("{value:?} of {finding:#?}");
        assert_eq!(finding.severity, *severity, "{what}");
        assert!(finding.value.contains(value), "{what}");
        assert_eq!(finding.inert, *inert == Yes, "{what}");
        assert_complete(&finding);
    }
}
