//! What bash, zsh and fish propose with the scripts of `completions`. The shells themselves are
//! asked; a test whose shell is missing skips itself, but not where `CI` is set.

use std::path::Path;
use std::process::Command;

use isochrone_testing::plants::{RELAY, TANK};
use isochrone_testing::{Domain, Process, not_tested};

const CONFIG: &str = "--iceoryx2-config domain.toml";

/// Runs zsh in a terminal of its own, types a line and a tab, and writes what is proposed to a file.
const IN_ZSH: &str = r#"
zmodload zsh/zpty
folder=$1
print -r -- '
PROMPT= RPROMPT=
folder="'$folder'"
autoload -Uz compinit
fpath=("$folder" $fpath)
compinit -u -D
compadd() {
    if [[ ${@[1,(i)(-|--)]} != *-(O|A|D)\ * ]]; then
        local -a hits
        builtin compadd -A hits "$@"
        (( $#hits )) && print -rl -- $hits >> "$folder/proposed"
    fi
    builtin compadd "$@"
}
finish() { : > "$folder/done"; exit }
comppostfuncs=(finish)
bindkey "^I" complete-word
: > "$folder/ready"
' > $folder/setup
await() { repeat 600; do [[ -e $folder/$1 ]] && return; zpty -rt shell said; sleep 0.1; done; exit 1 }
zpty -b shell zsh -f -i
zpty -w shell "source $folder/setup"
await ready
zpty -wn shell "$2"$'\t'
await done
"#;

#[derive(Clone, Copy)]
enum Shell {
    Bash,
    Zsh,
    Fish,
}

impl Shell {
    fn name(self) -> &'static str {
        match self {
            Self::Bash => "bash",
            Self::Zsh => "zsh",
            Self::Fish => "fish",
        }
    }

    /// Whether it is there; says so where it is not.
    fn is_there(self) -> bool {
        let is_there = Command::new(self.name()).arg("--version").output().is_ok();
        if !is_there {
            let why = format!("there is no {}", self.name());
            assert!(std::env::var_os("CI").is_none(), "{why}");
            not_tested("completions", &why);
        }
        is_there
    }

    /// The script that is to be tested.
    fn script(self) -> String {
        let mut program = Command::new(env!("CARGO_BIN_EXE_isochrone"));
        let output = program.args(["completions", self.name()]).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    }

    /// What it proposes for the last of these words, sorted.
    fn proposes(self, domain: &Domain, words: &str) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        std::fs::write(file("_isochrone"), self.script()).unwrap();
        let script = file("_isochrone");
        let arguments = match self {
            Self::Bash => vec!["-c".to_owned(), in_bash(&script, words)],
            Self::Zsh => {
                std::fs::write(file("drive"), IN_ZSH).unwrap();
                let folder = folder.path().to_str().unwrap().to_owned();
                vec!["-f".to_owned(), file("drive"), folder, format!("isochrone {words}")]
            }
            Self::Fish => {
                let asked = format!("source '{script}'; complete -C 'isochrone {words}'");
                vec!["--no-config".to_owned(), "-c".to_owned(), asked]
            }
        };
        let program = Path::new(env!("CARGO_BIN_EXE_isochrone")).parent().unwrap();
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new(self.name());
        command.args(arguments).current_dir(domain.path("")).env("HOME", folder.path());
        command.env("PATH", format!("{}:{path}", program.display()));
        let output = command.output().unwrap();
        assert!(output.status.success() || matches!(self, Self::Bash), "{output:?}");
        assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
        let said = match self {
            Self::Zsh => std::fs::read_to_string(file("proposed")).unwrap_or_default(),
            Self::Bash | Self::Fish => String::from_utf8(output.stdout).unwrap(),
        };
        // fish adds what each proposal is.
        let name = |line: &str| line.split('\t').next().unwrap_or_default().to_owned();
        let mut proposed: Vec<String> =
            said.lines().map(name).filter(|name| !name.is_empty()).collect();
        proposed.sort();
        proposed
    }
}

fn in_bash(script: &str, words: &str) -> String {
    format!(
        "source '{script}'
        read -ra COMP_WORDS <<< 'isochrone {words}'
        [[ '{words}' == *' ' ]] && COMP_WORDS+=('')
        COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
        compopt() {{ :; }}
        _isochrone_and_names isochrone \"${{COMP_WORDS[COMP_CWORD]}}\" \"${{COMP_WORDS[COMP_CWORD-1]}}\"
        printf '%s\\n' \"${{COMPREPLY[@]}}\""
    )
}

/// A domain with services and files, one of each with a name that a careless script would trip over.
fn inhabited() -> (Domain, [Process; 3]) {
    let domain = Domain::new();
    domain.write("relay.toml", RELAY);
    domain.write("other.txt", "");
    let mut processes = ["plant/level", "tank 3/level", "$(touch pwned)"]
        .map(|service| domain.start_with(&["publish", service, "--value", "1"]));
    processes.iter_mut().for_each(|process| process.wait_for("publishing"));
    (domain, processes)
}

/// What every shell completes alike.
fn completes_verbs_options_and_services(shell: Shell, domain: &Domain) {
    let proposed = |words: &str| shell.proposes(domain, words);
    assert_eq!(proposed("subsc"), ["subscribe"]);
    assert_eq!(proposed("bench jit"), ["jitter"]);
    assert_eq!(proposed("subscribe --sig"), ["--signals"]);
    assert_eq!(proposed("subscribe --csv oth"), ["other.txt"], "the value of an option");
    assert_eq!(proposed("run re"), ["relay.toml"]);
    assert_eq!(proposed(&format!("subscribe {CONFIG} pl")), ["plant/level"]);
    assert_eq!(proposed(&format!("subscribe {CONFIG} ")).len(), 3);
    assert!(!domain.path("pwned").exists(), "a name is not run");
}

/// What every shell completes of a running node.
fn completes_nodes_and_signals(shell: Shell) {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", TANK, "");
    let proposed = |words: &str| {
        let names = shell.proposes(&domain, words).into_iter();
        names.map(|name| name.trim_end_matches('=').to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(proposed(&format!("show {CONFIG} ")), ["tank"]);
    assert_eq!(proposed(&format!("get {CONFIG} ta")), ["tank"]);
    assert_eq!(proposed(&format!("get {CONFIG} tank ramp.set")), ["ramp.setChangeRate"]);
    assert_eq!(
        proposed(&format!("watch {CONFIG} --rate 2 tank level.")),
        ["level.age", "level.ok"]
    );
    assert_eq!(proposed(&format!("set {CONFIG} tank ramp.v")), [""; 0], "it is wired");
    assert_eq!(proposed(&format!("set {CONFIG} tank ramp.set")), ["ramp.setChangeRate"]);
    assert_eq!(proposed(&format!("force {CONFIG} tank ramp.value")), ["ramp.value"]);
    assert_eq!(
        proposed(&format!("force {CONFIG} tank level.")),
        ["level.ok"],
        "an age cannot be forced"
    );
    assert_eq!(proposed(&format!("release {CONFIG} tank ")), [""; 0], "nothing is forced");
    let forced = domain.run("force tank level=1 --hold").expect_code(0);
    assert_eq!(forced.complaints(), "");
    assert_eq!(proposed(&format!("release {CONFIG} tank ")), ["level"]);
    drop(node.stop().expect_code(0));
}

fn end(processes: [Process; 3]) {
    processes.into_iter().for_each(|process| drop(process.stop().expect_code(0)));
}

#[test]
fn bash_completes_verbs_options_files_and_services() {
    if !Shell::Bash.is_there() {
        return;
    }
    let (domain, processes) = inhabited();
    completes_verbs_options_and_services(Shell::Bash, &domain);
    let services = Shell::Bash.proposes(&domain, &format!("subscribe {CONFIG} "));
    assert_eq!(services, [r"\$\(touch\ pwned\)", "plant/level", r"tank\ 3/level"]);
    let files = Shell::Bash.proposes(&domain, "check ");
    assert_eq!(files, ["domain.toml", "iceoryx2/", "relay.toml"]);
    end(processes);
}

#[test]
fn zsh_completes_verbs_options_files_and_services() {
    if !Shell::Zsh.is_there() {
        return;
    }
    let (domain, processes) = inhabited();
    completes_verbs_options_and_services(Shell::Zsh, &domain);
    let services = Shell::Zsh.proposes(&domain, &format!("subscribe {CONFIG} "));
    assert_eq!(services, [r"\$\(touch\ pwned\)", "plant/level", r"tank\ 3/level"]);
    let files = Shell::Zsh.proposes(&domain, "check ");
    assert_eq!(files, ["domain.toml", "iceoryx2", "relay.toml"]);
    end(processes);
}

#[test]
fn fish_completes_verbs_options_files_and_services() {
    if !Shell::Fish.is_there() {
        return;
    }
    let (domain, processes) = inhabited();
    completes_verbs_options_and_services(Shell::Fish, &domain);
    // fish quotes what it inserts, not what it proposes.
    let services = Shell::Fish.proposes(&domain, &format!("subscribe {CONFIG} "));
    assert_eq!(services, ["$(touch pwned)", "plant/level", "tank 3/level"]);
    // It proposes other files too, after those that end in .toml.
    let files = Shell::Fish.proposes(&domain, "check ");
    assert!(["domain.toml", "relay.toml"].iter().all(|file| files.contains(&file.to_string())));
    end(processes);
}

#[test]
fn bash_completes_nodes_and_signals() {
    if Shell::Bash.is_there() {
        completes_nodes_and_signals(Shell::Bash);
    }
}

#[test]
fn bash_proposes_neither_flags_nor_files_where_a_value_is_to_come() {
    if !Shell::Bash.is_there() {
        return;
    }
    let domain = Domain::new();
    for words in ["set tank r.setChangeRate = ", "set tank r.setChangeRate =", "undo tank "] {
        assert_eq!(Shell::Bash.proposes(&domain, words), [""; 0], "{words}");
    }
    assert_eq!(Shell::Bash.proposes(&domain, "undo tank --js"), ["--json"]);
}

#[test]
fn zsh_completes_nodes_and_signals() {
    if Shell::Zsh.is_there() {
        completes_nodes_and_signals(Shell::Zsh);
    }
}

#[test]
fn fish_completes_nodes_and_signals() {
    if Shell::Fish.is_there() {
        completes_nodes_and_signals(Shell::Fish);
    }
}
