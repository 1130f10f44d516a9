//! The platform of the kernel: metal or a hypervisor, a container, and the clock.

use super::Machine;

const CLOCK_SOURCES: &str = "/sys/devices/system/clocksource/clocksource0";

/// The layer below the kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Platform {
    Metal,
    /// A hypervisor, `unknown` if it does not show its name.
    Guest(String),
    /// This architecture does not tell.
    Unknown,
}

/// Whether a container is around us, and by which mark.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Container {
    No,
    /// There is one mark, and it is not enough.
    Maybe(String),
    Yes(String),
}

impl Container {
    /// A way out for each side, or for both.
    pub(crate) fn fix(&self, inside: &str, outside: &str) -> String {
        match self {
            Self::No => outside.to_owned(),
            Self::Maybe(_) => format!("{outside}  # if this is a container: {inside}"),
            Self::Yes(_) => inside.to_owned(),
        }
    }
}

/// What container engines call their control groups.
const ENGINES: [&str; 5] = ["docker", "kubepods", "containerd", "libpod", "lxc"];
/// What containers are given as process 1, and machines are not.
const CONTAINER_INITS: [&str; 6] =
    ["docker-init", "tini", "dumb-init", "catatonit", "pause", "s6-svscan"];

impl Machine {
    /// The clock that the kernel reads, and those it could.
    pub(crate) fn clock_source(&self) -> Option<String> {
        self.text(&format!("{CLOCK_SOURCES}/current_clocksource"))
    }

    /// The clocks that the kernel could read.
    pub(crate) fn clock_sources(&self) -> String {
        self.text(&format!("{CLOCK_SOURCES}/available_clocksource")).unwrap_or_default()
    }

    /// The layer below the kernel.
    pub(crate) fn platform(&self) -> Platform {
        if let Some(kind) = self.text("/sys/hypervisor/type") {
            return Platform::Guest(kind);
        }
        let cpuinfo = self.text("/proc/cpuinfo").unwrap_or_default();
        // Only x86 has such a line.
        let Some(flags) = cpuinfo.lines().find(|line| line.starts_with("flags")) else {
            return Platform::Unknown;
        };
        if !flags.split_whitespace().any(|flag| flag == "hypervisor") {
            return Platform::Metal;
        }
        // The flag has no name. A paravirtual clock tells the hypervisor, firmware at least the vendor.
        let clocks = self.clock_sources();
        let name = match () {
            () if clocks.contains("kvm-clock") => Some("kvm".to_owned()),
            () if clocks.contains("hyperv") => Some("hyperv".to_owned()),
            () => self.text("/sys/class/dmi/id/sys_vendor"),
        };
        Platform::Guest(name.unwrap_or_else(|| "unknown".to_owned()))
    }

    pub(crate) fn is_guest(&self) -> bool {
        matches!(self.platform(), Platform::Guest(_))
    }

    /// Whether this looks like the inside of a container, and why.
    pub(crate) fn container(&self) -> Container {
        let marks = ["/run/.containerenv", "/run/systemd/container"];
        if let Some(mark) = marks.into_iter().find(|mark| self.has(mark)) {
            return Container::Yes(mark.to_owned());
        }
        for file in ["/proc/1/cgroup", "/proc/self/cgroup"] {
            let groups = self.text(file).unwrap_or_default();
            if let Some(engine) = ENGINES.into_iter().find(|engine| groups.contains(engine)) {
                return Container::Yes(format!("{engine} in {file}"));
            }
        }
        let docker = "/.dockerenv";
        if !self.has(docker) {
            return Container::No;
        }
        // A machine whose disk was made of a container's image has this file, too.
        let first = self.text("/proc/1/comm").unwrap_or_default();
        if CONTAINER_INITS.contains(&first.as_str()) {
            return Container::Yes(format!("{docker}, {first} is process 1"));
        }
        let is_root = |mount: &str| {
            let mut fields = mount.split(' ').skip(1);
            (fields.next(), fields.next()) == (Some("/"), Some("overlay"))
        };
        if self.text("/proc/mounts").unwrap_or_default().lines().any(is_root) {
            Container::Yes(format!("{docker}, / is an overlay"))
        } else {
            Container::Maybe(docker.to_owned())
        }
    }

    /// Time that the hypervisor kept a CPU from us since the start, as a fraction of all its time.
    pub(crate) fn steal(&self, cpu: usize) -> Option<f64> {
        let stat = self.text("/proc/stat")?;
        let name = format!("cpu{cpu}");
        let line = stat.lines().find(|line| line.split_whitespace().next() == Some(&name))?;
        // user nice system idle iowait irq softirq steal; what follows is contained in these.
        let ticks: Vec<u64> =
            line.split_whitespace().skip(1).take(8).flat_map(str::parse).collect();
        let (steal, total) = (ticks.get(7)?, ticks.iter().sum::<u64>());
        Some(*steal as f64 / total.max(1) as f64)
    }
}
