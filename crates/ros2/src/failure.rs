//! How the program ends when it does not end well: an exit status and sentences on stderr.

use std::process::ExitCode;

use isochrone_engine::{Diagnostics, Excerpts, escaped_lines};
use isochrone_processes::Ending;
use miette::Report;

/// The program's failure.
#[derive(Debug)]
pub(crate) struct Failure {
    status: Ending,
    report: Report,
}

impl Failure {
    /// It ran and found something wrong: exit status 1.
    pub(crate) fn found(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Found, report: sentence(what) }
    }

    /// The command line or a file is wrong: exit status 2.
    pub(crate) fn usage(what: impl std::fmt::Display) -> Self {
        Self { status: Ending::Usage, report: sentence(what) }
    }

    /// The configuration has errors: exit status 2, with each of them shown in the file.
    pub(crate) fn configuration(diagnostics: Diagnostics) -> Self {
        Self { status: Ending::Usage, report: Report::new(Excerpts::from(diagnostics)) }
    }

    /// Says it on stderr.
    pub(crate) fn tell(&self) -> ExitCode {
        crate::terminal::note(&format!("Error: {:?}", self.report));
        self.status.into()
    }
}

/// Says on stderr what a configuration is to be warned of.
pub(crate) fn warn(diagnostics: Diagnostics) {
    crate::terminal::note(&format!("{:?}", Report::new(Excerpts::from(diagnostics))));
}

fn sentence(what: impl std::fmt::Display) -> Report {
    Report::msg(escaped_lines(&what.to_string()).into_owned())
}
