//! What README and docs show of operating a node is what the program prints.

use std::path::Path;
use std::process::Command;

use isochrone_testing::{Domain, Process};

/// A command on a page, and what the page says that it prints.
struct Shown {
    command: String,
    lines: Vec<String>,
}

/// The commands of a page's console blocks from a mark on, in their order.
fn shown_on(page: &str, mark: &str) -> Vec<Shown> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(page);
    let text = std::fs::read_to_string(path).unwrap();
    let (_, text) = text.split_once(mark).unwrap_or_else(|| panic!("{page} has no {mark}"));
    let mut shown: Vec<Shown> = Vec::new();
    for block in text.split("```console\n").skip(1) {
        let (block, _) = block.split_once("```").unwrap();
        for line in block.lines() {
            match (line.strip_prefix("$ "), shown.last_mut()) {
                (Some(command), _) => {
                    shown.push(Shown { command: command.to_owned(), lines: Vec::new() });
                }
                (None, Some(last)) => last.lines.push(line.to_owned()),
                (None, None) => panic!("{page}: no command before {line:?}"),
            }
        }
    }
    shown
}

/// What the task has where it may have a priority, and what it has otherwise.
const PLACED: [&str; 2] = ["fifo:80 hybrid CPU #", "other hybrid any CPU"];

/// The line without what differs from run to run: whole numbers, instants, how wide columns are, and
/// whether the user may have a priority.
fn lasting(line: &str) -> String {
    let words = line.split_whitespace().map(|word| {
        let value = word.rsplit_once('=').map_or(word, |(_, value)| value);
        let bare = value.trim_matches(|c: char| "(),:".contains(c));
        let is_instant = bare.ends_with('Z') && bare.starts_with(|c: char| c.is_ascii_digit());
        let is_count = bare.bytes().all(|byte| byte.is_ascii_digit()) && !bare.is_empty();
        if is_instant || is_count { word.replace(bare, "#") } else { word.to_owned() }
    });
    words.collect::<Vec<_>>().join(" ").replace(PLACED[1], PLACED[0])
}

/// What a command prints in a domain's folder: first what it has to remark, but not that it waited for another
/// process, as on a busy machine it may at any time.
fn run(domain: &Domain, command: &str) -> String {
    let programs = Path::new(env!("CARGO_BIN_EXE_isochrone")).parent().unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    let mut bash = Command::new("bash");
    bash.args(["-c", command]).current_dir(domain.path(""));
    bash.env("PATH", format!("{}:{path}", programs.display()));
    bash.env("ICEORYX2_CONFIG", domain.config_file()).env("USER", "anna");
    let ended = Process::start(bash).finish();
    let mut text = ended.complaints();
    if !text.is_empty() {
        text.push('\n');
    }
    let folder = std::fs::canonicalize(domain.path("")).unwrap();
    (text + &ended.stdout).replace(folder.to_str().unwrap(), "/plant")
}

/// Whether a command only looks: on a busy machine it may look when a sensor is late, or have no answer in
/// time. Then it looks again.
fn only_looks(command: &str) -> bool {
    let verb = command.strip_prefix("isochrone ").and_then(|rest| rest.split(' ').next());
    verb.is_some_and(|verb| ["list", "show", "get", "watch", "forces", "alarms"].contains(&verb))
}

/// Runs the commands and compares line by line. `…` stands for what a page leaves out at the end.
fn compare(domain: &Domain, page: &str, shown: &[Shown]) {
    assert!(!shown.is_empty());
    for Shown { command, lines } in shown {
        let mut expected: Vec<String> = lines.iter().map(|line| lasting(line)).collect();
        let is_cut = expected.pop_if(|line| line == "…").is_some();
        let attempts = if only_looks(command) { 20 } else { 1 };
        let mut last = String::new();
        let is_as_shown = (0..attempts).any(|_| {
            last = run(domain, command);
            let mut printed: Vec<String> = last.lines().map(lasting).collect();
            if is_cut {
                printed.truncate(expected.len());
            }
            printed == expected
        });
        assert!(is_as_shown, "{page}: $ {command}\n{last}\nis not, line by line:\n{expected:#?}");
    }
}

/// The example's node with all rights, and its sensor.
fn plant(domain: &Domain) -> [Process; 2] {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/level.toml");
    let text = std::fs::read_to_string(example).unwrap();
    let text = text.replace("[node]\n", "[node]\ncontrol = \"force\"\n");
    let node = domain.start_node("level.toml", &text, "");
    let sensor = domain.publish("plant/analog --value 13824");
    let ready = domain.start_until("watch level ramp.delayedValue", "ramp.delayedValue=0.849");
    ready.stop().expect_code(0);
    [node, sensor]
}

#[test]
fn the_page_on_operating_a_node_shows_what_is_printed() {
    let domain = Domain::new();
    let _processes = plant(&domain);
    compare(&domain, "docs/operating.md", &shown_on("docs/operating.md", "## See values"));
}

#[test]
fn the_readme_shows_what_is_printed_when_a_node_is_changed() {
    let domain = Domain::new();
    let _processes = plant(&domain);
    let mut shown = shown_on("README.md", "<!-- change -->");
    // Those of later sections are measurements.
    shown.retain(|shown| shown.command.contains("isochrone"));
    compare(&domain, "README.md", &shown);
}
