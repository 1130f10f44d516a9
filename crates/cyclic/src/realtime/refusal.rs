//! What the system refused: the reason, and the way out.

use thiserror::Error;

/// Something the set-up asked for and did not get. The loop runs without it, less punctually.
///
/// `Display` is the message, naming the reason.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum GrantRefusal {
    /// Memory was not locked: with a finite limit, locking future mappings too would make the
    /// process fail as soon as it grows past that limit.
    #[error(
        "memory is not locked: CAP_IPC_LOCK is missing and RLIMIT_MEMLOCK is {limit_bytes} bytes"
    )]
    MemoryLimit {
        /// The hard `RLIMIT_MEMLOCK`, in bytes.
        limit_bytes: u64,
    },
    /// The kernel refused to lock memory, though limit or privilege should have sufficed.
    #[error("memory is not locked: the kernel refused mlockall ({reason})")]
    MemoryLock {
        /// The kernel's error.
        reason: String,
    },
    /// The CPU to pin to does not exist or is offline.
    #[error("not pinned: CPU {cpu} does not exist or is offline; this machine has {online}")]
    NoSuchCpu {
        /// The CPU asked for.
        cpu: usize,
        /// Those there are, as the kernel lists them: `0-3,8`.
        online: String,
    },
    /// The CPU exists, but this process may not use it.
    #[error("not pinned: the kernel refused CPU {cpu} ({reason}); a cpuset may exclude it")]
    CpuExcluded {
        /// The CPU asked for.
        cpu: usize,
        /// The kernel's error.
        reason: String,
    },
    /// The priority is not one that a task may have.
    #[error("no real-time priority: {priority} is outside 1..=89")]
    PriorityRange {
        /// The priority asked for.
        priority: u8,
    },
    /// Neither capability nor limit allows the priority.
    #[error(
        "no real-time priority {priority}: CAP_SYS_NICE is missing and RLIMIT_RTPRIO is {limit}"
    )]
    NoPriorityRight {
        /// The priority asked for.
        priority: u8,
        /// The hard `RLIMIT_RTPRIO`.
        limit: u64,
    },
    /// The kernel has `RT_GROUP_SCHED`, and this control group has no real-time budget.
    #[error(
        "no real-time priority {priority}: this thread's control group has no real-time budget \
         (RT_GROUP_SCHED): {file} is 0"
    )]
    NoGroupBudget {
        /// The priority asked for.
        priority: u8,
        /// The file that holds the group's budget, `cpu.rt_runtime_us`.
        file: String,
    },
    /// The kernel refused though this process has the right, as in a container.
    #[error(
        "no real-time priority {priority}: the kernel refused ({reason}) although this process \
         has the right; a container's user namespace or seccomp filter may forbid it"
    )]
    PriorityRefused {
        /// The priority asked for.
        priority: u8,
        /// The kernel's error.
        reason: String,
    },
}

impl GrantRefusal {
    /// Stable code for reports: `lock_denied`, `cpu_denied` or `rt_denied`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::MemoryLimit { .. } | Self::MemoryLock { .. } => "lock_denied",
            Self::NoSuchCpu { .. } | Self::CpuExcluded { .. } => "cpu_denied",
            Self::PriorityRange { .. }
            | Self::NoPriorityRight { .. }
            | Self::NoGroupBudget { .. }
            | Self::PriorityRefused { .. } => "rt_denied",
        }
    }

    /// What to do about it, in one line.
    pub fn remedy(&self) -> String {
        match self {
            Self::MemoryLimit { .. } => {
                "run as root, or `sudo setcap cap_ipc_lock,cap_sys_nice+ep` the program, or set \
                 `memlock unlimited` for this user in /etc/security/limits.conf"
                    .to_owned()
            }
            Self::MemoryLock { .. } => {
                "free memory, or grant CAP_IPC_LOCK to the program or its container".to_owned()
            }
            Self::NoSuchCpu { online, .. } => format!("set the task's `cpu` to one of {online}"),
            Self::CpuExcluded { .. } => {
                "choose a CPU of this process's cpuset (Cpus_allowed_list in /proc/self/status), \
                 or widen the cpuset"
                    .to_owned()
            }
            Self::PriorityRange { .. } => "set the task's `priority` to 1..=89".to_owned(),
            Self::NoPriorityRight { .. } => {
                "run as root, or `sudo setcap cap_ipc_lock,cap_sys_nice+ep` the program, or set \
                 `rtprio 89` for this user in /etc/security/limits.conf"
                    .to_owned()
            }
            Self::NoGroupBudget { file, .. } => format!(
                "give the group a budget: `echo 900000 > {file}`, or start from the root group"
            ),
            Self::PriorityRefused { .. } => {
                "allow it in the container: `--cap-add SYS_NICE --ulimit rtprio=89`, or run outside"
                    .to_owned()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reason() -> String {
        "EPERM".to_owned()
    }

    #[test]
    fn every_remedy_is_one_line() {
        let refusals = [
            GrantRefusal::MemoryLimit { limit_bytes: 8_388_608 },
            GrantRefusal::MemoryLock { reason: reason() },
            GrantRefusal::NoSuchCpu { cpu: 9, online: "0-1".to_owned() },
            GrantRefusal::CpuExcluded { cpu: 1, reason: reason() },
            GrantRefusal::PriorityRange { priority: 95 },
            GrantRefusal::NoPriorityRight { priority: 80, limit: 0 },
            GrantRefusal::NoGroupBudget {
                priority: 80,
                file: "/sys/fs/cgroup/cpu/box/cpu.rt_runtime_us".to_owned(),
            },
            GrantRefusal::PriorityRefused { priority: 80, reason: reason() },
        ];
        for refusal in refusals {
            let remedy = refusal.remedy();
            assert!(!remedy.is_empty() && !remedy.contains('\n'), "{refusal}: {remedy:?}");
            assert!(!refusal.to_string().contains('\n'), "{refusal}");
        }
    }
}
