//! The name of the program: `isochrone`, or that of one with blocks of its own.

use std::ffi::OsStr;
use std::path::Path;

use clap::{Arg, Command};

const ISOCHRONE: &str = "isochrone";

/// What the program was started with, for a report. Names of files may be no Unicode.
pub(crate) fn arguments() -> Vec<String> {
    std::env::args_os().skip(1).map(|it| it.to_string_lossy().into_owned()).collect()
}

/// The name that the program was started by.
pub(crate) fn name() -> String {
    named(std::env::args_os().next().as_deref())
}

/// The command line, with the name of the program wherever it is called.
pub(crate) fn command() -> Command {
    let name = name();
    let command = lenient(crate::command());
    if name == ISOCHRONE { command } else { renamed(command, &name).name(name) }
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
