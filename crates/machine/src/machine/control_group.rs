//! The control groups of this thread.

use super::Machine;

/// The version of a hierarchy of control groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Version {
    One,
    Two,
}

/// The control group of this thread that a controller looks at.
#[derive(Debug)]
pub(super) struct ControlGroup {
    pub(super) version: Version,
    /// Where its hierarchy is mounted: `/sys/fs/cgroup`.
    pub(super) mount: String,
    /// The group, as the kernel names it: `/system.slice`.
    pub(super) name: String,
}

impl ControlGroup {
    /// The folder of its files.
    pub(super) fn folder(&self) -> String {
        format!("{}{}", self.mount, self.path())
    }

    /// The group and those above it, from the mount; the last is empty.
    pub(super) fn and_above(&self) -> impl Iterator<Item = &str> {
        std::iter::successors(Some(self.path()), |path| Some(path.rsplit_once('/')?.0))
    }

    fn path(&self) -> &str {
        self.name.trim_end_matches('/')
    }
}

impl Machine {
    /// The group of version 1 if the controller is in use there, else that of version 2.
    pub(super) fn control_group(&self, controller: &str) -> Option<ControlGroup> {
        // In version 1 each thread has a group of its own.
        let of_thread = self.text("/proc/thread-self/cgroup");
        let groups = of_thread.or_else(|| self.text("/proc/self/cgroup"))?;
        if let Some(name) = of_version_1(&groups, controller) {
            // Distributions mount the controllers of CPU time together.
            let mounts = [controller, "cpu,cpuacct"].map(|mount| format!("/sys/fs/cgroup/{mount}"));
            let mount = mounts.into_iter().find(|mount| self.has(mount))?;
            return Some(ControlGroup { version: Version::One, mount, name: name.to_owned() });
        }
        let name = groups.lines().find_map(|line| line.strip_prefix("0::"))?.to_owned();
        Some(ControlGroup { version: Version::Two, mount: "/sys/fs/cgroup".to_owned(), name })
    }
}

/// The group of a version 1 controller in a `/proc/<pid>/cgroup` file.
fn of_version_1<'a>(groups: &'a str, controller: &str) -> Option<&'a str> {
    groups.lines().find_map(|line| {
        let mut fields = line.splitn(3, ':').skip(1);
        let (controllers, group) = (fields.next()?, fields.next()?);
        controllers.split(',').any(|name| name == controller).then_some(group)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cpu_group_is_found_among_the_other_controllers() {
        let groups = "4:memory:/m\n3:cpuset:/s\n2:cpu,cpuacct:/a:b/c\n0::/unified\n";
        assert_eq!(of_version_1(groups, "cpu"), Some("/a:b/c"));
        assert_eq!(of_version_1("3:cpuset:/s\n0::/unified\n", "cpu"), None);
    }
}
