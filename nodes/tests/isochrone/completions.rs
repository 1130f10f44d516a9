//! What bash, zsh and fish propose with the scripts of `completions`. The shells themselves are
//! asked; a test whose shell is missing skips itself, but not where `CI` is set.

use std::path::Path;
use std::process::Command;

use isochrone_testing::plants::{RELAY, TANK, tank};
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
    let domain = Domain::with(&[("relay.toml", RELAY), ("other.txt", "")]);
    let mut processes = ["plant/level", "tank 3/level", "$(touch pwned)"]
        .map(|service| domain.start_with(&["publish", service, "--value", "1"]));
    processes.iter_mut().for_each(|process| process.wait_for("publishing"));
    (domain, processes)
}

/// Completes verbs, options, services, as they are to be typed, and files.
fn completes_verbs_options_and_names(shell: Shell, services: [&str; 3], files: &[&str]) {
    if !shell.is_there() {
        return;
    }
    let (domain, _processes) = inhabited();
    let proposed = |words: &str| shell.proposes(&domain, words);
    assert_eq!(proposed("subsc"), ["subscribe"]);
    assert_eq!(proposed("bench jit"), ["jitter"]);
    assert_eq!(proposed("subscribe --sig"), ["--signals"]);
    assert_eq!(proposed("subscribe --csv oth"), ["other.txt"], "the value of an option");
    assert_eq!(proposed("run re"), ["relay.toml"]);
    assert_eq!(proposed(&format!("subscribe {CONFIG} pl")), ["plant/level"]);
    assert_eq!(proposed(&format!("subscribe {CONFIG} ")), services);
    assert!(!domain.path("pwned").exists(), "a name is not run");
    let mut proposed = proposed("check ");
    if matches!(shell, Shell::Fish) {
        // It proposes other files too, after those that end in .toml.
        proposed.retain(|file| files.contains(&&**file));
    }
    assert_eq!(proposed, files);
}

/// What every shell completes of a running node.
fn completes_nodes_and_signals(shell: Shell) {
    if !shell.is_there() {
        return;
    }
    let (domain, node) = tank(TANK);
    let proposed = |words: &str| {
        let names = shell.proposes(&domain, words).into_iter();
        names.map(|name| name.trim_end_matches('=').to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(proposed(&format!("show {CONFIG} ")), ["tank"]);
    assert_eq!(proposed(&format!("get {CONFIG} ta")), ["tank"]);
    assert_eq!(proposed(&format!("get {CONFIG} tank ramp.set")), ["ramp.setChangeRate"]);
    let ages = ["level.age", "level.ok"];
    assert_eq!(proposed(&format!("watch {CONFIG} --rate 2 tank level.")), ages);
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

const QUOTED: [&str; 3] = [r"\$\(touch\ pwned\)", "plant/level", r"tank\ 3/level"];

#[test]
fn bash_completes_verbs_options_files_and_services() {
    let files = ["domain.toml", "iceoryx2/", "relay.toml"];
    completes_verbs_options_and_names(Shell::Bash, QUOTED, &files);
}

#[test]
fn zsh_completes_verbs_options_files_and_services() {
    let files = ["domain.toml", "iceoryx2", "relay.toml"];
    completes_verbs_options_and_names(Shell::Zsh, QUOTED, &files);
}

#[test]
fn fish_completes_verbs_options_files_and_services() {
    // fish quotes what it inserts, not what it proposes.
    let services = ["$(touch pwned)", "plant/level", "tank 3/level"];
    completes_verbs_options_and_names(Shell::Fish, services, &["domain.toml", "relay.toml"]);
}

#[test]
fn bash_completes_nodes_and_signals() {
    completes_nodes_and_signals(Shell::Bash);
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
    completes_nodes_and_signals(Shell::Zsh);
}

#[test]
fn fish_completes_nodes_and_signals() {
    completes_nodes_and_signals(Shell::Fish);
}
