//! How much memory this process can still have.

use super::Machine;
use super::control_group::Version;

impl Machine {
    /// Bytes that this process can still allocate, limited by the machine and by its control
    /// groups. Memory that caches files counts as free. `None` if the machine does not say.
    pub fn available_bytes(&self) -> Option<u64> {
        let meminfo = self.text("/proc/meminfo")?;
        let available = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        let kilobytes: u64 = available.trim().trim_end_matches(" kB").parse().ok()?;
        let of_machine = kilobytes.checked_mul(1024)?;
        Some(self.group_bytes().map_or(of_machine, |of_groups| of_groups.min(of_machine)))
    }

    /// The least that a limit on this process's control group, or on one above it, leaves.
    fn group_bytes(&self) -> Option<u64> {
        let group = self.control_group("memory")?;
        let mount = &group.mount;
        let [limit, used, cached] = match group.version {
            Version::One => {
                ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file "]
            }
            Version::Two => ["memory.max", "memory.current", "inactive_file "],
        };
        let left = |path: &str| {
            let number = |file: &str| {
                let number = self.number(&format!("{mount}{path}/{file}"))?;
                u64::try_from(number).ok()
            };
            let stat = self.text(&format!("{mount}{path}/memory.stat")).unwrap_or_default();
            let cached = stat.lines().find_map(|line| line.strip_prefix(cached)?.parse().ok());
            let used = number(used)?.saturating_sub(cached.unwrap_or(0));
            Some(number(limit)?.saturating_sub(used))
        };
        group.and_above().filter_map(left).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made_of_files::{File, machine};

    const MEMINFO: File =
        ("proc/meminfo", "MemTotal:  2000 kB\nMemFree:  100 kB\nMemAvailable:    1000 kB\n");

    fn available(files: &[File]) -> Option<u64> {
        let (_root, machine) = machine(files);
        machine.available_bytes()
    }

    #[test]
    fn without_limits_it_is_what_the_machine_has() {
        assert_eq!(available(&[MEMINFO]), Some(1_024_000));
        let unlimited = [
            MEMINFO,
            ("proc/self/cgroup", "0::/a"),
            ("sys/fs/cgroup/a/memory.max", "max"),
            ("sys/fs/cgroup/a/memory.current", "900"),
        ];
        assert_eq!(available(&unlimited), Some(1_024_000));
    }

    #[test]
    fn the_tightest_group_above_counts_without_its_copies_of_files() {
        let limited = [
            MEMINFO,
            ("proc/self/cgroup", "0::/a/b"),
            ("sys/fs/cgroup/a/b/memory.max", "900000"),
            ("sys/fs/cgroup/a/b/memory.current", "100000"),
            ("sys/fs/cgroup/a/memory.max", "500000"),
            ("sys/fs/cgroup/a/memory.current", "300000"),
            ("sys/fs/cgroup/a/memory.stat", "anon 250000\ninactive_file 50000\n"),
        ];
        assert_eq!(available(&limited), Some(250_000));
    }

    #[test]
    fn the_root_of_a_container_may_have_the_limit() {
        let limited = [
            MEMINFO,
            ("proc/self/cgroup", "0::/"),
            ("sys/fs/cgroup/memory.max", "70000"),
            ("sys/fs/cgroup/memory.current", "80000"),
        ];
        assert_eq!(available(&limited), Some(0));
    }

    #[test]
    fn version_1_has_other_names() {
        let limited = [
            MEMINFO,
            ("proc/self/cgroup", "4:memory:/node\n0::/"),
            ("sys/fs/cgroup/memory/node/memory.limit_in_bytes", "600000"),
            ("sys/fs/cgroup/memory/node/memory.usage_in_bytes", "400000"),
            ("sys/fs/cgroup/memory/node/memory.stat", "inactive_file 1\ntotal_inactive_file 1000"),
            ("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712"),
            ("sys/fs/cgroup/memory/memory.usage_in_bytes", "400000"),
        ];
        assert_eq!(available(&limited), Some(201_000));
    }

    #[test]
    fn a_machine_that_tells_nothing_is_not_guessed_at() {
        assert_eq!(available(&[]), None);
        assert!(Machine::here().available_bytes().is_some_and(|bytes| bytes > 0));
    }
}
