//! The doctor, and the choice of a CPU, on machines made of files.

use std::io::Write;
use std::path::Path;

use crate::machines::{CONTAINER, Fake, File, GUEST, LAPTOP, METAL};
use Severity::{Note, Ok as Fine, Problem, Warning};
use isochrone_machine::{
    CheckResult, Examination, Machine, Mobility, NoSuchCpu, Severity, examine,
};
use serde_json::Value;

fn laptop() -> Fake {
    Fake::new(&[METAL, LAPTOP]).without("sys/kernel/debug")
}

#[track_caller]
fn codes(fake: &Fake, severity: Severity) -> Vec<String> {
    fake.examine().of(severity).map(|finding| finding.code.clone()).collect()
}

#[test]
fn a_machine_made_ready_is_all_ok() {
    let examination = Fake::new(&[METAL]).examine();
    let rest: Vec<_> = examination.findings.iter().filter(|f| f.severity != Fine).collect();
    assert!(rest.is_empty(), "{rest:#?}");
    assert_eq!((examination.cpu, examination.online_cpus.as_str()), (3, "0-3"));
}

#[test]
fn a_guest_as_root_has_warnings_that_can_be_fixed_and_notes_that_cannot() {
    let fake = Fake::new(&[GUEST]);
    assert_eq!(codes(&fake, Problem), [""; 0]);
    assert_eq!(codes(&fake, Warning), ["preemption", "isolated_cpus", "interrupts"]);
    let notes = codes(&fake, Note);
    for code in ["rt_throttling", "fair_server", "watchdog", "idle_states", "hypervisor", "steal"] {
        assert!(notes.iter().any(|note| note == code), "{code} in {notes:?}");
    }
}

#[test]
fn a_container_without_rights_has_the_problems_of_rights() {
    let fake = Fake::new(&[GUEST, CONTAINER]);
    assert_eq!(codes(&fake, Problem), ["real_time_priority", "cgroup_budget", "cpu_affinity"]);
    for (code, flag) in [
        ("real_time_priority", "--ulimit rtprio=89"),
        ("memory_lock", "--ulimit memlock=-1"),
        ("cpu_affinity", "--cpuset-cpus 0,1"),
    ] {
        let fix = fake.finding(code).fix.unwrap();
        assert!(fix.contains("container") && fix.contains(flag), "{fix}");
    }
    assert!(
        fake.finding("cgroup_budget").fix.unwrap().contains("/cpu/docker/4f/cpu.rt_runtime_us")
    );
}

#[test]
fn a_laptop_has_one_problem_and_many_warnings() {
    let fake = laptop();
    assert_eq!(codes(&fake, Problem), ["real_time_priority"]);
    assert_eq!(
        codes(&fake, Warning),
        [
            "memory_lock",
            "preemption",
            "isolated_cpus",
            "interrupts",
            "smt_sibling",
            "frequency_governor",
            "idle_states",
            "clock_source",
            "huge_pages",
            "swap"
        ]
    );
}

#[test]
fn a_machine_that_shows_nothing_is_unknown_and_not_guessed() {
    let fake = Fake::new(&[]);
    let examination = fake.examine();
    for finding in &examination.findings {
        // These two are seen by what is there, and their absence is an answer.
        if !["shared_memory", "container"].contains(&finding.code.as_str()) {
            assert_eq!(finding.severity, Note, "{finding:?}");
            assert!(finding.value.starts_with("unknown: "), "{finding:?}");
            assert!(!finding.inert, "{finding:?}");
        }
    }
    assert_eq!(codes(&fake, Problem), ["shared_memory"]);
}

/// What the kernel's idle driver for guests changes.
const HALTPOLL: &[File] = &[
    ("sys/devices/system/cpu/cpuidle/current_driver", "haltpoll\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/disable", "0\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/latency", "1\n"),
    ("sys/devices/system/cpu/cpu1/cpuidle/state1/name", "haltpoll idle\n"),
    ("sys/module/haltpoll/parameters/guest_halt_poll_ns", "0\n"),
];

/// A change to a machine, and what one check says of it.
struct Case(&'static [&'static [File]], &'static str, Severity, &'static str, Inert);
#[derive(Clone, Copy, PartialEq, Debug)]
enum Inert {
    Yes,
    No,
}
use Inert::{No, Yes};

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

/// A finding can be read by itself and pasted into a message.
#[track_caller]
fn assert_complete(finding: &CheckResult) {
    let texts = [&finding.value, &finding.source, &finding.effect];
    assert!(texts.iter().all(|text| !text.is_empty() && !text.contains('\n')), "{finding:#?}");
    assert!(finding.effect.ends_with('.'), "one sentence: {finding:#?}");
    assert!(!finding.effect.contains("  ") && !finding.value.contains("  "), "{finding:#?}");
    assert_eq!(finding.inert, finding.inert_why.is_some(), "{finding:#?}");
    assert!(
        finding.fix.as_ref().is_none_or(|fix| !fix.is_empty() && !fix.contains('\n')),
        "{finding:#?}"
    );
    assert!(finding.severity != Fine || finding.fix.is_none(), "nothing to do: {finding:#?}");
}

#[test]
fn every_finding_of_every_machine_is_complete_and_has_a_code_of_its_own() {
    let empty = Fake::new(&[]);
    for fake in
        [Fake::new(&[METAL]), Fake::new(&[GUEST]), Fake::new(&[GUEST, CONTAINER]), laptop(), empty]
    {
        let examination = fake.examine();
        examination.findings.iter().for_each(assert_complete);
        let mut codes: Vec<_> = examination.findings.iter().map(|finding| &finding.code).collect();
        codes.sort();
        codes.dedup();
        assert_eq!(codes.len(), examination.findings.len());
        for finding in &examination.findings {
            let has_way_out = finding.severity < Warning || finding.fix.is_some();
            assert!(has_way_out, "what is wrong and can be changed says how: {finding:#?}");
        }
    }
}

#[test]
fn interrupts_are_named_with_number_affinity_and_count_the_most_frequent_first() {
    let finding = Fake::new(&[GUEST]).finding("interrupts");
    assert_eq!(
        finding.details,
        [
            "38 virtio2-input.0, CPU 1, 4123 so far",
            "36 virtio1-req.0, CPU 1, 251 so far, managed by the kernel, to judge by its driver",
            "37 virtio2-config, CPU 1, 0 so far"
        ]
    );
    let fix = finding.fix.unwrap();
    assert!(
        fix.starts_with("for i in 38; do echo 0 > /proc/irq/$i/smp_affinity_list; done"),
        "{fix}"
    );
}

/// The interrupt of the guest's disk.
fn disk_is_managed(affinity: &Path) -> Mobility {
    if affinity.ends_with("proc/irq/36/smp_affinity_list") {
        Mobility::Managed
    } else {
        Mobility::Movable
    }
}

#[track_caller]
fn interrupts_of(machine: &Machine, cpu: usize) -> CheckResult {
    let findings = examine(machine, Some(cpu)).unwrap().findings;
    findings.into_iter().find(|finding| finding.code == "interrupts").unwrap()
}

#[test]
fn a_managed_interrupt_is_told_from_those_that_can_be_moved_and_answered_with_another_cpu() {
    let machine = Fake::new(&[GUEST]);
    let finding = interrupts_of(&machine.machine().with_mobility(disk_is_managed), 1);
    assert_eq!(finding.details[1], "36 virtio1-req.0, CPU 1, 251 so far, managed by the kernel");
    assert!(finding.value.contains("2 did since boot, 1 of them managed"), "{}", finding.value);
    let fix = finding.fix.unwrap();
    assert!(fix.starts_with("for i in 38; do echo 0 > "), "only what moves is moved: {fix}");
    assert!(fix.ends_with("cpu = \"auto\" or cpu = 0 in [[task]]"), "{fix}");
}

#[test]
fn a_managed_interrupt_on_the_best_cpu_takes_a_restart() {
    let fake = Fake::new(&[GUEST]);
    let fix = interrupts_of(&fake.machine().with_mobility(|_| Mobility::Managed), 0).fix.unwrap();
    assert_eq!(fix, "isolcpus=managed_irq,domain,0 on the kernel command line");
}

#[test]
fn the_cpu_that_auto_would_choose_is_examined_if_none_is_named() {
    let fake = Fake::new(&[GUEST]);
    let guest = fake.machine();
    let examination = examine(&guest, None).unwrap();
    assert_eq!(examination.cpu, 0, "the disk and the network interrupt the other");
    let quiet = |examination: &Examination| {
        examination.findings.iter().find(|finding| finding.code == "quiet_cpu").unwrap().clone()
    };
    let finding = quiet(&examination);
    assert_eq!(finding.severity, Fine);
    assert_eq!(
        finding.value,
        "CPU 0: devices have interrupted it 7 times since the machine started, and CPU 1 4374 times"
    );
    let other = quiet(&examine(&guest, Some(1)).unwrap());
    assert_eq!((other.severity, other.value), (Note, finding.value));
    assert_eq!(other.fix.unwrap(), "cpu = \"auto\" or cpu = 0 in [[task]]");
}

#[test]
fn a_fix_of_idle_states_names_the_states_of_this_cpu() {
    let finding = laptop().finding("idle_states");
    let file = "/sys/devices/system/cpu/cpu3/cpuidle/{state2,state10}/disable";
    assert!(finding.fix.unwrap().contains(file));
    assert_eq!(finding.details.len(), 4, "in the driver's order: {:?}", finding.details);
    assert_eq!(finding.details.last().unwrap(), "C10, exit latency 890 us");
}

#[test]
fn a_guest_is_told_what_polling_costs_and_not_to_do_it() {
    let fake = Fake::new(&[GUEST, HALTPOLL]);
    let finding = fake.finding("idle_states");
    assert!(finding.value.contains("halts without polling first"), "{finding:?}");
    for finding in
        [finding, fake.finding("cpu_dma_latency"), Fake::new(&[GUEST]).finding("idle_states")]
    {
        let fix = finding.fix.clone().unwrap_or_default();
        assert!(!fix.contains("cpu_dma_latency") && !fix.contains("idle=poll"), "{finding:?}");
        assert!(finding.inert || finding.effect.contains("ten times"), "{finding:?}");
    }
    let metal = laptop().finding("idle_states");
    assert!(metal.fix.unwrap().contains("hold 0 in /dev/cpu_dma_latency"));
    assert!(!metal.effect.contains("ten times"));
}

#[test]
fn where_it_is_not_sure_that_this_is_a_container_both_ways_out_are_told() {
    let files: &[File] =
        &[(".dockerenv", ""), ("proc/self/status", "CapEff:\t0\nCpus_allowed_list:\t0\n")];
    let fake = Fake::new(&[GUEST, files]);
    for (code, outside, inside) in [
        ("real_time_priority", "setcap", "--ulimit rtprio=89"),
        ("memory_lock", "setcap", "--ulimit memlock=-1"),
        ("cpu_affinity", "widen the cpuset", "--cpuset-cpus 0,1"),
    ] {
        let fix = fake.finding(code).fix.unwrap();
        assert!(fix.contains(outside) && fix.contains(inside), "{fix}");
    }
}

#[test]
fn a_fix_in_debugfs_says_to_mount_it_where_it_is_not() {
    let fix = |files: &[&[File]]| Fake::new(files).finding("preemption").fix.unwrap();
    assert!(fix(&[GUEST]).starts_with("mount -t debugfs"));
    let mounted: &[File] = &[("proc/mounts", "debugfs /sys/kernel/debug debugfs rw 0 0\n")];
    assert!(fix(&[GUEST, mounted]).starts_with("echo full > /sys/kernel/debug/sched/preempt"));
}

#[test]
fn threads_are_told_with_the_names_that_they_have() {
    assert_eq!(
        Fake::new(&[GUEST]).finding("real_time_threads").details,
        ["40 irq/25-a) b, fifo:50, kernel"]
    );
    assert_eq!(laptop().finding("real_time_threads").details, ["2213 pipewire, fifo:88"]);
}

#[test]
fn a_packed_kernel_configuration_is_read_and_a_broken_one_is_unknown() {
    let fake = Fake::new(&[GUEST]).without("boot");
    assert!(fake.finding("timer_tick").value.starts_with("unknown"));
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(b"CONFIG_HZ=300\nCONFIG_HIGH_RES_TIMERS=y\nCONFIG_PREEMPT_LAZY=y\n").unwrap();
    let packed = packed.finish().unwrap();
    fake.write("proc/config.gz", &packed);
    assert!(fake.finding("timer_tick").value.starts_with("300 Hz"));
    assert!(fake.finding("preemption").value.starts_with("lazy"));
    fake.write("proc/config.gz", &packed[..packed.len() / 2]);
    assert!(fake.finding("timer_tick").value.starts_with("unknown"));
    assert!(fake.finding("preemption").value.starts_with("unknown"));
}

#[test]
fn shared_memory_is_judged_by_what_is_free() {
    let fake = Fake::new(&[METAL]);
    let judge = |free: fn(&std::path::Path) -> Option<u64>| {
        let examination = examine(&fake.machine().with_free_bytes(free), None).unwrap();
        let finding = examination.findings.into_iter().find(|f| f.code == "shared_memory").unwrap();
        (finding.severity, finding.value)
    };
    assert_eq!(judge(|_| Some(64 << 20)), (Fine, "64 MiB free".to_owned()));
    assert_eq!(judge(|_| Some(2 << 20)), (Warning, "2 MiB free".to_owned()));
    assert_eq!(judge(|_| Some(4096)), (Problem, "4 KiB free".to_owned()));
    assert_eq!(judge(|_| None).0, Note);
}

#[test]
fn a_cpu_that_is_not_there_is_refused_with_those_that_are() {
    let error = NoSuchCpu { cpu: 9999, online: "0-1".to_owned() };
    let fake = Fake::new(&[GUEST]);
    assert_eq!(examine(&fake.machine(), Some(9999)), Err(error.clone()));
    assert_eq!(error.to_string(), "CPU 9999 does not exist or is offline; this machine has 0-1");
    assert_eq!(examine(&fake.machine(), Some(0)).unwrap().cpu, 0);
}

#[test]
fn the_document_has_every_part_of_a_finding_and_reads_back() {
    let examination = Fake::new(&[GUEST]).examine();
    let json = serde_json::to_value(&examination).unwrap();
    assert_eq!(json["cpu"], 1);
    assert_eq!(json["environment"]["kernel"], "6.18.44");
    let findings = json["findings"].as_array().unwrap();
    for finding in findings {
        let keys: Vec<_> = finding.as_object().unwrap().keys().map(String::as_str).collect();
        let all = [
            "code",
            "severity",
            "value",
            "details",
            "source",
            "effect",
            "fix",
            "inert",
            "inert_why",
        ];
        assert_eq!(keys, all);
        let severity = finding["severity"].as_str().unwrap();
        assert!(["ok", "note", "warning", "problem"].contains(&severity), "{severity}");
    }
    let tick = findings.iter().find(|finding| finding["code"] == "timer_tick").unwrap();
    assert_eq!(
        (&tick["fix"], &tick["inert"], &tick["inert_why"]),
        (&Value::Null, &Value::Bool(false), &Value::Null)
    );
    assert_eq!(
        serde_json::from_value::<isochrone_machine::Examination>(json).unwrap(),
        examination
    );
}
