use super::*;
use crate::made_of_files::{File, machine};

/// The environment of a machine of these files.
fn environment(files: &[File]) -> Environment {
    let (_root, machine) = machine(files);
    Environment::of(&machine)
}

#[test]
fn a_machine_that_shows_everything_is_read_completely() {
    let environment = environment(&[
        ("proc/sys/kernel/osrelease", "6.18.44\n"),
        ("sys/kernel/debug/sched/preempt", "none voluntary (full) lazy \n"),
        ("sys/devices/system/cpu/online", "0-3,6\n"),
        ("proc/cpuinfo", "processor : 0\nflags\t\t: fpu hypervisor sse\n"),
        ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
        ("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc kvm-clock\n"),
        ("sys/devices/system/cpu/cpufreq/policy0/scaling_governor", "powersave\n"),
        ("sys/devices/system/cpu/cpufreq/policy1/scaling_governor", "performance\n"),
        ("sys/devices/system/cpu/cpufreq/policy2/scaling_governor", "powersave\n"),
        ("sys/devices/system/cpu/isolated", "3\n"),
        ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
        ("proc/sys/kernel/sched_rt_period_us", "1000000\n"),
    ]);
    let some = |text: &str| Some(text.to_owned());
    let expected = Environment {
        kernel: some("6.18.44"),
        preempt: some("full"),
        cpus: 5,
        hypervisor: some("kvm"),
        clocksource: some("tsc"),
        clock_read_ns: None,
        governor: some("performance,powersave"),
        isolated_cpus: "3".to_owned(),
        rt_throttling: "950000/1000000".parse().ok(),
        rt_throttling_applies: None,
    };
    assert_eq!(environment, expected);
}

#[test]
fn a_machine_that_shows_nothing_is_all_unknown() {
    assert_eq!(environment(&[]), Environment::default());
}

#[test]
fn preemption_is_taken_from_the_best_source_there_is() {
    let version = ("proc/version", "Linux version 6.1 (gcc 13) #1 SMP PREEMPT_DYNAMIC @0");
    let rt = ("proc/version", "Linux version 6.1 (gcc 13) #1 SMP PREEMPT_RT Thu");
    let silent = ("proc/version", "Linux version 6.1 (gcc 13) #1 SMP Thu");
    let cases: [(&[File], Option<&str>); 6] = [
        (&[version], Some("dynamic")),
        (&[version, ("proc/cmdline", "quiet preempt=lazy ro\n")], Some("lazy")),
        (&[version, ("proc/cmdline", "quiet ro\n")], Some("dynamic")),
        (&[rt], Some("rt")),
        (&[silent, ("sys/kernel/realtime", "1\n")], Some("rt")),
        (&[silent], None),
    ];
    for (files, expected) in cases {
        assert_eq!(environment(files).preempt.as_deref(), expected, "{files:?}");
    }
}

#[test]
fn a_hypervisor_is_named_as_well_as_it_shows_itself() {
    let flag = ("proc/cpuinfo", "flags\t\t: fpu hypervisor\n");
    let vendor = ("sys/class/dmi/id/sys_vendor", "VMware, Inc.\n");
    let cases: [(&[File], Option<&str>); 4] = [
        (&[("proc/cpuinfo", "flags\t\t: fpu\n"), vendor], None),
        (&[flag], Some("unknown")),
        (&[flag, vendor], Some("VMware, Inc.")),
        (&[("sys/hypervisor/type", "xen\n")], Some("xen")),
    ];
    for (files, expected) in cases {
        assert_eq!(environment(files).hypervisor.as_deref(), expected, "{files:?}");
    }
}

#[test]
fn this_machine_has_a_kernel_and_cpus_and_a_clock_that_takes_time_to_read() {
    let environment = Environment::read();
    assert!(environment.kernel.is_some());
    assert!(environment.cpus > 0);
    assert!(environment.clock_read_ns.is_some_and(|ns| ns < 1_000_000), "{environment:?}");
}

#[test]
fn a_fifo_thread_is_throttled_unless_the_kernel_says_otherwise() {
    let on = ("proc/sys/kernel/sched_rt_runtime_us", "950000\n");
    let off = ("proc/sys/kernel/sched_rt_runtime_us", "-1\n");
    let period = ("proc/sys/kernel/sched_rt_period_us", "1000000\n");
    let new = ("proc/sys/kernel/osrelease", "6.12.1\n");
    let old = ("proc/sys/kernel/osrelease", "6.6.30\n");
    let with_groups = ("boot/config-6.12.1", "CONFIG_RT_GROUP_SCHED=y\n");
    let without_groups = ("boot/config-6.12.1", "# CONFIG_RT_GROUP_SCHED is not set\n");
    let cases: [(&[File], bool); 6] = [
        (&[on, period, old], true),
        (&[on, period, new, with_groups], true),
        (&[on, period, new], true),
        (&[on, period, new, without_groups], false),
        (&[off, period, old], false),
        (&[], false),
    ];
    for (files, throttled) in cases {
        assert_eq!(environment(files).fifo_throttling().is_some(), throttled, "{files:?}");
    }
}
