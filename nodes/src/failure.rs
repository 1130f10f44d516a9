//! How a verb ends when it does not end well: an exit status and sentences on stderr.

use std::io;
use std::process::ExitCode;

use isochrone_bench::BenchError;
use isochrone_engine::{Diagnostics, Excerpts, escaped_lines};
use isochrone_ipc::thread_remedy;
use isochrone_processes::{ChildError, CompanyError, Ending, StopError};
use miette::Report;

/// A verb's failure.
#[derive(Debug)]
pub(crate) struct Failure {
    status: Ending,
    /// The message; `None` if there is no one to read it.
    report: Option<Report>,
}

impl Failure {
    /// It ran and found something wrong: exit status 1.
    pub(crate) fn found(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Found, report: Some(sentence(what)) }
    }

    /// A thread could not be started: exit status 1.
    pub(crate) fn thread(cause: io::Error) -> Self {
        Self::found(format!("cannot start a thread: {cause}; {}", thread_remedy()))
    }

    /// The command line or a file is wrong: exit status 2.
    pub(crate) fn usage(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Usage, report: Some(sentence(what)) }
    }

    /// A configuration has errors: exit status 2, with each of them shown in the file.
    pub(crate) fn configuration(diagnostics: Diagnostics) -> Self {
        Self { status: Ending::Usage, report: Some(Report::new(Excerpts::from(diagnostics))) }
    }

    /// There is nothing to talk to: exit status 3.
    pub(crate) fn nobody(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Nobody, report: Some(sentence(what)) }
    }

    /// The run says too little to judge: exit status 4.
    pub(crate) fn inconclusive(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Inconclusive, report: Some(sentence(what)) }
    }

    /// The reader of stdout has closed it (`| head`): the verb ends silently, exit status 0.
    pub(crate) fn reader_left() -> Self {
        Self { status: Ending::Done, report: None }
    }

    /// The same, with what was done before.
    pub(crate) fn after(self, done: &str) -> Self {
        let with_cause = |report: Report| sentence(format_args!("{done}, but {report}"));
        Self { report: self.report.map(with_cause), ..self }
    }

    /// The diagnostics of the configuration, if those are the failure.
    pub(crate) fn diagnostics(&self) -> Option<&Diagnostics> {
        self.report.as_ref()?.downcast_ref().map(Excerpts::diagnostics)
    }

    /// The message, if there is one.
    pub(crate) fn report(&self) -> Option<&Report> {
        self.report.as_ref()
    }

    /// The exit status.
    pub(crate) fn status(&self) -> ExitCode {
        self.status.into()
    }
}

impl From<BenchError> for Failure {
    fn from(error: BenchError) -> Self {
        match error {
            BenchError::Configuration(diagnostics) => Self::configuration(diagnostics),
            error @ BenchError::Usage(_) => Self::usage(error),
            error => Self::found(error),
        }
    }
}

impl From<StopError> for Failure {
    fn from(error: StopError) -> Self {
        Self::found(error)
    }
}

impl From<ChildError> for Failure {
    fn from(error: ChildError) -> Self {
        Self::found(error)
    }
}

impl From<CompanyError> for Failure {
    fn from(error: CompanyError) -> Self {
        Self::found(error)
    }
}

fn sentence(what: impl std::fmt::Display) -> Report {
    Report::msg(escaped_lines(&what.to_string()).into_owned())
}
