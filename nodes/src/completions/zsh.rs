//! Completions beyond those of clap, in zsh: which services, nodes and signals there are, and that configurations are
//! TOML files.

use super::arguments::{OF_NODE, OfNode};

pub(super) fn script(name: &str, script: &str) -> String {
    let complete = |line: &str| {
        let is_of = |argument: &str| {
            let spec = line.trim_start_matches(['\'', ':', '*']);
            (line.starts_with("':") || line.starts_with("'*:"))
                && spec.starts_with(&format!("{argument} -- "))
        };
        let names = |function: &str| line.replace(":_default' \\", &format!(":{function}' \\"));
        if is_of("service") {
            return names(&format!("_{name}_services"));
        }
        if is_of("node") {
            return names(&format!("_{name}_nodes"));
        }
        if let Some(OfNode { verb, flags, suffix, .. }) =
            OF_NODE.iter().find(|of_node| is_of(of_node.argument))
        {
            // The blank has zsh call it as it stands. Not as the rest of a command of its own (`*::`):
            // the node before would be missing.
            let call = names(&format!(" _{name}_of_node '\\''{suffix}'\\'' {verb} {flags}"));
            return call.replace("'*::", "'*:");
        }
        if is_of("file") {
            return line.replace(":_files' \\", ":_files -g \"*.toml\"' \\");
        }
        if line == AUTOLOAD {
            return format!("{line}\n{}", FUNCTIONS.replace("isochrone", name));
        }
        line.to_owned()
    };
    script.lines().map(|line| complete(line) + "\n").collect()
}

/// The line of clap's script before its first function.
const AUTOLOAD: &str = "autoload -U is-at-least";

/// `names` has the program print names of the domain that the line tells, or of the default one.
/// `opt_args` and `line` are what zsh has read of the line.
const FUNCTIONS: &str = r#"
_isochrone_names() {
    local -a domain
    if [[ -n "${opt_args[--iceoryx2-config]}" ]]; then
        domain=(--iceoryx2-config "${(Q)opt_args[--iceoryx2-config]}")
    fi
    names=(${(f)"$(isochrone "$@" $domain 2>/dev/null)"})
}
_isochrone_services() {
    local -a names
    _isochrone_names list --names
    compadd "$@" -- $names
}
_isochrone_nodes() {
    local -a names
    _isochrone_names list --nodes
    compadd "$@" -- $names
}
_isochrone_of_node() {
    local -a names
    _isochrone_names "$2" "${(Q)line[1]}" "${@:3}"
    compadd -S "$1" -- $names
}"#;
