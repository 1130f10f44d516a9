use super::*;
use crate::realtime::os::Limit;
use crate::realtime::simulated_os::{SimulatedOs, cpus};
use crate::usage::thread_usage;

const BOTH: ThreadRequest = ThreadRequest { priority: Some(80), cpu: Pinning::Named(1) };
const PRIORITY: ThreadRequest = ThreadRequest { priority: Some(80), cpu: Pinning::Any };

/// The file of a group's budget.
const BOX: &str = "/sys/fs/cgroup/cpu/box/cpu.rt_runtime_us";

fn privileged() -> SimulatedOs {
    SimulatedOs { can_set_priority: true, ..SimulatedOs::default() }
}

fn only_refusal(os: &SimulatedOs, request: ThreadRequest) -> GrantRefusal {
    let mut grant = prepare(os, request);
    assert_eq!(grant.refusals.len(), 1, "{grant:?}");
    let refusal = grant.refusals.remove(0);
    assert!(!refusal.remedy().is_empty(), "{refusal}");
    assert!(
        ![&refusal.to_string(), refusal.remedy()].iter().any(|text| text.contains('\n')),
        "{refusal}"
    );
    refusal
}

#[test]
fn a_privileged_thread_gets_its_priority_and_its_cpu() {
    let os = privileged();
    let grant = prepare(&os, BOTH);
    assert_eq!(grant.scheduler, "fifo:80");
    assert_eq!(grant.cpu, Some(1));
    assert_eq!(grant.refusals, []);
    assert_eq!(os.calls(), ["set_timer_slack_ns", "block_signals", "set_affinity", "set_fifo"]);
}

#[test]
fn a_thread_that_asks_for_nothing_keeps_scheduler_and_affinity() {
    let grant = prepare(&privileged(), ThreadRequest::default());
    assert_eq!(grant, ThreadGrant { scheduler: "other".to_owned(), cpu: None, refusals: vec![] });
}

#[test]
fn without_right_the_refusal_names_capability_and_limit() {
    let refusal = only_refusal(&SimulatedOs::default(), PRIORITY);
    assert_eq!(refusal.code(), "rt_denied");
    let message = refusal.to_string();
    assert!(message.contains("CAP_SYS_NICE") && message.contains("RLIMIT_RTPRIO is 0"));
    assert!(refusal.remedy().contains("setcap") && refusal.remedy().contains("rtprio 89"));
}

#[test]
fn a_refused_priority_is_reported_as_the_scheduler_that_is_left() {
    assert_eq!(prepare(&SimulatedOs::default(), PRIORITY).scheduler, "other");
}

#[test]
fn a_sufficient_hard_limit_is_raised_to_and_used() {
    let os = SimulatedOs::default().rtprio(Limit { soft: 0, hard: 89 });
    assert_eq!(prepare(&os, PRIORITY).scheduler, "fifo:80");
    assert!(os.calls().contains(&"raise_priority_limit"));
}

#[test]
fn a_group_without_budget_is_named() {
    let os = SimulatedOs {
        set_fifo_errno: Some(libc::EPERM),
        group_budget: Some(GroupBudget::Budget { file: BOX.to_owned(), runtime_us: 0 }),
        ..privileged()
    };
    let refusal = only_refusal(&os, PRIORITY);
    assert_eq!(refusal.code(), "rt_denied");
    assert!(refusal.to_string().contains(BOX) && refusal.remedy().contains(BOX));
}

#[test]
fn a_privileged_thread_that_is_refused_all_the_same_learns_of_containers() {
    let os = SimulatedOs {
        set_fifo_errno: Some(libc::EPERM),
        group_budget: Some(GroupBudget::Budget { file: BOX.to_owned(), runtime_us: 950_000 }),
        ..privileged()
    };
    let refusal = only_refusal(&os, PRIORITY);
    assert_eq!(refusal.code(), "rt_denied");
    assert!(refusal.to_string().contains("Operation not permitted"));
    assert!(refusal.to_string().contains("seccomp"));
}

#[test]
fn a_priority_outside_1_to_89_is_refused_without_asking_the_kernel() {
    for priority in [0, 90, 255] {
        let os = privileged();
        let request = ThreadRequest { priority: Some(priority), cpu: Pinning::Any };
        let refusal = only_refusal(&os, request);
        assert_eq!(refusal.code(), "rt_denied");
        let outside = format!("no real-time priority: {priority} is outside 1..=89");
        assert_eq!(refusal.to_string(), outside);
        assert!(!os.calls().contains(&"set_fifo"));
    }
}

#[test]
fn a_cpu_that_does_not_exist_is_refused_with_those_that_do() {
    let request = ThreadRequest { priority: None, cpu: Pinning::Named(7) };
    let os = SimulatedOs::default();
    let refusal = only_refusal(&os, request);
    assert_eq!(refusal.code(), "cpu_denied");
    assert!(refusal.to_string().ends_with("this machine has 0-1"));
    assert!(!os.calls().contains(&"set_affinity"));
}

#[test]
fn a_cpu_outside_the_cpuset_is_refused_with_the_kernels_reason() {
    let os = SimulatedOs { affinity_errno: Some(libc::EINVAL), ..SimulatedOs::default() };
    let request = ThreadRequest { priority: None, cpu: Pinning::Named(1) };
    let refusal = only_refusal(&os, request);
    assert_eq!(refusal.code(), "cpu_denied");
    assert!(refusal.to_string().contains("cpuset"));
    assert_eq!(prepare(&os, request).cpu, None);
}

#[test]
fn a_cpu_number_beyond_any_cpu_set_is_refused_and_no_panic() {
    let error = pin(&Linux, usize::MAX).unwrap_err();
    assert_eq!(error.code(), "cpu_denied");
    assert_eq!(only_cpu(&cpus(&[CpuSet::MAX_CPU - 1])), Some(CpuSet::MAX_CPU - 1));
}

#[test]
fn a_thread_is_pinned_if_it_has_one_cpu() {
    assert_eq!(only_cpu(&cpus(&[3])), Some(3));
    assert_eq!(only_cpu(&cpus(&[0, 1])), None);
    assert_eq!(only_cpu(&cpus(&[])), None);
}

#[test]
fn a_chosen_cpu_is_kept_with_the_priority_and_given_up_without_it() {
    let request = ThreadRequest { cpu: Pinning::Chosen(1), ..BOTH };
    assert_eq!(prepare(&privileged(), request).cpu, Some(1));
    let refused = SimulatedOs::default();
    let grant = prepare(&refused, request);
    assert_eq!((grant.cpu, grant.refusals.len()), (None, 1), "{grant:?}");
    assert_eq!(refused.affinity.get(), cpus(&[0, 1]), "it may move where it could before");
    let without = ThreadRequest { priority: None, cpu: Pinning::Chosen(1) };
    assert_eq!(prepare(&SimulatedOs::default(), without).cpu, Some(1), "nothing was refused");
}

#[test]
fn a_cpu_that_is_named_is_kept_without_the_priority_too() {
    assert_eq!(prepare(&SimulatedOs::default(), BOTH).cpu, Some(1));
}

#[test]
fn all_refusals_are_reported_together() {
    let request = ThreadRequest { priority: Some(80), cpu: Pinning::Named(7) };
    let codes: Vec<_> =
        prepare(&SimulatedOs::default(), request).refusals.iter().map(GrantRefusal::code).collect();
    assert_eq!(codes, ["cpu_denied", "rt_denied"]);
}

#[test]
fn a_prefaulted_stack_takes_no_more_faults() {
    #[inline(never)]
    fn use_half_the_stack() {
        let mut stack = [1u8; PREFAULTED_STACK_BYTES / 2];
        black_box(&mut stack);
    }
    std::thread::spawn(|| {
        prefault_stack();
        let before = thread_usage().minor_faults;
        use_half_the_stack();
        assert!(thread_usage().minor_faults - before <= 2, "32 pages would fault otherwise");
    })
    .join()
    .unwrap();
}

#[test]
fn the_real_system_grants_or_explains() {
    let grant = std::thread::spawn(|| prepare_thread(BOTH)).join().unwrap();
    let refused_priority = grant.refusals.iter().any(|refusal| refusal.code() == "rt_denied");
    let refused_cpu = grant.refusals.iter().any(|refusal| refusal.code() == "cpu_denied");
    assert_eq!(grant.scheduler == "fifo:80", !refused_priority, "{grant:?}");
    assert_eq!(grant.cpu == Some(1), !refused_cpu, "{grant:?}");
}

#[test]
fn a_real_thread_without_right_is_told_so_by_the_kernel() {
    use rustix::thread::{CapabilitySet, capabilities, set_capabilities};
    std::thread::spawn(|| {
        // Capabilities belong to the thread: the test may run as root or not.
        let mut sets = capabilities(None).unwrap();
        sets.effective = CapabilitySet::empty();
        set_capabilities(None, sets).unwrap();
        let limit = Linux.priority_limit().hard;
        if limit < 80 {
            let grant = prepare_thread(PRIORITY);
            let refusals: Vec<_> = grant.refusals.iter().map(GrantRefusal::to_string).collect();
            let missing = format!("CAP_SYS_NICE is missing and RLIMIT_RTPRIO is {limit}");
            assert_eq!(refusals, [format!("no real-time priority 80: {missing}")]);
        }
    })
    .join()
    .unwrap();
}

#[test]
fn a_thread_that_returns_its_priority_is_scheduled_as_any_other() {
    std::thread::spawn(|| {
        let returns = PriorityReturn::default();
        // Without the right to a priority there is none to return, and nothing goes wrong either.
        let _ = prepare_thread(PRIORITY);
        drop(returns);
        assert_eq!(Linux.scheduler(), Scheduler::Other);
    })
    .join()
    .unwrap();
}
