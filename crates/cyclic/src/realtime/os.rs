//! The system calls of the set-up, behind a trait so that its decisions are tested without privilege.
#![allow(unsafe_code)] // scheduling, signal masks and rusage have no safe wrapper in rustix.

use std::io;
use std::mem::MaybeUninit;
use std::num::NonZeroU64;

use isochrone_machine::{CpuList, GroupBudget, Machine};
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use rustix::thread::{
    CapabilitySet, CpuSet, capabilities, sched_getaffinity, sched_setaffinity,
    set_current_timer_slack,
};

/// A resource limit; `u64::MAX` is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limit {
    pub(crate) soft: u64,
    pub(crate) hard: u64,
}

/// The scheduler of a thread, as the kernel tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scheduler {
    Fifo(u8),
    RoundRobin(u8),
    Deadline,
    Batch,
    Idle,
    Other,
}

/// What the set-up asks of the operating system. All of it concerns the calling thread or process.
pub(crate) trait Os {
    fn can_lock_memory(&self) -> bool;
    fn can_set_priority(&self) -> bool;
    fn memory_lock_limit(&self) -> Limit;
    fn priority_limit(&self) -> Limit;
    fn raise_memory_lock_limit(&self);
    fn raise_priority_limit(&self);
    fn lock_memory(&self) -> io::Result<()>;
    fn keep_freed_memory(&self);
    fn set_timer_slack_ns(&self, slack_ns: NonZeroU64);
    fn block_signals(&self);
    /// The CPUs that are online, if the kernel says.
    fn online_cpus(&self) -> Option<CpuList>;
    /// The CPUs that the thread may run on.
    fn affinity(&self) -> io::Result<CpuSet>;
    fn set_affinity(&self, cpus: &CpuSet) -> io::Result<()>;
    fn set_fifo(&self, priority: u8) -> io::Result<()>;
    /// Normal scheduling, which every thread may always have.
    fn set_other(&self);
    fn scheduler(&self) -> Scheduler;
    fn group_budget(&self) -> Option<GroupBudget>;
}

/// The kernel we run on.
pub(crate) struct Linux;

impl Os for Linux {
    fn can_lock_memory(&self) -> bool {
        has_capability(CapabilitySet::IPC_LOCK)
    }

    fn can_set_priority(&self) -> bool {
        has_capability(CapabilitySet::SYS_NICE)
    }

    fn memory_lock_limit(&self) -> Limit {
        limit(Resource::Memlock)
    }

    fn priority_limit(&self) -> Limit {
        limit(Resource::Rtprio)
    }

    fn raise_memory_lock_limit(&self) {
        raise(Resource::Memlock);
    }

    fn raise_priority_limit(&self) {
        raise(Resource::Rtprio);
    }

    fn lock_memory(&self) -> io::Result<()> {
        Ok(mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?)
    }

    #[cfg(target_env = "gnu")]
    fn keep_freed_memory(&self) {
        // SAFETY: mallopt only sets parameters of glibc's malloc, under malloc's own lock; both
        // parameters take any int.
        unsafe {
            libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
            libc::mallopt(libc::M_MMAP_MAX, 0);
        }
    }

    #[cfg(not(target_env = "gnu"))]
    fn keep_freed_memory(&self) {}

    fn set_timer_slack_ns(&self, slack_ns: NonZeroU64) {
        // It cannot fail for the calling thread, and the kernel ignores it under SCHED_FIFO.
        let _ = set_current_timer_slack(Some(slack_ns));
    }

    fn block_signals(&self) {
        let mut set = MaybeUninit::<libc::sigset_t>::uninit();
        // SAFETY: sigfillset initialises the whole set it is given before anything reads it, and
        // sigdelset takes valid signal numbers. pthread_sigmask reads the set and, given null,
        // writes nothing. Only this thread's mask changes.
        unsafe {
            libc::sigfillset(set.as_mut_ptr());
            // These report a fault of this very thread: blocked, they would kill without a word.
            for fault in [libc::SIGSEGV, libc::SIGBUS, libc::SIGFPE, libc::SIGILL, libc::SIGTRAP] {
                libc::sigdelset(set.as_mut_ptr(), fault);
            }
            libc::pthread_sigmask(libc::SIG_SETMASK, set.as_ptr(), std::ptr::null_mut());
        }
    }

    fn online_cpus(&self) -> Option<CpuList> {
        Machine::here().online()
    }

    fn affinity(&self) -> io::Result<CpuSet> {
        Ok(sched_getaffinity(None)?)
    }

    fn set_affinity(&self, cpus: &CpuSet) -> io::Result<()> {
        Ok(sched_setaffinity(None, cpus)?)
    }

    fn set_fifo(&self, priority: u8) -> io::Result<()> {
        set_scheduler(libc::SCHED_FIFO, priority)
    }

    fn set_other(&self) {
        let _ = set_scheduler(libc::SCHED_OTHER, 0);
    }

    fn scheduler(&self) -> Scheduler {
        // SAFETY: takes no pointer; pid 0 is the calling thread.
        let policy = unsafe { libc::syscall(libc::SYS_sched_getscheduler, 0) };
        // SAFETY: an all-zero sched_param is valid: it consists of integers.
        let mut param: libc::sched_param = unsafe { MaybeUninit::zeroed().assume_init() };
        // SAFETY: `param` outlives the call, which writes one sched_param to it.
        unsafe { libc::syscall(libc::SYS_sched_getparam, 0, &raw mut param) };
        let priority = u8::try_from(param.sched_priority).unwrap_or(0);
        match policy & !libc::c_long::from(libc::SCHED_RESET_ON_FORK) {
            policy if policy == libc::SCHED_FIFO.into() => Scheduler::Fifo(priority),
            policy if policy == libc::SCHED_RR.into() => Scheduler::RoundRobin(priority),
            policy if policy == libc::SCHED_DEADLINE.into() => Scheduler::Deadline,
            policy if policy == libc::SCHED_BATCH.into() => Scheduler::Batch,
            policy if policy == libc::SCHED_IDLE.into() => Scheduler::Idle,
            _ => Scheduler::Other,
        }
    }

    fn group_budget(&self) -> Option<GroupBudget> {
        Machine::here().group_budget()
    }
}

/// Changes how the calling thread is scheduled.
fn set_scheduler(policy: libc::c_int, priority: u8) -> io::Result<()> {
    // SAFETY: an all-zero sched_param is valid: it consists of integers.
    let mut param: libc::sched_param = unsafe { MaybeUninit::zeroed().assume_init() };
    param.sched_priority = priority.into();
    // SAFETY: `param` outlives the call, which only reads it; pid 0 is the calling thread. The
    // bare system call, because musl's wrapper refuses.
    let result =
        unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, policy, &raw const param) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

/// The counters of the calling thread.
pub(crate) fn thread_counters() -> libc::rusage {
    let mut usage = MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: `usage` has room for one rusage, which the call fills; should it fail, the zeros it
    // was initialised with are a valid rusage, which consists of integers.
    unsafe {
        libc::getrusage(libc::RUSAGE_THREAD, usage.as_mut_ptr());
        usage.assume_init()
    }
}

fn has_capability(capability: CapabilitySet) -> bool {
    capabilities(None).is_ok_and(|sets| sets.effective.contains(capability))
}

fn limit(resource: Resource) -> Limit {
    let limit = getrlimit(resource);
    Limit { soft: limit.current.unwrap_or(u64::MAX), hard: limit.maximum.unwrap_or(u64::MAX) }
}

fn raise(resource: Resource) {
    let maximum = getrlimit(resource).maximum;
    // Every process may raise its soft limit to the hard one; the caller reads the outcome back.
    let _ = setrlimit(resource, Rlimit { current: maximum, maximum });
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_kernel_tells_that_a_new_thread_is_scheduled_like_its_parent() {
        let parent = Linux.scheduler();
        let child = std::thread::spawn(|| Linux.scheduler()).join().unwrap();
        assert_eq!(child, parent);
    }

    #[test]
    fn a_thread_that_blocks_signals_still_receives_its_own_faults() {
        std::thread::spawn(|| {
            Linux.block_signals();
            let status = fs::read_to_string("/proc/thread-self/status").unwrap();
            let mask = status.lines().find_map(|line| line.strip_prefix("SigBlk:")).unwrap();
            let mask = u64::from_str_radix(mask.trim(), 16).unwrap();
            let blocked = |signal: i32| mask & (1 << (signal - 1)) != 0;
            assert!(blocked(libc::SIGTERM) && blocked(libc::SIGINT) && blocked(libc::SIGALRM));
            assert!(!blocked(libc::SIGSEGV) && !blocked(libc::SIGBUS));
        })
        .join()
        .unwrap();
    }
}
