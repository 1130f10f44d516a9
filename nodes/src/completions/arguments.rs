//! Which arguments are names that only a running program knows, and which flags have a value.

use clap::{Arg, Command};

/// A positional argument after the name of a node, and what it can be.
pub(super) struct OfNode {
    pub(super) argument: &'static str,
    /// The verb that prints the names if it is given the node, with its flags.
    pub(super) verb: &'static str,
    pub(super) flags: &'static str,
    /// What follows a name.
    pub(super) suffix: &'static str,
}

pub(super) const OF_NODE: [OfNode; 5] = [
    OfNode { argument: "patterns", verb: "show", flags: "--names", suffix: "" },
    OfNode { argument: "names", verb: "show", flags: "--names", suffix: "" },
    OfNode { argument: "parameters", verb: "show", flags: "--names --parameters", suffix: "=" },
    OfNode { argument: "assignments", verb: "show", flags: "--names --forceable", suffix: "=" },
    OfNode { argument: "forced", verb: "forces", flags: "--names", suffix: "" },
];

/// The verbs with a positional argument of this name.
pub(super) fn verbs_with<'c>(argument: &str, command: &'c Command) -> Vec<&'c str> {
    let has = |verb: &&Command| verb.get_positionals().any(|found| found.get_id() == argument);
    command.get_subcommands().filter(has).map(Command::get_name).collect()
}

/// The flags that are followed by a value.
pub(super) fn flags_with_value(command: &Command) -> Vec<String> {
    let takes_value = |argument: &&Arg| argument.get_action().takes_values();
    let flags = command.get_subcommands().flat_map(|verb| verb.get_arguments().filter(takes_value));
    let forms = flags.flat_map(|flag| {
        let short = flag.get_short().map(|short| format!("-{short}"));
        short.into_iter().chain(flag.get_long().map(|long| format!("--{long}")))
    });
    let mut forms: Vec<String> = forms.collect();
    forms.sort_unstable();
    forms.dedup();
    forms
}
