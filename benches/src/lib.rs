//! What the benches share: the real program, run as a user would, in an iceoryx2 domain of its own;
//! and the engine of a workload.
//!
//! The benches are in `benches/`: `cargo bench -p isochrone-benches --bench NAME`.

pub mod crash_points;
mod program;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use isochrone_engine::{Plan, Rules, TaskEngine, Workload};
use isochrone_ipc::IsolatedDomain;
use isochrone_processes::Child;
use isochrone_report::{Report, turn_order};

pub use program::{Profile, build, find};

/// A failure that ends a bench, as a sentence.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A folder with configurations and reports, and an iceoryx2 domain, of which nothing is left when it
/// is dropped.
#[derive(Debug)]
pub struct Bench {
    program: PathBuf,
    domain: IsolatedDomain,
}

impl Bench {
    /// Builds the program in this profile.
    ///
    /// # Errors
    /// It cannot be built, or there is no place for the folder.
    pub fn new(profile: Profile) -> Result<Self, Failure> {
        Ok(Self { program: build(profile)?, domain: IsolatedDomain::new("bench")? })
    }

    /// The domain of the bench.
    pub fn domain(&self) -> &IsolatedDomain {
        &self.domain
    }

    /// A file in the bench's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.domain.folder().join(name)
    }

    /// The program in the bench's domain, behind a command that changes its rights, if one is
    /// given. Arguments are separated by spaces.
    pub fn command(&self, wrapper: &[&str], arguments: &str) -> Command {
        let mut command = match wrapper {
            [] => Command::new(&self.program),
            [first, rest @ ..] => {
                let mut command = Command::new(first);
                command.args(rest).arg(&self.program);
                command
            }
        };
        command.args(arguments.split(' ')).arg("--iceoryx2-config").arg(self.domain.file());
        command.current_dir(self.domain.folder()).stdin(Stdio::null()).stdout(Stdio::null());
        command.stderr(Stdio::null());
        command
    }

    /// Starts a node of this configuration for `seconds`.
    ///
    /// # Errors
    /// The configuration cannot be written, or the program not started.
    pub fn start(&self, node: &str, seconds: f64) -> Result<Running, Failure> {
        fs::write(self.path("node.toml"), node)?;
        let report = self.path("report.json");
        let _ = fs::remove_file(&report);
        let log = self.path("log");
        let arguments = format!("run node.toml --seconds {seconds} --report report.json");
        let mut command = self.command(&[], &arguments);
        command.stderr(fs::File::create(&log)?);
        Ok(Running { child: Child::start("isochrone", &mut command)?, report, log })
    }
}

/// The program, while it runs a node.
#[derive(Debug)]
pub struct Running {
    child: Child,
    report: PathBuf,
    log: PathBuf,
}

impl Running {
    /// Waits for its end, and returns its report.
    ///
    /// # Errors
    /// It failed.
    pub fn report(mut self) -> Result<Report, Failure> {
        let status = self.child.wait()?;
        if !status.success() {
            let said = fs::read_to_string(&self.log)?;
            return Err(format!("the program ended with {status}: {said}").into());
        }
        Ok(serde_json::from_str(&fs::read_to_string(&self.report)?)?)
    }
}

/// Lets the arms take their turns, in [`turn_order`].
///
/// # Errors
/// A turn failed; the rest is not run.
pub fn take_turns<A>(
    rounds: usize,
    arms: &mut [A],
    mut turn: impl FnMut(&mut A) -> Result<(), Failure>,
) -> Result<(), Failure> {
    for (round, arm) in turn_order(rounds, arms.len()) {
        arms.get_mut(arm).map_or(Ok(()), &mut turn)?;
        eprintln!("round {} of {rounds}", round + 1);
    }
    Ok(())
}

/// A time in ns in a column of a table, in microseconds.
pub fn us(ns: u64) -> String {
    format!("{:.3}", ns as f64 / 1e3)
}

/// The engine of a task with so many instances.
///
/// # Errors
/// There cannot be so many.
pub fn engine(workload: &Workload, instances: usize) -> Result<TaskEngine, Failure> {
    let plan = Plan::new(workload.source(instances), &Rules::default())?;
    TaskEngine::build(&plan)?.pop().ok_or_else(|| "the workload has no task".into())
}
