//! The program: `isochrone`, or one with blocks, verbs, a name and a version of its own.

use std::error::Error;
use std::ffi::OsStr;
use std::path::Path;
use std::sync::OnceLock;

use clap::{Arg, ArgMatches, Command};
use isochrone_blocks::{BlockType, CATALOGUE};
use isochrone_machine::Environment;
use isochrone_report::{ProgramVersion, Report};

use crate::failure::Failure;
use crate::logging;

const ISOCHRONE: &str = "isochrone";

/// A program with every verb of `isochrone`, and with blocks and verbs of its own.
///
/// ```no_run
/// use isochrone_cli::{Program, clap::Command};
///
/// fn main() -> std::process::ExitCode {
///     let hello = Command::new("hello").about("Say hello");
///     Program::new("plant", env!("CARGO_PKG_VERSION"))
///         .verb(hello, |_| {
///             println!("hello");
///             Ok(())
///         })
///         .main()
/// }
/// ```
///
/// `plant --version` then says `plant 0.1.0 (isochrone 0.1.0)`, reports have its name and version as
/// `program`, and `plant hello` runs its own verb. Help and examples call it by the name of its file.
#[derive(Debug, Clone, Default)]
pub struct Program {
    version: Option<ProgramVersion>,
    blocks: Vec<BlockType>,
    verbs: Vec<OwnVerb>,
}

/// The function of a verb of the program's own.
type RunVerb = fn(&ArgMatches) -> Result<(), Box<dyn Error>>;

#[derive(Debug, Clone)]
struct OwnVerb {
    command: Command,
    run: RunVerb,
}

/// What runs, for reports and completions.
static PROGRAM: OnceLock<Program> = OnceLock::new();

impl Program {
    /// A program with the verbs and blocks of `isochrone`, under a name and a version of its own.
    pub fn new(name: impl Into<String>, version: impl Into<String>) -> Self {
        let version = ProgramVersion { name: name.into(), version: version.into() };
        Self { version: Some(version), ..Self::default() }
    }

    /// Adds block types that configurations may name.
    #[must_use]
    pub fn blocks(mut self, blocks: &[BlockType]) -> Self {
        self.blocks.extend_from_slice(blocks);
        self
    }

    /// Adds a verb, which stands in the help behind those of `isochrone`. If it fails, the program writes the
    /// error to stderr and ends with exit status 1.
    #[must_use]
    pub fn verb(mut self, command: Command, run: RunVerb) -> Self {
        self.verbs.push(OwnVerb { command, run });
        self
    }

    /// The library's blocks, then the program's own.
    pub(crate) fn catalogue(&self) -> Result<Vec<BlockType>, Failure> {
        let mut catalogue = CATALOGUE.to_vec();
        for block in &self.blocks {
            if catalogue.iter().any(|known| known.name == block.name) {
                return Err(twice("block types", block.name));
            }
            catalogue.push(*block);
        }
        Ok(catalogue)
    }

    /// Checks that no verb of its own has the name of another or of one in `known`.
    pub(crate) fn check_verbs(&self, mut known: Command) -> Result<(), Failure> {
        if self.verbs.is_empty() {
            return Ok(());
        }
        // Otherwise `help` is missing.
        known.build();
        for OwnVerb { command, .. } in &self.verbs {
            if known.find_subcommand(command.get_name()).is_some() {
                return Err(twice("verbs", command.get_name()));
            }
            known = known.subcommand(command.clone());
        }
        Ok(())
    }

    /// Runs a verb of its own, if the command line names one.
    pub(crate) fn run_own(&self, matches: &ArgMatches) -> Option<Result<(), Failure>> {
        let (name, of_verb) = matches.subcommand()?;
        let OwnVerb { run, .. } = self.verbs.iter().find(|own| own.command.get_name() == name)?;
        logging::set_up(of_verb.get_count("verbose"));
        Some(run(of_verb).map_err(Failure::found))
    }

    /// The command line of `isochrone` and its own, with the name of the program wherever it is called.
    pub(crate) fn command(&self, of_isochrone: Command) -> Command {
        let name = name();
        let command = lenient(of_isochrone);
        let command = if name == ISOCHRONE { command } else { renamed(command, &name).name(name) };
        let own = self.verbs.iter().map(|own| own.command.clone());
        let command = command.subcommands(own);
        match &self.version {
            Some(ProgramVersion { name, version }) => {
                let ours = env!("CARGO_PKG_VERSION");
                command.display_name(name).version(format!("{version} (isochrone {ours})"))
            }
            None => command,
        }
    }
}

fn twice(what: &str, name: &str) -> Failure {
    Failure::usage(format!("this program has two {what} \"{name}\"; give its own another name"))
}

/// A report of a run that starts now.
pub(crate) fn report() -> Report {
    let program = PROGRAM.get().and_then(|program| program.version.clone());
    Report { program, ..Report::new(arguments(), Environment::read()) }
}

/// Has a program run, if none does yet.
pub(crate) fn begin(program: Program) -> &'static Program {
    PROGRAM.get_or_init(|| program)
}

/// The command line of the program, for a report. Names of files may not be valid Unicode.
fn arguments() -> Vec<String> {
    std::env::args_os().skip(1).map(|it| it.to_string_lossy().into_owned()).collect()
}

/// The name that the program was started by.
pub(crate) fn name() -> String {
    named(std::env::args_os().next().as_deref())
}

/// A verb and those below it, whose options that take a negative number take one with a unit too (`-5ms`): what is
/// wrong with it is then said in the words of the option.
fn lenient(command: Command) -> Command {
    let takes_hyphens = |arg: Arg| {
        let is_lenient = arg.is_allow_negative_numbers_set();
        if is_lenient { arg.allow_hyphen_values(true) } else { arg }
    };
    command.mut_args(takes_hyphens).mut_subcommands(lenient)
}

/// The name in the first word of a command line, if shells take it for a word too.
fn named(program: Option<&OsStr>) -> String {
    let name = program.and_then(|path| Path::new(path).file_name()?.to_str());
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    name.filter(|name| name.chars().all(is_plain)).unwrap_or(ISOCHRONE).to_owned()
}

/// A verb and those below it, with another name of the program in their examples.
fn renamed(command: Command, name: &str) -> Command {
    let examples = command.get_after_help().map(|it| it.to_string().replace(ISOCHRONE, name));
    let command = match examples {
        Some(examples) => command.after_help(examples),
        None => command,
    };
    command.mut_subcommands(|below| renamed(below, name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_called_what_its_file_is_called() {
        for (program, expected) in [
            (Some("/usr/bin/isochrone"), "isochrone"),
            (Some("target/debug/own_blocks"), "own_blocks"),
            (Some("plant-7.1"), "plant-7.1"),
            (Some("my plant"), "isochrone"),
            (Some(""), "isochrone"),
            (None, "isochrone"),
        ] {
            assert_eq!(named(program.map(OsStr::new)), expected);
        }
    }
}
