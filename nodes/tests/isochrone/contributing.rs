//! docs/contributing.md against the sources: what it says a change touches is what the changes before it touched.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Most steps of a section, and most files that an addition touches, its tests included, unless its section says why it
/// takes more.
const MOST: usize = 4;

/// What has a section of its own, and something there is of each that the section follows through the sources.
const ADDITIONS: [(&str, &str); 5] = [
    ("a block", "LimRateOfChangeAdvancedCI"),
    ("a key of a task", "OVERRUN"),
    ("a verb", "completions"),
    ("a control method", "AlarmsParams"),
    ("a report field", "lost_snapshots"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The sections of the page that say how to add something, each with its title.
fn sections(page: &str) -> Vec<(&str, &str)> {
    let section = |text| str::split_once(text, '\n').filter(|(title, _)| title.starts_with("a"));
    let sections: Vec<_> = page.split("\n## Add ").skip(1).filter_map(section).collect();
    sections.into_iter().map(|(title, text)| (title, until_next(text))).collect()
}

fn until_next(text: &str) -> &str {
    text.split_once("\n## ").map_or(text, |(section, _)| section)
}

/// The numbered places of a section, each with the lines that belong to it.
fn places(section: &str) -> Vec<String> {
    let mut places: Vec<String> = Vec::new();
    for line in section.lines().skip_while(|line| !line.starts_with("1. ")) {
        match line.split_once(". ") {
            Some((number, text)) if number.parse::<u8>().is_ok() => places.push(text.to_owned()),
            _ if line.starts_with("   ") => places.last_mut().unwrap().push_str(&line[2..]),
            _ => break,
        }
    }
    places
}

/// The paths that links lead to.
fn linked(text: &str) -> impl Iterator<Item = &str> {
    text.split("](../").skip(1).filter_map(|link| Some(link.split_once(')')?.0))
}

/// What stands in backticks.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Whether it is a path from the root of the repository.
fn is_below_root(word: &str) -> bool {
    let folders = ["crates/", "nodes/", "docs/", "golden/", "benches/", "examples/"];
    folders.iter().any(|folder| word.starts_with(folder)) || word == "README.md"
}

/// Whether it is such a path, and not one that is still to be made.
fn is_path(word: &str) -> bool {
    is_below_root(word) && !word.contains("my_")
}

/// The files that a text names.
fn files(text: &str) -> BTreeSet<&str> {
    let is_file = |word: &&str| is_below_root(word) && Path::new(word).extension().is_some();
    quoted(text).into_iter().filter(is_file).collect()
}

/// What a section says of the files that it touches.
struct FileCount {
    by_hand: usize,
    printed: BTreeSet<String>,
    /// Whether it says why it takes more than the most.
    is_explained: bool,
}

impl FileCount {
    fn of(section: &str) -> Option<Self> {
        let (before, after) = section.split_once(" files are written by hand")?;
        let by_hand = before.rsplit('\n').next()?.parse().ok()?;
        let after = after.split_whitespace().collect::<Vec<_>>().join(" ");
        let (sentence, rest) = after.split_once(". ").unwrap_or((&after, ""));
        Some(Self {
            by_hand,
            printed: files(sentence).into_iter().map(str::to_owned).collect(),
            is_explained: rest.starts_with(&format!("That is more than {MOST} because ")),
        })
    }
}

fn is_identifier(word: &str) -> bool {
    word.len() > 1 && word.trim_end_matches('!').chars().all(|c| c.is_alphanumeric() || c == '_')
}

fn has_word(text: &str, word: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let (before, after) = (&text[..at], &text[at + word.len()..]);
        !before.ends_with(is_part) && !after.starts_with(is_part)
    })
}

/// A source without its comments and the tests in it.
fn code(text: &str) -> String {
    // Tests in the file are its end; those in a file of their own are one line.
    let text = text.split_once("#[cfg(test)]\nmod tests {").map_or(text, |(code, _)| code);
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    text.lines().filter(is_code).map(|line| format!("{line}\n")).collect()
}

/// The hand-written sources that are neither tests nor for tests, by their paths from the root.
fn sources(root: &Path) -> Vec<(String, String)> {
    let mut folders: Vec<PathBuf> = fs::read_dir(root.join("crates"))
        .unwrap()
        .map(|folder| folder.unwrap().path().join("src"))
        .chain([root.join("nodes/src")])
        .filter(|folder| !folder.starts_with(root.join("crates/testing")))
        .collect();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if path.is_dir() {
                folders.push(path);
            } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
                let text = code(&fs::read_to_string(&path).unwrap());
                let path = path.strip_prefix(root).unwrap().to_str().unwrap().to_owned();
                sources.push((path, text));
            }
        }
    }
    sources
}

#[test]
fn nothing_takes_more_steps_than_a_newcomer_keeps_in_mind() {
    let page = fs::read_to_string(root().join("docs/contributing.md")).unwrap();
    let sections = sections(&page);
    for (addition, _) in ADDITIONS {
        assert!(sections.iter().any(|(title, _)| *title == addition), "there is no Add {addition}");
    }
    for (title, section) in sections {
        let places = places(section).len();
        assert!((1..=MOST).contains(&places), "Add {title}: {places} steps");
    }
}

#[test]
fn a_section_counts_the_files_that_its_steps_name_and_says_why_they_are_many() {
    let page = fs::read_to_string(root().join("docs/contributing.md")).unwrap();
    let sections = sections(&page);
    for (addition, _) in ADDITIONS {
        let (_, section) = sections.iter().find(|(title, _)| *title == addition).unwrap();
        let count = FileCount::of(section);
        let count = count.unwrap_or_else(|| panic!("Add {addition} does not count its files"));
        let steps = places(section).join("\n");
        let mut by_hand = files(&steps);
        by_hand.retain(|file| !count.printed.contains(*file));
        assert_eq!(by_hand.len(), count.by_hand, "Add {addition}: {by_hand:?}");
        let is_many = count.by_hand > MOST;
        assert_eq!(is_many, count.is_explained, "Add {addition}: {} files", count.by_hand);
        let tests =
            by_hand.iter().filter(|file| file.contains("/tests/") || file.starts_with("golden/"));
        assert!(tests.count() > 0, "Add {addition} names no test among {by_hand:?}");
    }
}

#[test]
fn each_place_is_there_and_has_what_the_page_says_of_it() {
    let root = root();
    let page = fs::read_to_string(root.join("docs/contributing.md")).unwrap();
    let mut looked_at = 0;
    for (title, section) in sections(&page) {
        for path in quoted(section).into_iter().filter(|word| is_path(word)) {
            assert!(root.join(path).exists(), "Add {title}: there is no {path}");
        }
        for place in places(section) {
            let words = quoted(&place);
            let files = words.iter().copied().filter(|word| is_path(word)).chain(linked(&place));
            let files = files.map(|path| root.join(path));
            let texts: Vec<String> = files
                .filter(|file| file.is_file())
                .map(|f| fs::read_to_string(f).unwrap())
                .collect();
            for word in words.iter().filter(|word| is_identifier(word) && !texts.is_empty()) {
                let is_there = texts.iter().any(|text| has_word(text, word));
                assert!(is_there, "Add {title}: no file of the place has `{word}`: {place}");
                looked_at += 1;
            }
        }
    }
    assert!(looked_at >= 10, "the page names hardly anything: {looked_at}");
}

#[test]
fn what_is_there_stands_where_its_section_says_and_nowhere_else() {
    let root = root();
    let page = fs::read_to_string(root.join("docs/contributing.md")).unwrap();
    let (sections, sources) = (sections(&page), sources(&root));
    for (addition, example) in ADDITIONS {
        let (_, section) = sections.iter().find(|(title, _)| *title == addition).unwrap();
        let sentence = format!("`{example}` stands in ");
        let section = section.split_whitespace().collect::<Vec<_>>().join(" ");
        let (_, listed) = section.split_once(&sentence).unwrap_or_else(|| {
            panic!("Add {addition} has to say where an example is: {sentence}…")
        });
        let (listed, _) = listed.split_once(". ").unwrap_or((listed, ""));
        let listed: BTreeSet<&str> = quoted(listed).into_iter().collect();
        let found: BTreeSet<&str> = sources
            .iter()
            .filter(|(_, text)| has_word(text, example))
            .map(|(path, _)| path.as_str())
            .collect();
        assert_eq!(
            found, listed,
            "Add {addition}: where {example} stands, and where the page says"
        );
    }
}

#[test]
fn a_page_that_is_wrong_is_found_to_be() {
    let page = "# P\n\n## Add a thing\n\n1. In `nodes/src/lib.rs`,\n   a line to `verbs!`.\n2. `docs/no.md`.\n\n`x`\n\n## B\n";
    let sections = sections(page);
    let [(title, section)] = sections.as_slice() else { panic!("{sections:?}") };
    let places = places(section);
    assert_eq!(*title, "a thing");
    assert_eq!(places, ["In `nodes/src/lib.rs`, a line to `verbs!`.", "`docs/no.md`."]);
    assert_eq!(quoted(&places[0]), ["nodes/src/lib.rs", "verbs!"]);
    assert!(has_word("macro_rules! verbs {", "verbs") && !has_word("adverbs!", "verbs!"));
    assert!(is_path("docs/no.md") && !is_path("nodes/src/my_verb.rs") && is_identifier("verbs!"));
    assert_eq!(
        linked("[`a.rs`](../crates/a.rs) and [b](b.md#c)").collect::<Vec<_>>(),
        ["crates/a.rs"]
    );
    assert_eq!(files("`docs/a.md`, `golden/my_case/in.csv`, `docs`, `undo.rs`").len(), 2);
    let section = "x\n\n12 files are written by hand, and a command prints `docs/a.md`\nand `README.md`. That is\nmore than 4 because of it.\n";
    let count = FileCount::of(section).unwrap();
    assert_eq!((count.by_hand, count.printed.len(), count.is_explained), (12, 2, true));
    assert!(!FileCount::of(&section.replace("because", "as")).unwrap().is_explained);
    assert!(FileCount::of("some files are written by hand.\n").is_none());
    let source = "// a lost_snapshots\nlet a = lost;\n#[cfg(test)]\nmod tests { lost_snapshots }\n";
    assert!(has_word(&code("#[cfg(test)]\nmod tests;\nlost"), "lost"));
    assert!(!has_word(&code(source), "lost_snapshots") && has_word(&code(source), "lost"));
}
