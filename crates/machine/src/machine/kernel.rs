//! The kernel: its release, how it was built, and how it was started.

use std::fs;
use std::io::Read;

use flate2::read::GzDecoder;

use super::Machine;
use super::kernel_config::KernelConfig;

/// More than any kernel configuration has.
const CONFIG_BYTES: u64 = 16 << 20;

/// What the kernel lets run in place of its own code, and how this was found out.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Preemption {
    /// `rt`, `full`, `lazy`, `voluntary` or `none`; `dynamic` if only the choice can be read that
    /// there was.
    pub(crate) model: String,
    /// It can be changed without building another kernel.
    pub(crate) dynamic: bool,
    /// It is what is in force now, and not what was in force after the start.
    pub(crate) current: bool,
    /// The file it was read from.
    pub(crate) source: String,
}

impl Machine {
    /// Kernel release, as `uname -r`.
    pub(crate) fn release(&self) -> Option<String> {
        self.text("/proc/sys/kernel/osrelease")
    }

    /// Whether the kernel is this version or newer.
    pub(crate) fn is_at_least(&self, major: u32, minor: u32) -> Option<bool> {
        let release = self.release()?;
        let mut numbers = release.split(|c: char| !c.is_ascii_digit()).map(str::parse::<u32>);
        Some((numbers.next()?.ok()?, numbers.next()?.ok()?) >= (major, minor))
    }

    /// The last value of a parameter on the kernel command line; empty if it stands without one.
    pub(crate) fn parameter(&self, name: &str) -> Option<String> {
        let line = self.text("/proc/cmdline")?;
        // What follows `--` is for init.
        let words = line.split_whitespace().take_while(|word| *word != "--");
        let values = words.filter_map(|word| match word.split_once('=') {
            Some((key, value)) => (key == name).then_some(value),
            None => (word == name).then_some(""),
        });
        values.last().map(str::to_owned)
    }

    /// How the kernel was built, from where distributions leave it.
    pub(crate) fn config(&self) -> Option<&KernelConfig> {
        let read = || {
            let packed = "/proc/config.gz";
            if let Ok(file) = fs::File::open(self.path(packed)) {
                let mut text = String::new();
                GzDecoder::new(file).take(CONFIG_BYTES).read_to_string(&mut text).ok()?;
                return Some(KernelConfig { source: packed.to_owned(), text });
            }
            let release = self.release()?;
            let places =
                [format!("/boot/config-{release}"), format!("/lib/modules/{release}/config")];
            places
                .into_iter()
                .find_map(|source| Some(KernelConfig { text: self.text(&source)?, source }))
        };
        self.config.get_or_init(read).as_ref()
    }

    /// Whether the kernel gives real-time budgets to control groups, and refuses without one.
    pub(crate) fn group_scheduling(&self) -> Option<bool> {
        let config = self.config()?;
        let by_default = !config.is_set("RT_GROUP_SCHED_DEFAULT_DISABLED");
        let chosen = self.parameter("rt_group_sched").map(|value| value == "1");
        Some(config.is_set("RT_GROUP_SCHED") && chosen.unwrap_or(by_default))
    }

    /// Preemption, from the best source there is.
    pub(crate) fn preemption(&self) -> Option<Preemption> {
        let found = |model: &str, dynamic, current, source: &str| {
            Some(Preemption {
                model: model.to_owned(),
                dynamic,
                current,
                source: source.to_owned(),
            })
        };
        let version = self.text("/proc/version").unwrap_or_default();
        let built = version.split_whitespace().find_map(|word| match word {
            "PREEMPT_RT" => Some("rt"),
            "PREEMPT_LAZY" => Some("lazy"),
            "PREEMPT" => Some("full"),
            "PREEMPT_DYNAMIC" => Some("dynamic"),
            _ => None,
        });
        if self.text("/sys/kernel/realtime").as_deref() == Some("1") {
            return found("rt", false, true, "/sys/kernel/realtime");
        }
        if built == Some("rt") {
            return found("rt", false, true, "/proc/version");
        }
        // "none voluntary (full) lazy": the chosen one is in parentheses.
        let switch = "/sys/kernel/debug/sched/preempt";
        if let Some(modes) = self.text(switch)
            && let Some((_, rest)) = modes.split_once('(')
            && let Some((chosen, _)) = rest.split_once(')')
        {
            return found(chosen, true, true, switch);
        }
        match built {
            Some("dynamic") => {}
            Some(built) => return found(built, false, true, "/proc/version"),
            None if version.is_empty() => return None,
            // A kernel that says nothing is "voluntary" or "none".
            None => {
                let config = self.config()?;
                return found(config.preemption()?, false, true, &config.source);
            }
        }
        if let Some(chosen) = self.parameter("preempt") {
            return found(&chosen, true, false, "/proc/cmdline");
        }
        match self.config().and_then(|config| config.preemption().zip(Some(&config.source))) {
            Some((built_in, source)) => found(built_in, true, false, source),
            None => found("dynamic", true, false, "/proc/version"),
        }
    }
}
