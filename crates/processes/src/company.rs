//! Several processes of one program that belong together, in an iceoryx2 domain of their own.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isochrone_ipc::{DomainError, IsolatedDomain};

use crate::child::{Child, ChildError};

/// Why a [`Company`] cannot be created, or a file of it not written: what is missing, and what to do about it.
#[derive(thiserror::Error)]
#[error("{0}")]
pub struct CompanyError(String);

impl From<DomainError> for CompanyError {
    fn from(error: DomainError) -> Self {
        Self(error.to_string())
    }
}

/// An isolated iceoryx2 domain and its folder, for the processes that a program starts: they see
/// nothing else on the machine. Drop the processes before it.
#[derive(Debug)]
pub struct Company {
    program: PathBuf,
    domain: IsolatedDomain,
}

impl Company {
    /// Creates the domain, with a prefix that begins with `word`, for processes of this program.
    ///
    /// # Errors
    /// The domain cannot be created.
    pub fn gather(word: &str) -> Result<Self, CompanyError> {
        let program = std::env::current_exe().map_err(|cause| {
            CompanyError(format!("cannot find this program: {cause}; see that /proc is there"))
        })?;
        Ok(Self::of(program, IsolatedDomain::new(word)?))
    }

    /// Processes of `program` in `domain`.
    pub fn of(program: PathBuf, domain: IsolatedDomain) -> Self {
        Self { program, domain }
    }

    /// The domain.
    pub fn domain(&self) -> &IsolatedDomain {
        &self.domain
    }

    /// A file in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.domain.folder().join(name)
    }

    /// Writes a file into the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, name: &str, text: &str) -> Result<(), CompanyError> {
        let path = self.path(name);
        std::fs::write(&path, text).map_err(|cause| {
            CompanyError(format!(
                "cannot write {}: {cause}; see that there is room",
                path.display()
            ))
        })
    }

    /// A command that runs the program in the folder.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        // A Ctrl-C of the terminal is for us; we end the children in order.
        command.args(arguments).current_dir(self.domain.folder()).process_group(0);
        command
    }

    /// The arguments that make the program join the domain.
    pub fn in_domain(&self) -> [String; 2] {
        ["--iceoryx2-config".into(), self.domain.file().display().to_string()]
    }

    /// Starts a verb of the program in the folder and the domain, with stdout piped.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start(&self, arguments: &[&str]) -> Result<Child, ChildError> {
        self.start_with(arguments, |command| command.args(self.in_domain()).stdin(Stdio::null()))
    }

    /// Starts a verb of the program in the folder as `set_up` modifies it, with stdout piped.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start_with(
        &self,
        arguments: &[&str],
        set_up: impl FnOnce(&mut Command) -> &mut Command,
    ) -> Result<Child, ChildError> {
        let verb = arguments.first().copied().unwrap_or_default();
        let mut command = self.command(arguments);
        Child::start(format!("`isochrone {verb}`"), set_up(command.stdout(Stdio::piped())))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.domain.folder()
    }
}

isochrone_model::debug_as_display!(CompanyError);
