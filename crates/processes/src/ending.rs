//! The exit status of isochrone programs, for programs that start them.

use std::process::ExitCode;

/// The exit status of a program of isochrone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// It succeeded, 0.
    Done = 0,
    /// It ran and found something wrong, 1.
    Found = 1,
    /// The command line or a file is wrong, 2.
    Usage = 2,
    /// There was nothing to talk to, 3.
    Nobody = 3,
    /// The run says too little to judge, 4.
    Inconclusive = 4,
}

impl From<Ending> for ExitCode {
    fn from(ending: Ending) -> Self {
        Self::from(ending as u8)
    }
}
