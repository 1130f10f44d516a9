//! `completions`: shell completions.

mod arguments;
mod bash;
mod fish;
mod zsh;

use clap_complete::Shell;

use crate::failure::Failure;
use crate::{Program, program, terminal};

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
    let program = program::begin(Program::default());
    let mut command = program.command(crate::command());
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
