//! The CPUs: which there are, which are kept free, and how they rest.

use std::collections::BTreeSet;

use super::{CpuList, Machine};

/// A state that an idle CPU may enter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct IdleState {
    /// Its directory: `state3`.
    pub(crate) directory: String,
    /// The driver's name for it: `C6`.
    pub(crate) name: String,
    /// How long leaving it takes at worst, as the driver declares it, in us.
    pub(crate) exit_latency_us: i64,
    /// The governor may choose it.
    pub(crate) enabled: bool,
}

impl Machine {
    /// The CPUs that are online.
    pub fn online(&self) -> Option<CpuList> {
        self.list("/sys/devices/system/cpu/online")
    }

    /// The CPUs that are kept free of other work, as the kernel lists them.
    pub(crate) fn isolated(&self) -> Option<String> {
        self.text("/sys/devices/system/cpu/isolated")
    }

    /// The CPUs that the scheduler or the tick leaves alone: of `isolcpus`, of an isolated partition of
    /// control groups, of `nohz_full`.
    pub(crate) fn kept_free(&self) -> BTreeSet<usize> {
        let lists = [
            self.list("/sys/devices/system/cpu/isolated"),
            self.list("/sys/fs/cgroup/cpuset.cpus.isolated"),
            self.tickless(),
        ];
        let named = |list: &CpuList| list.iter().collect::<Vec<_>>();
        lists.iter().flatten().flat_map(named).collect()
    }

    /// The CPUs that a thread of this process may be bound to.
    ///
    /// The kernel starts every process without the CPUs of `isolcpus`. So where just these are missing
    /// from what the process may use, they belong to it, unless its cpuset excludes them.
    pub fn bindable(&self) -> Option<BTreeSet<usize>> {
        let online: Option<BTreeSet<_>> = self.online().map(|online| online.iter().collect());
        let allowed: BTreeSet<_> = self.allowed()?.iter().collect();
        let Some(online) = online else { return Some(allowed) };
        let mut bindable: BTreeSet<_> = allowed.intersection(&online).copied().collect();
        let boot = self.list("/sys/devices/system/cpu/isolated").unwrap_or_default();
        let (isolated, others): (BTreeSet<usize>, _) =
            online.iter().copied().partition(|cpu| boot.contains(*cpu));
        if bindable == others {
            let cpuset = self.cpuset();
            let is_open = |cpu: &usize| cpuset.as_ref().is_none_or(|set| set.contains(*cpu));
            bindable.extend(isolated.into_iter().filter(is_open));
        }
        Some(bindable)
    }

    /// The CPUs that share the core of one, itself included.
    pub(crate) fn core(&self, cpu: usize) -> Option<CpuList> {
        self.list(&format!("/sys/devices/system/cpu/cpu{cpu}/topology/thread_siblings_list"))
    }

    /// The CPUs without a tick while one thread runs there (`nohz_full`).
    pub(crate) fn tickless(&self) -> Option<CpuList> {
        let list = self.list("/sys/devices/system/cpu/nohz_full");
        list.or_else(|| CpuList::parse(&self.parameter("nohz_full")?))
    }

    /// The governor of one CPU.
    pub(crate) fn governor(&self, cpu: usize) -> Option<String> {
        self.text(&format!("/sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor"))
    }

    /// Frequency governors in use, comma-separated.
    pub(crate) fn governors(&self) -> Option<String> {
        let policies = "/sys/devices/system/cpu/cpufreq";
        let governors: BTreeSet<String> = self
            .names(policies)
            .iter()
            .filter_map(|policy| self.text(&format!("{policies}/{policy}/scaling_governor")))
            .collect();
        (!governors.is_empty()).then(|| Vec::from_iter(governors).join(","))
    }

    /// The driver that puts idle CPUs to rest; `None` also stands for the kernel's word "none".
    pub(crate) fn idle_driver(&self) -> Option<String> {
        let driver = self.text("/sys/devices/system/cpu/cpuidle/current_driver")?;
        (driver != "none").then_some(driver)
    }

    /// Whether it can be told that there is no such driver.
    pub(crate) fn has_no_idle_driver(&self) -> bool {
        self.idle_driver().is_none() && self.has("/sys/devices/system/cpu/online")
    }

    /// The idle states of a CPU, the shallowest first.
    pub(crate) fn idle_states(&self, cpu: usize) -> Vec<IdleState> {
        let folder = format!("/sys/devices/system/cpu/cpu{cpu}/cpuidle");
        let mut directories = self.names(&folder);
        directories.sort_by_key(|name| (name.len(), name.clone()));
        let state = |directory: String| {
            let read = |name: &str| self.text(&format!("{folder}/{directory}/{name}"));
            Some(IdleState {
                name: read("name")?,
                exit_latency_us: read("latency")?.parse().ok()?,
                enabled: read("disable")? == "0",
                directory,
            })
        };
        directories.into_iter().filter_map(state).collect()
    }
}
