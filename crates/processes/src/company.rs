//! Several processes of one program that belong together, in an iceoryx2 domain of their own.

use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use isochrone_ipc::{DomainError, IsolatedDomain};

use crate::child::{Child, ChildError};

/// Why there is no [`Company`], or nothing for it to read.
#[derive(Debug, thiserror::Error)]
pub enum CompanyError {
    /// It has no domain.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// This program cannot be found again.
    #[error("cannot find this program: {cause}; see that /proc is there")]
    Program {
        /// What the system says.
        cause: io::Error,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {cause}; see that there is room")]
    File {
        /// The file.
        path: String,
        /// What the system says.
        cause: io::Error,
    },
}

/// Where processes of a program live: an iceoryx2 domain of its own and the folder that it is in, so
/// that they meet nothing else that runs on the machine. Drop the processes before.
#[derive(Debug)]
pub struct Company {
    program: PathBuf,
    domain: IsolatedDomain,
}

impl Company {
    /// Makes the domain, whose prefix begins with `word`, for processes of this very program.
    ///
    /// # Errors
    /// There is no place for the domain.
    pub fn gather(word: &str) -> Result<Self, CompanyError> {
        let program = std::env::current_exe().map_err(|cause| CompanyError::Program { cause })?;
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
    /// There is no room.
    pub fn write(&self, name: &str, text: &str) -> Result<(), CompanyError> {
        let path = self.path(name);
        let failed = |cause| CompanyError::File { path: path.display().to_string(), cause };
        std::fs::write(&path, text).map_err(failed)
    }

    /// The program in the folder, not started yet.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        // A Ctrl-C of the terminal is for us; we end the children in order.
        command.args(arguments).current_dir(self.domain.folder()).process_group(0);
        command
    }

    /// The arguments that lead the program into the domain.
    pub fn in_domain(&self) -> [String; 2] {
        ["--iceoryx2-config".into(), self.domain.file().display().to_string()]
    }

    /// Starts the program with a verb in the folder and the domain; what it prints is piped.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start(&self, arguments: &[&str]) -> Result<Child, ChildError> {
        self.start_with(arguments, |command| command.args(self.in_domain()).stdin(Stdio::null()))
    }

    /// Starts the program with a verb in the folder, as `set_up` has it; what it prints is piped.
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
