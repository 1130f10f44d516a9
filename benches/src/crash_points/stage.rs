//! The stage at which a process is struck, and its name in messages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_ipc::IsolatedDomain;

use super::litter::litter;
use super::point::{Blow, Point};
use super::roles::{NODE, SECOND_NODE};
use crate::Failure;

/// A folder of files in memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// How long the stage may take to be set, on a machine that is busy: nothing is demanded yet.
pub(super) const SET_WITHIN: Duration = Duration::from_secs(60);

/// The program and what is demanded of it.
#[derive(Debug)]
pub struct Stage {
    pub(super) program: PathBuf,
    pub(super) within: Duration,
    /// What an undisturbed publisher, node and subscriber leave.
    pub(super) usual_litter: Vec<String>,
}

/// What came of one point.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The point.
    pub point: Point,
    /// What happened there.
    pub blow: Blow,
    /// Whether all was well.
    pub verdict: Verdict,
    /// From the start of the fresh processes, or from SIGCONT, until frames flowed; not if they did not.
    pub recovered: Option<Duration>,
}

/// Whether all was well.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It was.
    Pass,
    /// It was not, and why.
    Fail(Vec<String>),
    /// The process never came there: what it does depends on the instant.
    NotReached,
}

/// What was found at a point, until the verdict is known.
#[derive(Debug, Default)]
pub(super) struct Findings {
    pub(super) wrong: Vec<String>,
    pub(super) recovered: Option<Duration>,
}

impl Findings {
    /// Keeps what is wrong, and says whether all is well.
    pub(super) fn take(&mut self, found: Result<(), String>) -> bool {
        let is_well = found.is_ok();
        self.wrong.extend(found.err());
        is_well
    }
}

impl Stage {
    /// Within which time frames are to flow.
    pub fn within(&self) -> Duration {
        self.within
    }

    /// What an undisturbed publisher, node and subscriber leave.
    pub fn usual_litter(&self) -> &[String] {
        &self.usual_litter
    }

    /// The program in a domain, not started yet; arguments are separated by spaces.
    pub(super) fn command(&self, domain: &IsolatedDomain, arguments: &str) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments.split(' ')).arg("--iceoryx2-config").arg(domain.file());
        command.current_dir(domain.folder());
        command
    }

    /// A domain with the files that the processes read.
    pub(super) fn domain(&self) -> Result<IsolatedDomain, Failure> {
        // iceoryx2 has its files written to the disk when a service or a port is made, and on a disk
        // that others keep busy that takes seconds. These are in memory.
        let domain = IsolatedDomain::within(Path::new(SHARED_MEMORY), "bench")?;
        for node in [NODE, SECOND_NODE] {
            fs::write(domain.folder().join(node.file), node.config())?;
        }
        Ok(domain)
    }

    /// What is left in a domain beyond what always is.
    pub(super) fn check_litter(&self, domain: &IsolatedDomain) -> Result<(), String> {
        let mut usual = self.usual_litter.clone();
        let mut more = litter(domain);
        more.retain(|name| match usual.iter().position(|usual| usual == name) {
            Some(place) => {
                usual.remove(place);
                false
            }
            None => true,
        });
        match more.len() {
            0 => Ok(()),
            count => Err(format!("{count} files or folders are left: {}", more.join(", "))),
        }
    }

    /// Waits until something holds, for as long as frames may take.
    pub(super) fn wait_for(&self, holds: impl FnMut() -> bool) -> Option<Duration> {
        wait(self.within, holds)
    }
}

/// Waits until something holds, and says how long it took.
pub(super) fn wait(within: Duration, mut holds: impl FnMut() -> bool) -> Option<Duration> {
    let since = Instant::now();
    loop {
        if holds() {
            return Some(since.elapsed());
        }
        if since.elapsed() > within {
            return None;
        }
        thread::sleep(Duration::from_millis(2));
    }
}
