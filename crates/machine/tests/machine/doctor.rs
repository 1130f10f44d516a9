//! The doctor, and the choice of a CPU, on machines made of files.

use std::io::Write;
use std::path::Path;

use crate::machines::{CONTAINER, Fake, File, GUEST, HALTPOLL, LAPTOP, METAL};
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

/// A finding can be read by itself and pasted into a message.
#[track_caller]
pub(crate) fn assert_complete(finding: &CheckResult) {
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
