//! What the kernel runs on: metal or a hypervisor, a container around us, and which clock.

use super::Machine;

const CLOCK_SOURCES: &str = "/sys/devices/system/clocksource/clocksource0";

/// What is underneath the kernel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Platform {
    Metal,
    /// A hypervisor, `unknown` if it does not show its name.
    Guest(String),
    /// This architecture does not tell.
    Unknown,
}

impl Machine {
    /// The clock that the kernel reads, and those it could.
    pub(crate) fn clock_source(&self) -> Option<String> {
        self.text(&format!("{CLOCK_SOURCES}/current_clocksource"))
    }

    /// The clocks that the kernel could read.
    pub(crate) fn clock_sources(&self) -> String {
        self.text(&format!("{CLOCK_SOURCES}/available_clocksource")).unwrap_or_default()
    }

    /// What is underneath the kernel.
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

    /// Why this looks like the inside of a container.
    pub(crate) fn container_sign(&self) -> Option<String> {
        let marks = ["/.dockerenv", "/run/.containerenv", "/run/systemd/container"];
        if let Some(mark) = marks.into_iter().find(|mark| self.has(mark)) {
            return Some(mark.to_owned());
        }
        let groups = self.text("/proc/1/cgroup")?;
        let engines = ["docker", "kubepods", "containerd", "libpod", "lxc"];
        let engine = engines.into_iter().find(|engine| groups.contains(engine))?;
        Some(format!("{engine} in /proc/1/cgroup"))
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
