//! Completions beyond those of clap, in fish: services, nodes and signals, and that configurations are
//! TOML files.

use clap::Command;

use super::arguments::{OF_NODE, OfNode, flags_with_value, verbs_with};

pub(super) fn script(name: &str, command: &Command) -> String {
    // As clap calls its functions.
    let function = name.replace('-', "_");
    let proposal = |argument: &str, condition: &str, proposed: &str| {
        let line = |verb: &str| {
            format!(
                "complete -c {name} -n \"__fish_{function}_using_subcommand {verb}{condition}\" -k -f -a \"({proposed})\"\n"
            )
        };
        verbs_with(argument, command).into_iter().map(line).collect::<String>()
    };
    let ask = format!("__fish_{function}_ask");
    let positionals = format!("__fish_{function}_positionals");
    let first = format!("; and test (count ({positionals})) -eq 0");
    let further = format!("; and test (count ({positionals})) -ge 1");
    let mut script = FUNCTIONS
        .replace("FLAGS", &flags_with_value(command).join(" "))
        .replace("__fish_isochrone", &format!("__fish_{function}"));
    script += &proposal("service", "", &format!("__fish_{function}_services"));
    script += &proposal("node", &first, &format!("{ask} list --nodes"));
    for OfNode { argument, verb, flags, suffix } in OF_NODE {
        let names = format!("{ask} {verb} ({positionals})[1] {flags}");
        let proposed = match suffix {
            "" => names,
            suffix => format!("{names} | string replace -r '\\$' '{suffix}'"),
        };
        script += &proposal(argument, &further, &proposed);
    }
    script + &proposal("file", "", "__fish_complete_suffix .toml")
}

/// `ask` has the program print names of the domain that the line tells, or of the default one.
const FUNCTIONS: &str = r#"
function __fish_isochrone_ask
    set -l words (commandline -opc)
    set -l domain
    set -l last ""
    for word in $words
        if test "$last" = --iceoryx2-config
            set domain --iceoryx2-config $word
        end
        set last $word
    end
    $words[1] $argv $domain 2>/dev/null
end

function __fish_isochrone_services
    __fish_isochrone_ask list --names
end

# What follows the verb and is neither a flag nor the value of one.
function __fish_isochrone_positionals
    set -l words (commandline -opc)
    set -l last ""
    for word in $words[3..-1]
        if not string match -q -- '-*' $word; and not contains -- "$last" FLAGS
            echo $word
        end
        set last $word
    end
end
"#;
