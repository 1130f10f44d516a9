//! `completions`: shell completions.

use clap_complete::Shell;

use crate::failure::Failure;
use crate::terminal;

/// Print a completion script for a shell
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone completions bash > ~/.local/share/bash-completion/completions/isochrone\n  \
    isochrone completions zsh > \"${fpath[1]}/_isochrone\"\n  isochrone completions fish > ~/.config/fish/completions/isochrone.fish"
)]
pub(crate) struct Args {
    /// Shell to complete in
    #[arg(value_enum)]
    shell: Shell,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut crate::command(), "isochrone", &mut script);
    terminal::print(&String::from_utf8_lossy(&script))
}
