//! The man pages.

use std::path::Path;
use std::process::Command;

use isochrone_cli::clap;
use isochrone_testing::{Domain, not_tested};

/// The names of the pages of a command and of those below it, as man finds them.
fn pages(command: &clap::Command, prefix: &str) -> Vec<String> {
    let name = format!("{prefix}{}", command.get_name());
    let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    let below = shown.flat_map(|verb| pages(verb, &format!("{name}-"))).collect::<Vec<_>>();
    [vec![format!("{name}.1")], below].concat()
}

fn written(folder: &Path) {
    let made = Command::new(env!("CARGO_BIN_EXE_man_pages")).arg(folder).status().unwrap();
    assert!(made.success());
}

#[test]
fn each_verb_has_a_man_page_that_says_what_it_does() {
    let domain = Domain::new();
    let folder = domain.path("man");
    written(&folder);
    let command = isochrone_cli::command();
    let pages = pages(&command, "");
    assert!(pages.iter().any(|page| page == "isochrone-bench-latency.1"), "{pages:?}");
    for page in &pages {
        let text = std::fs::read_to_string(folder.join(page)).unwrap_or_else(|error| {
            panic!("{page}: {error}");
        });
        assert!(text.contains(".SH SYNOPSIS") && text.contains(".SH DESCRIPTION"), "{page}");
    }
    let files = std::fs::read_dir(&folder).unwrap().count();
    assert_eq!(files, pages.len(), "no page is of a verb that is hidden");
}

#[test]
fn man_finds_no_fault_in_the_pages() {
    let domain = Domain::new();
    let folder = domain.path("man");
    written(&folder);
    for entry in std::fs::read_dir(&folder).unwrap() {
        let page = entry.unwrap().path();
        let mut man = Command::new("man");
        man.args(["--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z"])
            .arg(&page)
            .env("MANWIDTH", "80");
        let Ok(shown) = man.output() else {
            return not_tested("man pages", "man is missing");
        };
        let faults = String::from_utf8_lossy(&shown.stderr);
        assert!(shown.status.success() && faults.is_empty(), "{}: {faults}", page.display());
    }
}
