//! `completions`: shell completions.

use clap::{Arg, Command};
use clap_complete::Shell;

use crate::failure::Failure;
use crate::terminal;

/// Print a completion script for a shell
///
/// In bash, zsh and fish, the names of existing services are completed too.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone completions bash > ~/.local/share/bash-completion/completions/isochrone\n  \
    isochrone completions zsh > \"${fpath[1]}/_isochrone\"\n  isochrone completions fish > ~/.config/fish/completions/isochrone.fish"
)]
pub(crate) struct Args {
    /// Shell to generate the script for
    #[arg(value_enum)]
    shell: Shell,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut command = crate::command();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "isochrone", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    terminal::print(&match args.shell {
        Shell::Bash => script + &in_bash(&command),
        Shell::Fish => script + &in_fish(&command),
        Shell::Zsh => in_zsh(&script),
        _ => script,
    })
}

/// What clap does not know: which services there are, and that configurations are TOML files.
fn in_bash(command: &Command) -> String {
    let takes_value = |argument: &&Arg| argument.get_action().takes_values();
    let flags = command.get_subcommands().flat_map(|verb| verb.get_arguments().filter(takes_value));
    let mut flags: Vec<&str> = flags.filter_map(Arg::get_long).collect();
    flags.sort_unstable();
    flags.dedup();
    let flags = flags.iter().map(|flag| format!(" --{flag}")).collect::<String>();
    format!(
        r#"
_isochrone_and_names() {{
    _isochrone "$@"
    local cur="${{COMP_WORDS[COMP_CWORD]}}" prev="${{COMP_WORDS[COMP_CWORD-1]}}" i name domain=()
    # What begins with a dash is a flag, and what follows one of these is its value.
    if [[ "${{cur}}" == -* || "{flags} " == *" ${{prev}} "* ]]; then
        return 0
    fi
    for ((i = 2; i < COMP_CWORD; i++)); do
        if [[ "${{COMP_WORDS[i-1]}}" == --iceoryx2-config ]]; then
            domain=(--iceoryx2-config "${{COMP_WORDS[i]}}")
        fi
    done
    local IFS=$'
'
    case "${{COMP_WORDS[1]}}" in
        {services})
            # Not compgen -W, which would run what a name has in $().
            COMPREPLY=()
            while read -r name; do
                if [[ "${{name}}" == "${{cur}}"* ]]; then
                    COMPREPLY+=("$(printf %q "${{name}}")")
                fi
            done < <("${{COMP_WORDS[0]}}" list --names "${{domain[@]}}" 2>/dev/null)
            ;;
        {files})
            COMPREPLY=($(compgen -f -X '!*.toml' -- "${{cur}}") $(compgen -d -S / -- "${{cur}}"))
            ;;
    esac
}}
complete -F _isochrone_and_names -o bashdefault -o default isochrone
"#,
        services = verbs_with("service", command).join("|"),
        files = verbs_with("file", command).join("|"),
    )
}

fn in_fish(command: &Command) -> String {
    let line = |verb: String| {
        format!(
            "complete -c isochrone -n \"__fish_isochrone_using_subcommand {verb}\" -f -a \"({LIST})\"\n"
        )
    };
    verbs_with("service", command).into_iter().map(line).collect()
}

fn in_zsh(script: &str) -> String {
    let complete = |line: &str| {
        if line.starts_with("':service -- ") {
            let action = format!("{{compadd -- ${{(f)\"$({LIST})\"}}}}' \\");
            return line.replace("_default' \\", &action);
        }
        line.to_owned()
    };
    script.lines().map(|line| complete(line) + "\n").collect()
}

/// Prints the services of the default domain.
const LIST: &str = "isochrone list --names 2>/dev/null";

/// The verbs with a positional argument of this name.
fn verbs_with(argument: &str, command: &Command) -> Vec<String> {
    let has = |verb: &&Command| verb.get_positionals().any(|found| found.get_id() == argument);
    command.get_subcommands().filter(has).map(|verb| verb.get_name().to_owned()).collect()
}
