//! `completions`: shell completions.

use clap::{Arg, Command};
use clap_complete::Shell;

use crate::failure::Failure;
use crate::{program, terminal};

/// Print a completion script for a shell
///
/// In bash, zsh and fish, the names of existing services are completed too, and configuration files
/// by their ending .toml.
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
    let mut command = program::command();
    let name = program::name();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, &name, &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    terminal::print(&match args.shell {
        Shell::Bash => script + &in_bash(&name, &command),
        Shell::Fish => script + &in_fish(&name, &command),
        Shell::Zsh => in_zsh(&name, &script),
        _ => script,
    })
}

/// What clap does not know: which services there are, and that configurations are TOML files.
fn in_bash(name: &str, command: &Command) -> String {
    let takes_value = |argument: &&Arg| argument.get_action().takes_values();
    let flags = command.get_subcommands().flat_map(|verb| verb.get_arguments().filter(takes_value));
    let mut flags: Vec<&str> = flags.filter_map(Arg::get_long).collect();
    flags.sort_unstable();
    flags.dedup();
    let flags = flags.iter().map(|flag| format!(" --{flag}")).collect::<String>();
    format!(
        r#"
_{function}_and_names() {{
    _{function} "$@"
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
complete -F _{function}_and_names -o bashdefault -o default {name}
"#,
        // As clap calls its function.
        function = name.replace('-', "__"),
        services = verbs_with("service", command).join("|"),
        files = verbs_with("file", command).join("|"),
    )
}

fn in_fish(name: &str, command: &Command) -> String {
    // As clap calls its functions.
    let function = name.replace('-', "_");
    let services_function = format!("__fish_{function}_services");
    let proposal = |verbs: Vec<String>, proposed: &str| {
        let line = |verb: String| {
            format!(
                "complete -c {name} -n \"__fish_{function}_using_subcommand {verb}\" -k -f -a \"({proposed})\"\n"
            )
        };
        verbs.into_iter().map(line).collect::<String>()
    };
    let services = proposal(verbs_with("service", command), &services_function);
    let files = proposal(verbs_with("file", command), "__fish_complete_suffix .toml");
    let prints_services = SERVICES_IN_FISH.replace("__fish_isochrone_services", &services_function);
    format!("{prints_services}{services}{files}")
}

/// Prints the services of the domain that the line names, or of the default one.
const SERVICES_IN_FISH: &str = r#"
function __fish_isochrone_services
    set -l words (commandline -opc)
    set -l domain
    set -l last ""
    for word in $words
        if test "$last" = --iceoryx2-config
            set domain --iceoryx2-config $word
        end
        set last $word
    end
    $words[1] list --names $domain 2>/dev/null
end
"#;

fn in_zsh(name: &str, script: &str) -> String {
    let complete = |line: &str| {
        let is_of = |argument: &str| {
            let spec = line.trim_start_matches(['\'', ':']);
            line.starts_with("':") && spec.starts_with(&format!("{argument} -- "))
        };
        if is_of("service") {
            return line.replace(":_default' \\", &format!(":_{name}_services' \\"));
        }
        if is_of("file") {
            return line.replace(":_files' \\", ":_files -g \"*.toml\"' \\");
        }
        if line == AUTOLOAD_IN_ZSH {
            let services = SERVICES_IN_ZSH.replace("isochrone", name);
            return format!("{line}\n{services}");
        }
        line.to_owned()
    };
    script.lines().map(|line| complete(line) + "\n").collect()
}

/// The line of clap's script before its first function.
const AUTOLOAD_IN_ZSH: &str = "autoload -U is-at-least";

/// As [`SERVICES_IN_FISH`]; `opt_args` is what zsh has read of the line.
const SERVICES_IN_ZSH: &str = r#"
_isochrone_services() {
    local -a domain names
    if [[ -n "${opt_args[--iceoryx2-config]}" ]]; then
        domain=(--iceoryx2-config "${(Q)opt_args[--iceoryx2-config]}")
    fi
    names=(${(f)"$(isochrone list --names $domain 2>/dev/null)"})
    compadd "$@" -- $names
}"#;

/// The verbs with a positional argument of this name.
fn verbs_with(argument: &str, command: &Command) -> Vec<String> {
    let has = |verb: &&Command| verb.get_positionals().any(|found| found.get_id() == argument);
    command.get_subcommands().filter(has).map(|verb| verb.get_name().to_owned()).collect()
}
