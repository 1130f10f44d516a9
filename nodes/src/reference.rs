//! The reference page of the command line, docs/cli.md: from clap, so that it says what the program
//! takes.

use clap::{Arg, Command};

use crate::failure::Failure;
use crate::terminal;

/// Print the reference page of all verbs, docs/cli.md
#[derive(clap::Args)]
#[command(hide = true)]
pub(crate) struct Args {}

pub(crate) fn run(_args: &Args) -> Result<(), Failure> {
    terminal::print(&page())
}

/// The page.
fn page() -> String {
    let mut command = crate::command();
    // Otherwise what is inherited is missing.
    command.build();
    let mut text = format!(
        "# Command line\n\n<!-- The output of `isochrone reference`: change the help, not this page. -->\n\n{}",
        about(&command)
    );
    text += &arguments(&command);
    text += &after_help(&command);
    text += "\n| verb | does |\n|---|---|\n";
    for verb in shown(&command) {
        text += &format!("| [`{0}`](#{0}) | {1} |\n", verb.get_name(), cell(&summary(verb)));
    }
    for verb in shown(&command) {
        section(&mut text, verb, 2);
    }
    text
}

/// A verb, and the verbs below it.
fn section(text: &mut String, command: &Command, level: usize) {
    let name = command.get_bin_name().unwrap_or_default();
    let name = name.strip_prefix("isochrone ").unwrap_or(name);
    *text += &format!("\n{} {name}\n\n", "#".repeat(level));
    *text += &about(command);
    let usage = command.clone().render_usage().to_string();
    *text += &format!("\n```text\n{}\n```\n", usage.trim_start_matches("Usage: ").trim());
    *text += &arguments(command);
    *text += &after_help(command);
    for below in shown(command) {
        section(text, below, level + 1);
    }
}

fn shown(command: &Command) -> impl Iterator<Item = &Command> {
    command.get_subcommands().filter(|verb| !verb.is_hide_set() && verb.get_name() != "help")
}

fn summary(command: &Command) -> String {
    command.get_about().map(ToString::to_string).unwrap_or_default()
}

fn about(command: &Command) -> String {
    let about = command.get_long_about().or(command.get_about());
    let mut paragraphs = about.map(ToString::to_string).unwrap_or_default();
    // The first paragraph is a title without a full stop.
    if let Some(end) = paragraphs.find("\n\n") {
        paragraphs.insert(end, '.');
    } else if !paragraphs.is_empty() {
        paragraphs.push('.');
    }
    paragraphs + "\n"
}

fn arguments(command: &Command) -> String {
    let is_shown = |argument: &&Arg| {
        let name = argument.get_id().as_str();
        let is_inherited = argument.is_global_set() && command.get_name() != "isochrone";
        !argument.is_hide_set() && !["help", "version"].contains(&name) && !is_inherited
    };
    let mut arguments: Vec<&Arg> = command.get_arguments().filter(is_shown).collect();
    arguments.sort_by_key(|argument| !argument.is_positional());
    if arguments.is_empty() {
        return String::new();
    }
    let rows = arguments.into_iter().map(row).collect::<String>();
    format!("\n| argument | default | meaning |\n|---|---|---|\n{rows}")
}

fn row(argument: &Arg) -> String {
    let values = argument.get_value_names().unwrap_or_default();
    let values = values.iter().map(|name| format!("<{name}>")).collect::<Vec<_>>().join(" ");
    let takes_values = argument.get_action().takes_values();
    let flag = match (argument.get_short(), argument.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long}"),
        (None, Some(long)) => format!("--{long}"),
        _ => String::new(),
    };
    let name = match (flag.as_str(), takes_values) {
        ("", _) => values,
        (flag, true) => format!("{flag} {values}"),
        (flag, false) => flag.to_owned(),
    };
    let default = argument.get_default_values().iter().map(|value| value.to_string_lossy());
    let default = default.collect::<Vec<_>>().join(",");
    let default = match (default.as_str(), argument.is_required_set()) {
        ("", true) => "required".to_owned(),
        ("", false) => String::new(),
        (default, _) if takes_values => format!("`{default}`"),
        _ => String::new(),
    };
    let help = argument.get_long_help().or(argument.get_help());
    let mut help = help.map(ToString::to_string).unwrap_or_default();
    let choices = argument.get_possible_values();
    if takes_values && choices.iter().any(|choice| choice.get_help().is_some()) {
        let choice = |choice: &clap::builder::PossibleValue| {
            let help = choice.get_help().map(ToString::to_string).unwrap_or_default();
            format!("`{}`: {help}", choice.get_name())
        };
        help += &format!(". {}", choices.iter().map(choice).collect::<Vec<_>>().join("; "));
    } else if takes_values && !choices.is_empty() {
        let names = choices.iter().map(|choice| format!("`{}`", choice.get_name()));
        help += &format!(". One of {}", names.collect::<Vec<_>>().join(", "));
    }
    format!("| `{name}` | {default} | {} |\n", cell(&help))
}

/// The part of the help after the arguments: examples and further notes.
fn after_help(command: &Command) -> String {
    let help = command.get_after_long_help().or(command.get_after_help());
    let Some(help) = help.map(ToString::to_string) else { return String::new() };
    let mut text = String::new();
    let mut is_code = false;
    for line in help.lines() {
        let is_example = line.starts_with("  ");
        if is_example != is_code {
            text += if is_example { "\n```sh\n" } else { "```\n" };
            is_code = is_example;
        }
        match (line, is_example) {
            (line, true) => text += &format!("{}\n", line.trim()),
            ("Examples:", false) => {}
            ("", false) => {}
            (line, false) => text += &format!("\n{line}\n"),
        }
    }
    if is_code {
        text += "```\n";
    }
    text
}

/// A text as a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
