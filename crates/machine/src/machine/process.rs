//! The rights of this process: limits, capabilities, control group.

use super::control_group::Version;
use super::{CpuList, Machine};

/// A resource limit; `u64::MAX` is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Limit {
    pub(crate) soft: u64,
    pub(crate) hard: u64,
}

/// Capabilities, by their bit.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Capability {
    IpcLock = 14,
    SysNice = 23,
}

/// The real-time budget of a control group.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum GroupBudget {
    /// Version 1 with `RT_GROUP_SCHED`.
    Budget {
        /// The file that holds the budget, `cpu.rt_runtime_us`.
        file: String,
        /// Time that the group's real-time threads may run in each period, in us; 0: none.
        runtime_us: i64,
    },
    /// Version 1 without `RT_GROUP_SCHED`.
    NoBudgets,
    /// Version 2, in a group that the `cpu` controller governs.
    Governed {
        /// The group, as the kernel names it: `/system.slice`.
        group: String,
    },
    /// Version 2, in a group that it does not govern.
    Ungoverned {
        /// The group, as the kernel names it.
        group: String,
    },
}

impl Machine {
    /// A line of `/proc/self/limits`, such as `Max locked memory`.
    pub(crate) fn limit(&self, name: &str) -> Option<Limit> {
        let limits = self.text("/proc/self/limits")?;
        let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
        let mut values = line.split_whitespace().map(|word| match word {
            "unlimited" => Some(u64::MAX),
            word => word.parse().ok(),
        });
        Some(Limit { soft: values.next()??, hard: values.next()?? })
    }

    /// Whether this process has a capability that counts: one of a user namespace of its own does
    /// not where the whole machine is concerned.
    pub(crate) fn capability(&self, capability: Capability) -> Option<bool> {
        let mask = u64::from_str_radix(&self.status("CapEff")?, 16).ok()?;
        Some(mask & (1 << capability as u32) != 0 && !self.is_in_user_namespace())
    }

    /// Whether the root of this process is not the root of the machine.
    pub(crate) fn is_in_user_namespace(&self) -> bool {
        let map = self.text("/proc/self/uid_map").unwrap_or_default();
        !map.is_empty() && !map.split_whitespace().eq(["0", "0", "4294967295"])
    }

    /// The CPUs that this process may use.
    pub(crate) fn allowed(&self) -> Option<CpuList> {
        CpuList::parse(&self.status("Cpus_allowed_list")?)
    }

    /// The CPUs of this process's cpuset.
    pub(super) fn cpuset(&self) -> Option<CpuList> {
        let folder = self.control_group("cpuset")?.folder();
        let files = ["cpuset.cpus.effective", "cpuset.effective_cpus", "cpuset.cpus"];
        files.into_iter().find_map(|file| self.list(&format!("{folder}/{file}")))
    }

    /// The real-time budget of the calling thread's control group.
    pub fn group_budget(&self) -> Option<GroupBudget> {
        let group = self.control_group("cpu")?;
        if group.version == Version::One {
            let folder = group.folder();
            let file = format!("{folder}/cpu.rt_runtime_us");
            return match self.number(&file) {
                Some(runtime_us) => Some(GroupBudget::Budget { file, runtime_us }),
                None => self.has(&format!("{folder}/cpu.shares")).then_some(GroupBudget::NoBudgets),
            };
        }
        self.has("/sys/fs/cgroup/cgroup.controllers").then_some(())?;
        // The nearest group that the controller is on for governs those below; the root has no file.
        let governs = |path: &str| self.has(&format!("{}{path}/cpu.max", group.mount));
        let is_governed = group.and_above().any(governs);
        let group = group.name;
        Some(if is_governed {
            GroupBudget::Governed { group }
        } else {
            GroupBudget::Ungoverned { group }
        })
    }

    fn status(&self, field: &str) -> Option<String> {
        let status = self.text("/proc/self/status")?;
        let value = status.lines().find_map(|line| line.strip_prefix(field)?.strip_prefix(':'))?;
        Some(value.trim().to_owned())
    }
}
