//! Which files of a crate use each other.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

use crate::modules::{Crate, Module};
use crate::workspace;

/// For each module those whose items it uses, with the place and the path by which it does.
type Uses = BTreeMap<Vec<String>, BTreeMap<Vec<String>, String>>;

/// Whose items the modules of a crate use.
///
/// A re-export leads to the file that declares the item, and is by itself no use of it: what a parent hands on
/// of its children does not bind it to them.
fn uses(all: &Crate) -> Uses {
    all.0.iter().map(|(name, module)| (name.clone(), uses_of(all, name, module))).collect()
}

fn uses_of(all: &Crate, name: &[String], module: &Module) -> BTreeMap<Vec<String>, String> {
    let is_known = |first: &String| {
        ["crate", "self", "super"].contains(&first.as_str()) || module.children.contains(first)
    };
    let imports = module.imports.iter().filter(|import| {
        let is_named = || module.paths.iter().any(|(path, _)| path[0] == import.name);
        is_known(&import.path[0]) && (!import.is_public || is_named())
    });
    let imports = imports.map(|import| (&import.path, import.line));
    let is_imported = |first: &String| module.imports.iter().any(|it| it.name == *first);
    let paths = module
        .paths
        .iter()
        .filter(|(path, _)| path.len() > 1 && (is_known(&path[0]) || is_imported(&path[0])));
    let mut uses = BTreeMap::new();
    for (path, line) in imports.chain(paths.map(|(path, line)| (path, *line))) {
        if let Some(of) = all.declaring(name, path).filter(|of| *of != name) {
            let file = module.path.strip_prefix(workspace()).unwrap_or(&module.path).display();
            uses.entry(of).or_insert_with(|| format!("{file}:{line} uses {}", path.join("::")));
        }
    }
    uses
}

/// A shortest way from a module back to itself.
fn circle<'u>(uses: &'u Uses, begin: &'u Vec<String>) -> Option<Vec<&'u Vec<String>>> {
    let mut before: BTreeMap<&Vec<String>, &Vec<String>> = BTreeMap::new();
    let mut left = VecDeque::from([begin]);
    while let Some(module) = left.pop_front() {
        for used in uses[module].keys() {
            if before.contains_key(used) {
                continue;
            }
            before.insert(used, module);
            left.push_back(used);
        }
    }
    let mut way = vec![*before.get(begin)?];
    while let Some(&module) = way.last()
        && module != begin
    {
        way.push(before[&module]);
    }
    way.reverse();
    Some(way)
}

/// The circles of a crate: the places that close each of them.
fn circles(uses: &Uses) -> Vec<Vec<&str>> {
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for way in uses.keys().filter_map(|module| circle(uses, module)) {
        if seen.insert(way.iter().copied().collect::<BTreeSet<_>>()) {
            let next = way.iter().cycle().skip(1);
            found.push(way.iter().zip(next).map(|(from, to)| &*uses[*from][*to]).collect());
        }
    }
    found
}

#[test]
fn no_files_of_a_crate_use_each_other_in_a_circle() {
    let crates = fs::read_dir(workspace().join("crates")).unwrap();
    let crates = crates.map(|entry| entry.unwrap().path());
    let others = ["nodes", "benches"].map(|folder| workspace().join(folder));
    let mut edges = 0;
    let mut found = Vec::new();
    for folder in crates.chain(others) {
        let read = |path: &Path| fs::read_to_string(path).ok();
        // A program without a library, as crates/ros2 is.
        let roots = ["src/lib.rs", "src/main.rs"].map(|file| folder.join(file));
        let root = roots.iter().find(|root| root.exists()).unwrap();
        let uses = uses(&Crate::read(root, &read));
        edges += uses.values().map(BTreeMap::len).sum::<usize>();
        found.extend(circles(&uses).into_iter().map(|circle| circle.join("\n")));
    }
    assert!(edges > 1_000, "the files of all crates use {edges} others");
    assert!(
        found.is_empty(),
        "move what they share to the file that it belongs to, or pass it as an argument:\n\n{}",
        found.join("\n\n")
    );
}

#[test]
fn a_circle_is_told_by_the_lines_that_close_it_and_a_re_export_closes_none() {
    const PLANT: &str = "mod tank;\npub use tank::Tank;\nuse self::tank::{self as it, fill};\n\
        pub struct Plant;\nfn run(plant: &Plant) { fill(plant); it::drain(\"crate::Lid\"); }\n\
        #[cfg(test)]\nmod tests { use crate::Lid; }";
    const TANK: &str = "use super::Plant;\n// crate::Lid\npub struct Tank;\n\
        pub fn fill(_: &Plant) {}\npub fn drain(_: &str) {}";
    let files = |lib: &'static str| {
        let files = [("lib.rs", lib), ("plant.rs", PLANT), ("plant/tank.rs", TANK)];
        let read = move |path: &Path| {
            let found = files.iter().find(|(name, _)| Path::new(name) == path);
            found.map(|(_, text)| (*text).to_owned())
        };
        uses(&Crate::read(Path::new("lib.rs"), &read))
    };
    let of_two = ["plant.rs:3 uses self::tank::fill", "plant/tank.rs:1 uses super::Plant"];
    assert_eq!(circles(&files("mod plant;\npub use plant::Plant;\npub struct Lid;")), [of_two]);
    let uses = files("mod plant;\npub use plant::{Plant, Tank};\npub fn of(_: Tank) {}");
    let tank = ["plant", "tank"].map(String::from).to_vec();
    assert_eq!(uses[&Vec::new()].keys().collect::<Vec<_>>(), [&tank]);
}
