//! Once per process: memory that is never paged out and never given back.

use std::sync::atomic::{AtomicBool, Ordering};

use super::os::{Linux, Os};
use super::refusal::GrantRefusal;

/// What the system granted the process.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ProcessGrant {
    /// All memory is locked, present and future.
    pub memory_locked: bool,
    /// What was refused.
    pub refusals: Vec<GrantRefusal>,
}

/// Prepares the process: call it once, early in `main`, before other threads allocate.
///
/// glibc's malloc is told to keep freed memory and never to map it anew, so that memory once
/// touched stays touched; then all memory is locked. Without CAP_IPC_LOCK a finite RLIMIT_MEMLOCK
/// makes every later mapping beyond it fail, so in that case memory is left unlocked.
pub fn prepare_process() -> ProcessGrant {
    let grant = prepare(&Linux);
    IS_MEMORY_LOCKED.store(grant.memory_locked, Ordering::Relaxed);
    grant
}

static IS_MEMORY_LOCKED: AtomicBool = AtomicBool::new(false);

pub(super) fn is_memory_locked() -> bool {
    IS_MEMORY_LOCKED.load(Ordering::Relaxed)
}

fn prepare(os: &impl Os) -> ProcessGrant {
    os.keep_freed_memory();
    let refusal = lock_memory(os).err();
    ProcessGrant { memory_locked: refusal.is_none(), refusals: refusal.into_iter().collect() }
}

fn lock_memory(os: &impl Os) -> Result<(), GrantRefusal> {
    if !os.can_lock_memory() {
        if os.memory_lock_limit().hard == u64::MAX {
            os.raise_memory_lock_limit();
        }
        let limit = os.memory_lock_limit();
        if limit.soft != u64::MAX {
            // Locking future mappings too would make the process fail as soon as it grows past the limit.
            let message = format!(
                "memory is not locked: CAP_IPC_LOCK is missing and RLIMIT_MEMLOCK is {} bytes",
                limit.hard
            );
            let remedy = "run as root, or `sudo setcap cap_ipc_lock,cap_sys_nice+ep` the program, or \
                          set `memlock unlimited` for this user in /etc/security/limits.conf";
            return Err(GrantRefusal::of_memory(message, remedy));
        }
    }
    os.lock_memory().map_err(|error| {
        let message = format!("memory is not locked: the kernel refused mlockall ({error})");
        let remedy = "free memory, or grant CAP_IPC_LOCK to the program or its container";
        GrantRefusal::of_memory(message, remedy)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::realtime::os::Limit;
    use crate::realtime::simulated_os::SimulatedOs;

    const FINITE: Limit = Limit { soft: 65_536, hard: 8_388_608 };

    #[test]
    fn a_privileged_process_locks_memory_whatever_its_limit() {
        let os = SimulatedOs { can_lock_memory: true, ..SimulatedOs::default() }.memlock(FINITE);
        let grant = prepare(&os);
        assert_eq!(grant, ProcessGrant { memory_locked: true, refusals: vec![] });
        assert_eq!(os.calls(), ["keep_freed_memory", "lock_memory"]);
    }

    #[test]
    fn a_finite_limit_leaves_memory_unlocked_so_that_later_allocations_work() {
        let os = SimulatedOs::default().memlock(FINITE);
        let grant = prepare(&os);
        assert!(!grant.memory_locked);
        assert_eq!(grant.refusals.len(), 1);
        assert_eq!(grant.refusals[0].code(), "lock_denied");
        assert!(grant.refusals[0].to_string().contains("RLIMIT_MEMLOCK is 8388608 bytes"));
        assert!(grant.refusals[0].remedy().contains("memlock unlimited"));
        assert_eq!(os.calls(), ["keep_freed_memory"]);
    }

    #[test]
    fn an_unlimited_hard_limit_is_raised_to_before_locking() {
        let os = SimulatedOs::default().memlock(Limit { soft: 65_536, hard: u64::MAX });
        assert!(prepare(&os).memory_locked);
        assert_eq!(os.calls(), ["keep_freed_memory", "raise_memory_lock_limit", "lock_memory"]);
    }

    #[test]
    fn a_kernel_that_refuses_to_lock_is_reported_with_its_reason() {
        let os = SimulatedOs {
            can_lock_memory: true,
            lock_memory_errno: Some(libc::ENOMEM),
            ..SimulatedOs::default()
        };
        let grant = prepare(&os);
        assert!(!grant.memory_locked);
        assert_eq!(grant.refusals[0].code(), "lock_denied");
        assert!(grant.refusals[0].to_string().contains("Cannot allocate memory"));
    }
}
