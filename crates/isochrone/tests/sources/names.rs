//! The public types of all crates.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::{sources, workspace};

/// The crates that are published. What tests share is named as it reads well in a test.
fn crates() -> Vec<PathBuf> {
    let all = fs::read_dir(workspace().join("crates")).unwrap();
    let folders = all.map(|folder| folder.unwrap().path());
    let is_published = |folder: &PathBuf| {
        let manifest = fs::read_to_string(folder.join("Cargo.toml"));
        manifest.is_ok_and(|manifest| !manifest.contains("\npublish = false"))
    };
    folders.filter(is_published).collect()
}

/// A type that a crate declares for its users.
struct Declared {
    /// The crate's folder.
    folder: String,
    /// File and line.
    place: String,
    keyword: String,
    name: String,
    /// Its line, and what stands above it up to a blank line: attributes and documentation.
    text: String,
}

impl Declared {
    fn may_grow(&self) -> bool {
        self.text.contains("#[non_exhaustive]")
    }

    fn derives_error(&self) -> bool {
        let derives = self.text.lines().filter(|line| line.starts_with("#[derive("));
        derives.flat_map(words).any(|word| word == "Error")
    }
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
}

/// Keyword and name of the type that a line declares for users of the crate: `unreachable_pub` is on, so what says
/// `pub` is.
fn declared(line: &str) -> Option<(&str, &str)> {
    let mut parts = words(line.trim_start().strip_prefix("pub ")?);
    let keyword = parts.find(|part| *part != "unsafe")?;
    let is_type = ["struct", "enum", "union", "trait", "type"].contains(&keyword);
    Some((keyword, parts.next().filter(|_| is_type)?))
}

fn all_declared() -> Vec<Declared> {
    let mut found = Vec::new();
    for folder in crates() {
        for path in sources(&folder.join("src")) {
            let text = fs::read_to_string(&path).unwrap();
            let place = path.strip_prefix(folder.parent().unwrap()).unwrap().display();
            let mut above = String::new();
            for (number, line) in text.lines().enumerate() {
                if line.trim().is_empty() {
                    above.clear();
                }
                above.extend([line.trim_start(), "\n"]);
                if let Some((keyword, name)) = declared(line) {
                    found.push(Declared {
                        folder: folder.file_name().unwrap().to_str().unwrap().to_owned(),
                        place: format!("crates/{place}:{}", number + 1),
                        keyword: keyword.to_owned(),
                        name: name.to_owned(),
                        text: above.clone(),
                    });
                }
            }
        }
    }
    assert!(found.len() > 200 && found.iter().any(|it| it.name == "TaskEngine"));
    found
}

/// A file of the front door.
fn front_door(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap()
}

/// The public types that are errors, and the sources of their crates, by folder.
fn errors() -> (Vec<Declared>, BTreeMap<String, String>) {
    let text = |folder: &PathBuf| {
        let files = sources(&folder.join("src")).into_iter();
        let text: String = files.map(|path| fs::read_to_string(path).unwrap()).collect();
        (folder.file_name().unwrap().to_str().unwrap().to_owned(), text)
    };
    let texts: BTreeMap<_, _> = crates().iter().map(text).collect();
    let mut errors = all_declared();
    errors.retain(|it| {
        it.derives_error() || texts[&it.folder].contains(&format!("Error for {} {{", it.name))
    });
    assert!(errors.len() > 30 && errors.iter().any(|it| it.name == "Refusal"));
    (errors, texts)
}

/// Enums that other crates of ours match by every variant, so that a new one does not compile until each of them
/// handles it, and why it is to be handled there.
const EXHAUSTIVE: [(&str, &[&str]); 8] = [
    ("a process is it beside its twin; the command line tells each", &["TwinRole"]),
    (
        "a block declares it; plan, requests and screens read it",
        &["Ob", "Origin", "PinDefault", "PinType"],
    ),
    (
        "a configuration says it; the plan and the cycle obey it",
        &[
            "Access",
            "AlarmSeverity",
            "Binding",
            "Cpu",
            "InputPart",
            "Margin",
            "OnStale",
            "Operand",
            "Overrun",
            "Wake",
        ],
    ),
    (
        "an operator does it; desk, journal, replay and screens know it",
        &["Action", "At", "Given", "Hold", "Role", "Value", "Written"],
    ),
    (
        "a request asks for it or is answered with it; the node handles each",
        &["Begun", "Call", "ListedAlarm", "Method", "OrderOutcome", "Reply", "Unwritten", "Work"],
    ),
    (
        "a cycle meets it; what it does then is decided for each",
        &[
            "AlarmChange",
            "AlarmState",
            "Awake",
            "Punctuality",
            "SenderClock",
            "Stamps",
            "StopReason",
        ],
    ),
    (
        "a file or a report has it; whatever reads one knows it",
        &["Cause", "Item", "Line", "RuleOutcome", "Severity"],
    ),
    ("a literal has it wrong; readers of times and of durations say so each", &["AmountError"]),
];

/// Errors that come within others, and no call returns by themselves.
const PARTS: [&str; 4] = ["Diagnostic", "Excerpts", "SupervisorPanicked", "TaskPanicked"];

#[test]
fn no_two_public_types_have_one_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for it in all_declared() {
        places.entry(it.name).or_default().push(it.place);
    }
    places.retain(|_, places| places.len() > 1);
    assert!(places.is_empty(), "name each by what it is, or make them one: {places:#?}");
}

#[test]
fn every_public_enum_may_grow_or_is_matched_by_every_variant_on_purpose() {
    let door = front_door("src/lib.rs");
    let is_error =
        |name: &str| ["Error", "Refusal", "Reason"].iter().any(|end| name.ends_with(end));
    let is_of_door = |folder: &str| words(&door).any(|word| word == format!("isochrone_{folder}"));
    let mut kept: BTreeSet<&str> =
        EXHAUSTIVE.iter().flat_map(|(_, names)| *names).copied().collect();
    let mut closed = Vec::new();
    for it in all_declared().iter().filter(|it| it.keyword == "enum") {
        // An enum without variants is a name for functions.
        let is_public = is_of_door(&it.folder) || is_error(&it.name);
        if it.may_grow() || !is_public || it.text.trim_end().ends_with("{}") {
            continue;
        }
        if !kept.remove(&*it.name) {
            closed.push(format!("{} ({})", it.name, it.place));
        }
    }
    assert!(closed.is_empty(), "say #[non_exhaustive], or why not: {closed:#?}");
    assert!(kept.is_empty(), "these are gone, or say #[non_exhaustive]: {kept:?}");
}

#[test]
fn every_public_error_is_its_sentence_where_a_main_returns_it() {
    let (errors, texts) = errors();
    for it in errors {
        let text = &texts[&it.folder];
        let mut lists = text.split("debug_as_display!(").skip(1);
        let is_listed = lists.any(|list| {
            words(list.split_once(')').map_or(list, |(names, _)| names)).any(|name| name == it.name)
        });
        let by_hand = text.contains(&format!("Debug for {} {{", it.name));
        let (name, place) = (it.name, it.place);
        assert!(is_listed || by_hand, "{place}: debug_as_display!({name})");
    }
}

#[test]
fn every_error_of_the_front_door_becomes_its_own() {
    let (door, own) = (front_door("src/lib.rs"), front_door("src/error.rs"));
    for it in errors().0 {
        let (name, folder) = (&it.name, &it.folder);
        let is_whole = door.contains(&format!("pub use isochrone_{folder} as {folder};"));
        if (is_whole || words(&door).any(|word| word == name)) && !PARTS.contains(&name.as_str()) {
            let becomes = own.contains(&format!("#[from] {name})"))
                || own.contains(&format!("impl From<{name}> for Error {{"))
                || folder == "isochrone";
            assert!(becomes, "isochrone::Error takes no {name} ({})", it.place);
        }
    }
}
