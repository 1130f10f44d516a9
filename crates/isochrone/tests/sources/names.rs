//! The public types of all crates.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use crate::{sources, workspace};

/// The crates that are published. What tests share is named as it reads well in a test.
fn crates() -> Vec<PathBuf> {
    let folders =
        fs::read_dir(workspace().join("crates")).unwrap().map(|folder| folder.unwrap().path());
    let is_published = |folder: &PathBuf| {
        let manifest = fs::read_to_string(folder.join("Cargo.toml"));
        manifest.is_ok_and(|manifest| !manifest.contains("\npublish = false"))
    };
    folders.filter(is_published).collect()
}

/// The type that a line declares for users of the crate: `unreachable_pub` is on, so what says `pub` is.
fn declared(line: &str) -> Option<&str> {
    let mut parts = line.trim_start().strip_prefix("pub ")?.split(|c: char| !c.is_alphanumeric());
    let keyword = parts.find(|part| *part != "unsafe")?;
    let is_type = ["struct", "enum", "union", "trait", "type"].contains(&keyword);
    parts.next().filter(|_| is_type)
}

#[test]
fn no_two_public_types_have_one_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for folder in crates() {
        for path in sources(&folder.join("src")) {
            let text = fs::read_to_string(&path).unwrap();
            let place = path.strip_prefix(folder.parent().unwrap()).unwrap().display();
            for (number, line) in text.lines().enumerate() {
                if let Some(name) = declared(line) {
                    let place = format!("crates/{place}:{}", number + 1);
                    places.entry(name.to_owned()).or_default().push(place);
                }
            }
        }
    }
    assert!(places.len() > 200 && places.contains_key("TaskEngine"), "{places:?}");
    places.retain(|_, places| places.len() > 1);
    assert!(places.is_empty(), "name each by what it is, or make them one: {places:#?}");
}
