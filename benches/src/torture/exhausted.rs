//! Machines that have too little of something, and how that comes about.

use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

use clap::ValueEnum;
use isochrone_testing::Process;
use rustix::process::Resource;

use super::moments::Moments;
use super::scene::Scene;

/// What there is too little of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scarcity {
    /// Shared memory is full.
    SharedMemory,
    /// The process may open no more files.
    Descriptors,
    /// The disk for state, journal and recording is full.
    Disk,
    /// No memory may be locked.
    LockedMemory,
    /// There is no /proc.
    NoProc,
}

impl Scarcity {
    /// Its name on the command line.
    pub(super) fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether it needs file systems of its own.
    pub(super) fn needs_namespace(self) -> bool {
        self != Self::Descriptors
    }

    /// Has there be little before a node starts: the words before the program that bring that about.
    pub(super) fn before_start(
        self,
        scene: &Scene,
        moments: &mut Moments,
    ) -> Result<Vec<String>, String> {
        let limited = |option: &str, most: u64| {
            let script = format!("ulimit {option} {most}; exec \"$0\" \"$@\"");
            Ok(vec!["sh".to_owned(), "-c".to_owned(), script])
        };
        match self {
            Self::SharedMemory => mount("/dev/shm", moments.of(1..12_000)).map(|()| Vec::new()),
            // With fewer, the system does not even load the program.
            Self::Descriptors => limited("-n", moments.of(4..70)),
            Self::Disk => {
                let folder = scene.path("disk");
                let _ = fs::create_dir(&folder);
                let _ = unmount(&folder.display().to_string());
                mount(&folder.display().to_string(), moments.of(1..300)).map(|()| Vec::new())
            }
            Self::LockedMemory => limited("-l", moments.of(0..4_096)),
            Self::NoProc => mount("/proc", 1_024).map(|()| Vec::new()),
        }
    }

    /// Puts back what `before_start` did, so that a node can start.
    pub(super) fn after_start(self, scene: &Scene) -> Result<(), String> {
        match self {
            Self::SharedMemory => mount("/dev/shm", 64 << 10),
            Self::Disk => {
                let folder = scene.path("disk").display().to_string();
                unmount(&folder)?;
                mount(&folder, 1_024)
            }
            _ => Ok(()),
        }
    }

    /// Takes from a node that runs what it may need.
    pub(super) fn begin(self, scene: &Scene, node: &Process) -> Result<(), String> {
        match self {
            Self::SharedMemory => fill("/dev/shm/fill"),
            Self::Disk => fill(&scene.path("disk/fill").display().to_string()),
            Self::Descriptors => {
                node.limit(Resource::Nofile, Some(3));
                Ok(())
            }
            Self::LockedMemory => {
                node.limit(Resource::Memlock, Some(0));
                Ok(())
            }
            Self::NoProc => Ok(()),
        }
    }

    /// Gives it back.
    pub(super) fn end(self, scene: &Scene, node: &Process) -> Result<(), String> {
        let remove = |file: &str| fs::remove_file(file).map_err(|error| error.to_string());
        match self {
            Self::SharedMemory => remove("/dev/shm/fill"),
            Self::Disk => remove(&scene.path("disk/fill").display().to_string()),
            Self::Descriptors => {
                node.limit(Resource::Nofile, None);
                Ok(())
            }
            Self::LockedMemory | Self::NoProc => Ok(()),
        }
    }
}

/// A file system in memory, of so many KiB.
fn mount(place: &str, size_kib: u64) -> Result<(), String> {
    run("mount", &["-t", "tmpfs", "-o", &format!("size={size_kib}k"), "tmpfs", place])
}

fn unmount(place: &str) -> Result<(), String> {
    run("umount", &[place])
}

fn run(program: &str, arguments: &[&str]) -> Result<(), String> {
    let output = Command::new(program).args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    output.status.success().then_some(()).ok_or_else(|| format!("{program}: {said}"))
}

/// Writes a file until its file system is full.
fn fill(path: &str) -> Result<(), String> {
    let mut file = fs::File::create(path).map_err(|error| format!("{path}: {error}"))?;
    for size in [64 << 10, 1] {
        while file.write_all(&vec![1; size]).is_ok() {}
    }
    Ok(())
}
