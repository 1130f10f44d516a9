//! Background load, by stress-ng.

use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use isochrone_processes::Child;

use crate::BenchError;

/// What else the machine does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Load {
    /// Nothing
    Idle,
    /// One busy process per CPU
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
    /// Its name on the command line and in reports.
    pub const fn as_str(self) -> &'static str {
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
    load: Load,
    program: Child,
    /// Where it writes.
    _folder: tempfile::TempDir,
}

impl Stress {
    /// Starts it; `None` for no load. It ends with this process, should that be killed; where there is
    /// no `setpriv` (util-linux), by itself after `longest`.
    pub(super) fn start(load: Load, longest: Duration) -> Result<Option<Self>, BenchError> {
        if load == Load::Idle {
            return Ok(None);
        }
        let folder = tempfile::tempdir()
            .map_err(|error| BenchError::no_file("a folder for stress-ng", error))?;
        let mut command = command();
        command
            .args(load.arguments())
            .arg("--quiet")
            .arg(format!("--timeout={}s", longest.as_secs() + 1))
            .arg("--temp-path")
            .arg(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        let program = Child::start("stress-ng", &mut command).map_err(|cause| {
            BenchError::Usage(format!(
                "--load {} needs stress-ng: {cause}\n\
                     remedy: install it (Debian: apt-get install stress-ng)",
                load.as_str()
            ))
        })?;
        let mut stress = Self { load, program, _folder: folder };
        thread::sleep(SETTLING);
        stress.check()?;
        Ok(Some(stress))
    }

    /// Fails if it is over: what is measured from then on is not under that load.
    pub(super) fn check(&mut self) -> Result<(), BenchError> {
        let load = self.load.as_str();
        let Err(error) = self.program.check() else { return Ok(()) };
        let arguments = self.load.arguments().join(" ");
        Err(BenchError::Failed(format!(
            "--load {load}: {error}, while it was still needed; what was measured is not under that \
             load\nremedy: see what is wrong with \"stress-ng {arguments}\", such as too little memory \
             or disk space"
        )))
    }
}

/// stress-ng, which the kernel ends with this process if `setpriv` can ask for that: between fork and
/// exec it cannot be asked for here, where memory may be locked.
fn command() -> Command {
    const WITH_PARENT: [&str; 3] = ["--pdeathsig", "TERM", "stress-ng"];
    let mut command = Command::new("setpriv");
    command.args(WITH_PARENT);
    let mut probe = Command::new("setpriv");
    probe.args(WITH_PARENT).arg("--version").stdout(Stdio::null()).stderr(Stdio::null());
    if probe.status().is_ok_and(|status| status.success()) {
        command
    } else {
        Command::new("stress-ng")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stress(command: &mut Command) -> Stress {
        let program = Child::start("stress-ng", command).unwrap();
        Stress { load: Load::Vm, program, _folder: tempfile::tempdir().unwrap() }
    }

    #[test]
    fn a_load_that_still_runs_is_fine() {
        assert!(stress(Command::new("sleep").arg("60")).check().is_ok());
    }

    #[test]
    fn a_load_that_is_over_too_early_is_a_failure_even_if_it_ended_well() {
        let mut stress = stress(&mut Command::new("true"));
        let failure = loop {
            match stress.check() {
                Ok(()) => thread::sleep(Duration::from_millis(1)),
                Err(failure) => break failure.to_string(),
            }
        };
        assert!(failure.contains("--load vm") && failure.contains("exit status: 0"), "{failure}");
    }
}
