//! What README and docs show of operating a node is what the program prints.

mod domain;

use std::path::Path;
use std::process::Command;

use domain::{Domain, Process};

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

/// The line without what differs from run to run: whole numbers, instants, and how wide columns are.
fn lasting(line: &str) -> String {
    let words = line.split_whitespace().map(|word| {
        let value = word.rsplit_once('=').map_or(word, |(_, value)| value);
        let bare = value.trim_matches(|c: char| "(),:".contains(c));
        let is_instant = bare.ends_with('Z') && bare.starts_with(|c: char| c.is_ascii_digit());
        let is_count = bare.bytes().all(|byte| byte.is_ascii_digit()) && !bare.is_empty();
        if is_instant || is_count { word.replace(bare, "#") } else { word.to_owned() }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Runs the commands in a domain's folder and compares line by line. `…` stands for what a page leaves out
/// at the end.
fn compare(domain: &Domain, page: &str, shown: &[Shown]) {
    assert!(!shown.is_empty());
    let programs = Path::new(env!("CARGO_BIN_EXE_isochrone")).parent().unwrap();
    let path = std::env::var("PATH").unwrap_or_default();
    for Shown { command, lines } in shown {
        let output = Command::new("bash")
            .args(["-c", command])
            .current_dir(domain.path(""))
            .env("PATH", format!("{}:{path}", programs.display()))
            .env("ICEORYX2_CONFIG", domain.config_file())
            .env("USER", "anna")
            .output()
            .unwrap();
        let text =
            [output.stderr, output.stdout].map(|text| String::from_utf8(text).unwrap()).concat();
        let folder = std::fs::canonicalize(domain.path("")).unwrap();
        let text = text.replace(folder.to_str().unwrap(), "/plant");
        let mut printed: Vec<String> = text.lines().map(lasting).collect();
        let mut expected: Vec<String> = lines.iter().map(|line| lasting(line)).collect();
        if expected.last().is_some_and(|line| line == "…") {
            expected.pop();
            printed.truncate(expected.len());
        }
        assert_eq!(printed, expected, "{page}: $ {command}\n{text}");
    }
}

/// The example's node with all rights, and its sensor.
fn plant(domain: &Domain) -> [Process; 2] {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/level.toml");
    let text = std::fs::read_to_string(example).unwrap();
    domain.write("level.toml", &text.replace("[node]\n", "[node]\ncontrol = \"force\"\n"));
    let mut node = domain.start("run level.toml");
    node.wait_for("is running");
    let mut sensor = domain.start("publish plant/analog --value 13824");
    sensor.wait_for("publishing");
    let mut ready = domain.start("watch level ramp.delayedValue");
    ready.wait_for("ramp.delayedValue=0.849");
    ready.stop().expect_code(0);
    [node, sensor]
}

#[test]
fn the_page_on_operating_a_node_shows_what_is_printed() {
    let domain = Domain::new();
    let processes = plant(&domain);
    compare(&domain, "docs/operating.md", &shown_on("docs/operating.md", "## See values"));
    processes.into_iter().for_each(|process| drop(process.stop().expect_code(0)));
}

#[test]
fn the_readme_shows_what_is_printed_when_a_node_is_changed() {
    let domain = Domain::new();
    let processes = plant(&domain);
    let mut shown = shown_on("README.md", "<!-- change -->");
    // Those of later sections are measurements.
    shown.retain(|shown| shown.command.contains("isochrone"));
    compare(&domain, "README.md", &shown);
    processes.into_iter().for_each(|process| drop(process.stop().expect_code(0)));
}
