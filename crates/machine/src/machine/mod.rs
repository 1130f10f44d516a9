//! Reading a machine: what its `/proc` and `/sys` say, below any root, so that tests read made-up
//! machines. Nothing is changed, and what cannot be read is `None`.

mod control_group;
mod cpu_list;
mod cpus;
mod disturbance;
mod interrupts;
mod kernel;
mod kernel_config;
mod memory;
mod mobility;
mod platform;
mod process;
mod threads;

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

pub use cpu_list::CpuList;
pub(crate) use interrupts::Interrupt;
use kernel_config::KernelConfig;
pub use mobility::Mobility;
pub(crate) use platform::{Container, Platform};
pub use process::GroupBudget;
pub(crate) use process::{Capability, Limit};

use crate::quiet::Observation;

/// A machine to read: this one, or a file tree that looks like one.
#[derive(Debug)]
pub struct Machine {
    root: PathBuf,
    free_bytes: fn(&Path) -> Option<u64>,
    ask_mobility: fn(&Path) -> Mobility,
    config: OnceCell<Option<KernelConfig>>,
    /// Made when it is first asked for.
    pub(crate) observation: OnceCell<Option<Observation>>,
}

impl Machine {
    /// The machine that this program runs on.
    pub fn here() -> Self {
        Self::below("/")
    }

    /// A machine whose `proc`, `sys`, `dev` and `boot` are below a folder.
    pub fn below(root: impl Into<PathBuf>) -> Self {
        Self {
            root: root.into(),
            free_bytes,
            ask_mobility: mobility::ask,
            config: OnceCell::new(),
            observation: OnceCell::new(),
        }
    }

    /// The same machine with a different function for the free bytes of the file system at a path.
    pub fn with_free_bytes(self, free_bytes: fn(&Path) -> Option<u64>) -> Self {
        Self { free_bytes, ..self }
    }

    /// The same machine with a different function for whether an interrupt can be moved, given the path
    /// of its `smp_affinity_list`.
    pub fn with_mobility(self, ask_mobility: fn(&Path) -> Mobility) -> Self {
        Self { ask_mobility, ..self }
    }

    /// Whether it is the machine that this program runs on.
    pub(crate) fn is_here(&self) -> bool {
        self.root == Path::new("/")
    }

    /// The text of a file, without white space at its end.
    pub(crate) fn text(&self, path: &str) -> Option<String> {
        let text = fs::read_to_string(self.path(path)).ok()?;
        Some(text.trim_end().to_owned())
    }

    /// The number that a file consists of.
    pub(crate) fn number(&self, path: &str) -> Option<i64> {
        self.text(path)?.trim().parse().ok()
    }

    /// The CPU list that a file consists of.
    pub(crate) fn list(&self, path: &str) -> Option<CpuList> {
        CpuList::parse(&self.text(path)?)
    }

    /// Whether there is such a file or folder.
    pub(crate) fn has(&self, path: &str) -> bool {
        self.path(path).exists()
    }

    /// What is in a folder, by name; nothing if it cannot be read.
    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).into_iter().flatten().flatten();
        let mut names: Vec<_> =
            entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
        names.sort();
        names
    }

    /// Free bytes of the file system at a path.
    pub(crate) fn free_bytes(&self, path: &str) -> Option<u64> {
        (self.free_bytes)(&self.path(path))
    }

    /// What the kernel says of an interrupt.
    fn mobility(&self, number: u32) -> Mobility {
        (self.ask_mobility)(&self.path(&format!("/proc/irq/{number}/smp_affinity_list")))
    }

    /// Paths are written as a reader knows them, from the root.
    fn path(&self, path: &str) -> PathBuf {
        self.root.join(path.trim_start_matches('/'))
    }
}

fn free_bytes(path: &Path) -> Option<u64> {
    let space = rustix::fs::statvfs(path).ok()?;
    Some(space.f_bavail.saturating_mul(space.f_frsize))
}
