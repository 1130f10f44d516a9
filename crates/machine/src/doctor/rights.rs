//! Checks of what this process may do: priorities, budgets, CPUs, memory, files.

use super::verdict::Verdict;
use crate::machine::{Capability, GroupBudget, Limit, Machine};

/// The highest priority that a task may ask for.
const HIGHEST_PRIORITY: u64 = 89;
/// The default of most systems, and room for hundreds of services.
const ENOUGH_FILES: u64 = 1024;

const STATUS_AND_LIMITS: &str = "/proc/self/status, /proc/self/limits";

pub(super) fn real_time_priority(machine: &Machine, _cpu: usize) -> Verdict {
    let capable = machine.capability(Capability::SysNice);
    let limit = machine.limit("Max realtime priority");
    let effect = "Without SCHED_FIFO any other program on the CPU may run before the task, for as long \
        as the fair scheduler allows.";
    let held = "SCHED_FIFO is allowed at every priority that a task may ask for.";
    let denied = if machine.is_in_user_namespace() {
        "CAP_SYS_NICE does not count (user namespace)"
    } else {
        "CAP_SYS_NICE is missing"
    };
    let fix = rights_fix(machine, "rtprio 89", "--cap-add SYS_NICE --ulimit rtprio=89");
    match (capable, limit) {
        (Some(true), limit) => Verdict::ok("CAP_SYS_NICE").effect(held).inert(format!(
            "the capability overrides RLIMIT_RTPRIO ({})",
            limit.map_or("unknown".to_owned(), |limit| amount(limit.hard)),
        )),
        (_, Some(Limit { hard, .. })) if hard >= HIGHEST_PRIORITY => {
            Verdict::ok(format!("RLIMIT_RTPRIO {}", amount(hard))).effect(held)
        }
        (Some(false), Some(Limit { hard: 0, .. })) => {
            Verdict::problem(format!("none: {denied} and RLIMIT_RTPRIO is 0"))
                .effect(effect)
                .fix(fix)
        }
        (Some(false), Some(Limit { hard, .. })) => {
            Verdict::note(format!("up to {hard} (RLIMIT_RTPRIO); {denied}"))
                .effect("A task that asks for a higher priority runs without real-time scheduling.")
                .fix(fix)
        }
        (None, _) | (_, None) => Verdict::unknown("rights cannot be read").effect(effect),
    }
    .from(STATUS_AND_LIMITS)
}

pub(super) fn cgroup_budget(machine: &Machine, _cpu: usize) -> Verdict {
    let refused = "The kernel refuses SCHED_FIFO to every process of this control group.";
    let granted = "The control group does not prevent SCHED_FIFO.";
    let is_throttled = machine.throttling().is_none_or(|throttling| !throttling.is_off());
    // Without the global limit the kernel ignores those of groups.
    let off = "/proc/sys/kernel/sched_rt_runtime_us is -1: the kernel ignores group budgets";
    let groups = "/proc/self/cgroup";
    match machine.group_budget() {
        None => Verdict::unknown("this process's control group cannot be read")
            .effect(refused)
            .from(groups),
        Some(GroupBudget::Budget { file, runtime_us: 0 }) if is_throttled => {
            Verdict::problem("0 us: this control group has no real-time budget")
                .effect(refused)
                .fix(format!("echo 900000 > {file}  # or start from the root group"))
                .from(file)
        }
        Some(GroupBudget::Budget { file, runtime_us }) => {
            let verdict =
                Verdict::ok(format!("{runtime_us} us (cgroup v1, RT_GROUP_SCHED)")).effect(granted);
            let verdict = if is_throttled { verdict } else { verdict.inert(off) };
            verdict.from(file)
        }
        Some(GroupBudget::NoBudgets) => {
            Verdict::ok("none needed (kernel without RT_GROUP_SCHED)").effect(granted).from(groups)
        }
        Some(GroupBudget::Ungoverned { group }) => {
            Verdict::ok(format!("none needed ({group}, cgroup v2, no cpu controller)"))
                .effect(granted)
                .from(groups)
        }
        Some(GroupBudget::Governed { group }) => {
            let verdict = match machine.group_scheduling() {
                Some(true) if is_throttled => Verdict::problem(format!(
                    "none possible: {group}, cgroup v2 with RT_GROUP_SCHED"
                ))
                .effect(refused)
                .fix("sysctl -w kernel.sched_rt_runtime_us=-1  # or start from the root group"),
                Some(true) => {
                    Verdict::ok(format!("none: {group}, cgroup v2")).effect(granted).inert(off)
                }
                Some(false) => Verdict::ok(format!("none needed ({group}, cgroup v2)"))
                    .effect(granted)
                    .inert("cgroup v2 has no real-time budget, and this kernel requires none"),
                None => Verdict::note(format!(
                    "none: {group}, cgroup v2; whether the kernel requires one is unknown"
                ))
                .effect("A kernel with RT_GROUP_SCHED refuses SCHED_FIFO to this control group."),
            };
            verdict.from(groups)
        }
    }
}

pub(super) fn cpu_affinity(machine: &Machine, cpu: usize) -> Verdict {
    let effect = "A task whose `cpu` is not in this list is not pinned, and moves between CPUs.";
    match machine.allowed() {
        None => Verdict::unknown("the CPUs that this process may use cannot be read").effect(effect),
        Some(allowed) if allowed.contains(cpu) => Verdict::ok(format!("CPUs {allowed}")).effect(effect),
        Some(allowed) => Verdict::problem(format!("CPUs {allowed}: CPU {cpu} is excluded"))
            .effect(effect)
            .fix(machine.container().fix(
                &format!("start the container with --cpuset-cpus {allowed},{cpu}"),
                &format!("widen the cpuset, `taskset -c {allowed},{cpu}`, or set the task's `cpu` to one of {allowed}"),
            )),
    }
    .from("/proc/self/status")
}

pub(super) fn memory_lock(machine: &Machine, _cpu: usize) -> Verdict {
    let capable = machine.capability(Capability::IpcLock);
    let limit = machine.limit("Max locked memory");
    let locked = "Memory can be locked, so that no page of the loop is paged out.";
    let effect =
        "Memory cannot be locked, so a cycle may wait for a page that the kernel reclaimed.";
    let fix = rights_fix(machine, "memlock unlimited", "--cap-add IPC_LOCK --ulimit memlock=-1");
    match (capable, limit) {
        (Some(true), limit) => Verdict::ok("CAP_IPC_LOCK").effect(locked).inert(format!(
            "the capability overrides RLIMIT_MEMLOCK ({})",
            limit.map_or("unknown".to_owned(), |limit| bytes(limit.hard)),
        )),
        (_, Some(Limit { hard: u64::MAX, .. })) => {
            Verdict::ok("RLIMIT_MEMLOCK unlimited").effect(locked)
        }
        (Some(false), Some(limit)) => Verdict::warning(format!(
            "no: CAP_IPC_LOCK is missing and RLIMIT_MEMLOCK is {}",
            bytes(limit.hard)
        ))
        .effect(effect)
        .fix(fix),
        (None, _) | (_, None) => Verdict::unknown("rights cannot be read").effect(effect),
    }
    .from(STATUS_AND_LIMITS)
}

pub(super) fn nice_limit(machine: &Machine, _cpu: usize) -> Verdict {
    let effect = "It matters only to threads without real-time priority.";
    match machine.limit("Max nice priority") {
        None => Verdict::unknown("the limit cannot be read").effect(effect),
        Some(limit) => Verdict::ok(format!("RLIMIT_NICE {}", amount(limit.hard)))
            .effect(effect)
            .inert("a SCHED_FIFO thread has no nice value"),
    }
    .from("/proc/self/limits")
}

pub(super) fn open_files(machine: &Machine, _cpu: usize) -> Verdict {
    let effect = "Each service and connection takes file descriptors. When they run out, further peers \
        cannot connect; no cycle is delayed.";
    match machine.limit("Max open files") {
        None => Verdict::unknown("the limit cannot be read"),
        Some(limit) if limit.soft >= ENOUGH_FILES => Verdict::ok(amount(limit.soft)),
        Some(limit) => {
            Verdict::note(amount(limit.soft)).fix(format!("ulimit -n {}", limit.hard.min(65_536)))
        }
    }
    .effect(effect)
    .from("/proc/self/limits")
}

/// How to get a right: inside a container it is the container that must be started with it.
fn rights_fix(machine: &Machine, limit: &str, container: &str) -> String {
    machine.container().fix(
        &format!("start the container with {container}"),
        &format!(
            "setcap cap_ipc_lock,cap_sys_nice+ep \"$(command -v isochrone)\"  # or `{limit}` for this user in /etc/security/limits.conf"
        ),
    )
}

fn amount(number: u64) -> String {
    if number == u64::MAX { "unlimited".to_owned() } else { number.to_string() }
}

fn bytes(number: u64) -> String {
    match number {
        u64::MAX => "unlimited".to_owned(),
        number if number >= 1 << 20 => format!("{} MiB", number >> 20),
        number => format!("{} KiB", number >> 10),
    }
}
