//! Background load, by stress-ng.

use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::Failure;

/// What else the machine does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Load {
    /// Nothing
    Idle,
    /// A busy process for each CPU
    Cpu,
    /// Mapping, writing and unmapping memory
    Vm,
    /// Writing files and syncing them
    Io,
    /// Starting processes
    Fork,
}

/// How long it takes until all of its processes are at work.
const SETTLING: Duration = Duration::from_millis(500);

impl Load {
    pub(super) const fn as_str(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Cpu => "cpu",
            Self::Vm => "vm",
            Self::Io => "io",
            Self::Fork => "fork",
        }
    }

    /// Arguments of stress-ng; a count of 0 is one for each CPU.
    const fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Idle => &[],
            Self::Cpu => &["--cpu", "0"],
            Self::Vm => &["--vm", "1", "--vm-bytes", "256M"],
            Self::Io => &["--io", "1", "--hdd", "1", "--hdd-bytes", "64M"],
            Self::Fork => &["--fork", "1"],
        }
    }
}

/// Load that ends when it is dropped.
pub(super) struct Stress {
    child: Child,
    /// Where it writes.
    _folder: tempfile::TempDir,
}

impl Stress {
    /// Starts it; `None` for no load.
    pub(super) fn start(load: Load) -> Result<Option<Self>, Failure> {
        if load == Load::Idle {
            return Ok(None);
        }
        let failed = |error| {
            Failure::usage(format!(
                "--load {} needs stress-ng, which cannot be started: {error}\n\
                 remedy: install it (Debian: apt-get install stress-ng)",
                load.as_str()
            ))
        };
        let folder = tempfile::tempdir().map_err(failed)?;
        let mut child = Command::new("stress-ng")
            .args(load.arguments())
            .arg("--quiet")
            .arg("--temp-path")
            .arg(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(failed)?;
        thread::sleep(SETTLING);
        if let Ok(Some(status)) = child.try_wait() {
            return Err(Failure::found(format!("stress-ng ended at once, with {status}")));
        }
        Ok(Some(Self { child, _folder: folder }))
    }
}

impl Drop for Stress {
    fn drop(&mut self) {
        // SIGKILL would leave its workers behind.
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
        let _ = self.child.wait();
    }
}
