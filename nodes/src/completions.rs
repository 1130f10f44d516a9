//! `completions`: shell completions.

mod bash;
mod fish;
mod zsh;

use clap::{Arg, Command};
use clap_complete::Shell;

use crate::failure::Failure;
use crate::{program, terminal};

/// Print a completion script for a shell
///
/// In bash, zsh and fish, the names of existing services, of running nodes and of their signals are
/// completed too, and configuration files by their ending .toml. In bash, the file below is read only where
/// the package bash-completion is installed; `source` works everywhere, for instance in ~/.bashrc.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  source <(isochrone completions bash)\n  \
    mkdir -p ~/.local/share/bash-completion/completions\n  \
    isochrone completions bash > ~/.local/share/bash-completion/completions/isochrone\n  \
    isochrone completions zsh > \"${fpath[1]}/_isochrone\"\n  isochrone completions fish > ~/.config/fish/completions/isochrone.fish")]
pub(crate) struct Args {
    /// Shell to generate the script for
    #[arg(value_enum)]
    shell: Shell,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut command = program::command();
    let name = program::name();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, &name, &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    terminal::print(&match args.shell {
        Shell::Bash => script + &bash::script(&name, &command),
        Shell::Fish => script + &fish::script(&name, &command),
        Shell::Zsh => zsh::script(&name, &script),
        _ => script,
    })
}

/// A positional argument after the name of a node, and what it can be.
struct OfNode {
    argument: &'static str,
    /// The verb that prints the names if it is given the node, with its flags.
    verb: &'static str,
    flags: &'static str,
    /// What follows a name.
    suffix: &'static str,
}

const OF_NODE: [OfNode; 5] = [
    OfNode { argument: "patterns", verb: "show", flags: "--names", suffix: "" },
    OfNode { argument: "names", verb: "show", flags: "--names", suffix: "" },
    OfNode { argument: "parameters", verb: "show", flags: "--names --parameters", suffix: "=" },
    OfNode { argument: "assignments", verb: "show", flags: "--names --forceable", suffix: "=" },
    OfNode { argument: "forced", verb: "forces", flags: "--names", suffix: "" },
];

/// The verbs with a positional argument of this name.
fn verbs_with<'c>(argument: &str, command: &'c Command) -> Vec<&'c str> {
    let has = |verb: &&Command| verb.get_positionals().any(|found| found.get_id() == argument);
    command.get_subcommands().filter(has).map(Command::get_name).collect()
}

/// The flags that are followed by a value.
fn flags_with_value(command: &Command) -> Vec<String> {
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
