//! Once per real-time thread: stack, timer slack, signals, CPU, priority.

use std::fmt;
use std::hint::black_box;
use std::io;
use std::marker::PhantomData;
use std::num::NonZeroU64;
use std::ops::RangeInclusive;

use isochrone_machine::GroupBudget;
use rustix::thread::CpuSet;

use super::os::{Linux, Os, Scheduler};
use super::refusal::GrantRefusal;

/// How much stack [`prepare_thread`] touches, in bytes. The thread needs twice as much; threads of
/// Rust's standard library have 2 MiB.
pub const PREFAULTED_STACK_BYTES: usize = 256 * 1024;

/// Priorities above 89 belong to the kernel's own threads (watchdog, migration).
const PRIORITIES: RangeInclusive<u8> = 1..=89;
const TIMER_SLACK_NS: NonZeroU64 = NonZeroU64::MIN;

/// What a thread asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ThreadRequest {
    /// `SCHED_FIFO` priority 1..=89; `None` leaves the scheduler as it is.
    pub priority: Option<u8>,
    /// Where to run.
    pub cpu: Pinning,
}

/// The one CPU that a thread asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Pinning {
    /// None: the affinity stays as it is.
    #[default]
    Any,
    /// This one, whatever else is refused.
    Named(usize),
    /// This one, which was chosen for a thread with a priority. If the priority is refused, the affinity stays
    /// as it is: an ordinary thread that may not move waits behind every other one on its CPU.
    Chosen(usize),
}

impl Pinning {
    /// The CPU.
    pub const fn cpu(self) -> Option<usize> {
        match self {
            Self::Any => None,
            Self::Named(cpu) | Self::Chosen(cpu) => Some(cpu),
        }
    }
}

/// What the kernel says the thread has now.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ThreadGrant {
    /// The scheduler: `other`, `fifo:80`, `rr:10`, `deadline`, `batch` or `idle`.
    pub scheduler: String,
    /// The CPU the thread is pinned to, `None` if it may move.
    pub cpu: Option<usize>,
    /// What was refused.
    pub refusals: Vec<GrantRefusal>,
}

/// Prepares the calling thread for real-time work; call it last before the loop.
///
/// Touches the stack, sets the timer slack to 1 ns, blocks all signals except those for its own
/// faults (so another thread must handle SIGTERM), pins the CPU and sets the priority. A CPU that was
/// [chosen](Pinning::Chosen) is given up where the priority is refused. A thread spawned afterwards
/// inherits all but the stack.
pub fn prepare_thread(request: ThreadRequest) -> ThreadGrant {
    prefault_stack();
    prepare(&Linux, request)
}

fn prepare(os: &impl Os, request: ThreadRequest) -> ThreadGrant {
    os.set_timer_slack_ns(TIMER_SLACK_NS);
    os.block_signals();
    // Pinned first: from the moment the thread has its priority it must not disturb other CPUs.
    let before = os.affinity();
    let pinned = request.cpu.cpu().map_or(Ok(()), |cpu| pin(os, cpu));
    let raised = request.priority.map_or(Ok(()), |priority| set_priority(os, priority));
    if let (Pinning::Chosen(_), Ok(before), Err(_)) = (request.cpu, before, &raised) {
        // The kernel allowed it a moment ago.
        let _ = os.set_affinity(&before);
    }
    ThreadGrant {
        scheduler: os.scheduler().to_string(),
        cpu: os.affinity().ok().and_then(|cpus| only_cpu(&cpus)),
        refusals: [pinned, raised].into_iter().filter_map(Result::err).collect(),
    }
}

/// Gives the calling thread's priority back when it is dropped.
#[derive(Debug, Default)]
pub(super) struct PriorityReturn {
    /// Each thread has its own priority.
    of_this_thread: PhantomData<*const ()>,
}

impl Drop for PriorityReturn {
    fn drop(&mut self) {
        Linux.set_other();
    }
}

fn pin(os: &impl Os, cpu: usize) -> Result<(), GrantRefusal> {
    // Where the list cannot be read, the kernel decides.
    if let Some(online) =
        os.online_cpus().filter(|online| !online.is_empty() && !online.contains(cpu))
    {
        let message = format!(
            "not pinned: CPU {cpu} does not exist or is offline; this machine has {online}"
        );
        return Err(GrantRefusal::of_cpu(
            message,
            format!("set the task's `cpu` to one of {online}"),
        ));
    }
    let excluded = |error: io::Error| {
        let message =
            format!("not pinned: the kernel refused CPU {cpu} ({error}); a cpuset may exclude it");
        let remedy = "choose a CPU of this process's cpuset (Cpus_allowed_list in /proc/self/status), \
                      or widen the cpuset";
        GrantRefusal::of_cpu(message, remedy)
    };
    if cpu >= CpuSet::MAX_CPU {
        return Err(excluded(io::ErrorKind::InvalidInput.into()));
    }
    let mut cpus = CpuSet::new();
    cpus.set(cpu);
    os.set_affinity(&cpus).map_err(excluded)
}

/// The CPU of a set of one.
fn only_cpu(cpus: &CpuSet) -> Option<usize> {
    let first = (0..CpuSet::MAX_CPU).find(|&cpu| cpus.is_set(cpu));
    first.filter(|_| cpus.count() == 1)
}

fn set_priority(os: &impl Os, priority: u8) -> Result<(), GrantRefusal> {
    if !PRIORITIES.contains(&priority) {
        let message = format!("no real-time priority: {priority} is outside 1..=89");
        return Err(GrantRefusal::of_priority(message, "set the task's `priority` to 1..=89"));
    }
    let limit = os.priority_limit();
    let wanted = u64::from(priority);
    let privileged = os.can_set_priority();
    if !privileged && limit.soft < wanted && wanted <= limit.hard {
        os.raise_priority_limit();
    }
    os.set_fifo(priority).map_err(|error| {
        if !privileged && limit.hard < wanted {
            let message = format!(
                "no real-time priority {priority}: CAP_SYS_NICE is missing and RLIMIT_RTPRIO is {}",
                limit.hard
            );
            let remedy = "run as root, or `sudo setcap cap_ipc_lock,cap_sys_nice+ep` the program, or \
                          set `rtprio 89` for this user in /etc/security/limits.conf";
            return GrantRefusal::of_priority(message, remedy);
        }
        match os.group_budget() {
            Some(GroupBudget::Budget { file, runtime_us: 0 }) => {
                let message = format!(
                    "no real-time priority {priority}: this thread's control group has no real-time \
                     budget (RT_GROUP_SCHED): {file} is 0"
                );
                let remedy = format!(
                    "give the group a budget: `echo 900000 > {file}`, or start from the root group"
                );
                GrantRefusal::of_priority(message, remedy)
            }
            _ => {
                let message = format!(
                    "no real-time priority {priority}: the kernel refused ({error}) although this \
                     process has the right; a container's user namespace or seccomp filter may \
                     forbid it"
                );
                let remedy = "allow it in the container: `--cap-add SYS_NICE --ulimit rtprio=89`, or \
                              run outside";
                GrantRefusal::of_priority(message, remedy)
            }
        }
    })
}

/// Makes the kernel map the stack now, so that no cycle takes the page faults.
#[inline(never)]
fn prefault_stack() {
    let mut stack = [0u8; PREFAULTED_STACK_BYTES];
    black_box(&mut stack);
}

impl fmt::Display for Scheduler {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fifo(priority) => write!(f, "fifo:{priority}"),
            Self::RoundRobin(priority) => write!(f, "rr:{priority}"),
            Self::Deadline => f.write_str("deadline"),
            Self::Batch => f.write_str("batch"),
            Self::Idle => f.write_str("idle"),
            Self::Other => f.write_str("other"),
        }
    }
}

#[cfg(test)]
#[path = "thread_tests.rs"]
mod tests;
