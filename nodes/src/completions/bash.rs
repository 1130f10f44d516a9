//! Completions beyond those of clap, in bash: which services, nodes and signals there are, and that configurations are
//! TOML files.

use clap::Command;

use super::arguments::{OF_NODE, OfNode, flags_with_value, verbs_with};

pub(super) fn script(name: &str, command: &Command) -> String {
    let flags = flags_with_value(command).iter().map(|flag| format!(" {flag}")).collect::<String>();
    let of_node = OF_NODE.iter().map(|of_node| {
        let OfNode { argument, verb, flags, suffix } = of_node;
        let verbs = verbs_with(argument, command).join("|");
        format!(
            "                {verbs}) _{function}_propose '{suffix}' {verb} \"${{positionals[0]}}\" {flags} ;;\n",
            function = function(name)
        )
    });
    format!(
        r#"
# Proposes the names that a verb of the program prints, each with $1 after it.
_{function}_propose() {{
    local suffix="$1" name
    shift
    COMPREPLY=()
    if [[ -n "${{suffix}}" ]]; then
        compopt -o nospace
    fi
    # Not compgen -W, which would run what a name has in $().
    while read -r name; do
        if [[ "${{name}}" == "${{cur}}"* ]]; then
            COMPREPLY+=("$(printf %q "${{name}}")${{suffix}}")
        fi
    done < <("${{COMP_WORDS[0]}}" "$@" "${{domain[@]}}" 2>/dev/null)
}}

_{function}_and_names() {{
    _{function} "$@"
    local cur="${{COMP_WORDS[COMP_CWORD]}}" prev="${{COMP_WORDS[COMP_CWORD-1]}}" i domain=() positionals=()
    # The value of a parameter is in no list.
    if [[ "${{cur}}" == "=" && "${{prev}}" != -* ||
        "${{prev}}" == "=" && "${{COMP_WORDS[COMP_CWORD-2]}}" != -* ]]; then
        COMPREPLY=()
        compopt +o default +o bashdefault
        return 0
    fi
    # What begins with a dash is a flag, and what follows one of these is its value.
    if [[ "${{cur}}" == [-=]* || "{flags} = " == *" ${{prev}} "* ]]; then
        return 0
    fi
    for ((i = 2; i < COMP_CWORD; i++)); do
        if [[ "${{COMP_WORDS[i-1]}}" == --iceoryx2-config ]]; then
            domain=(--iceoryx2-config "${{COMP_WORDS[i]}}")
        fi
        if [[ "${{COMP_WORDS[i]}}" != -* && "{flags} " != *" ${{COMP_WORDS[i-1]}} "* ]]; then
            positionals+=("${{COMP_WORDS[i]}}")
        fi
    done
    local IFS=$'
'
    case "${{COMP_WORDS[1]}}" in
        {services})
            _{function}_propose '' list --names
            ;;
        {nodes})
            if ((${{#positionals[@]}} == 0)); then
                _{function}_propose '' list --nodes
                return 0
            fi
            # Neither a flag nor a file, where there is nothing to propose.
            COMPREPLY=()
            case "${{COMP_WORDS[1]}}" in
                {files}) ;;
                *) compopt +o default +o bashdefault ;;
            esac
            case "${{COMP_WORDS[1]}}" in
{of_node}            esac
            ;;
    esac
    case "${{COMP_WORDS[1]}}" in
        {files})
            COMPREPLY=($(compgen -f -X '!*.toml' -- "${{cur}}") $(compgen -d -S / -- "${{cur}}"))
            ;;
    esac
}}
complete -F _{function}_and_names -o bashdefault -o default {name}
"#,
        function = function(name),
        services = verbs_with("service", command).join("|"),
        nodes = verbs_with("node", command).join("|"),
        files = verbs_with("file", command).join("|"),
        of_node = of_node.collect::<String>(),
    )
}

/// As clap calls its function.
fn function(name: &str) -> String {
    name.replace('-', "__")
}
