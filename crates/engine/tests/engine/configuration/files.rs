//! Files that can be read and files that cannot, and where in them something stands.

use std::fs;
use std::path::Path;

use isochrone_engine::{MAX_BYTES, Problem, Source};

use crate::findings::{VALID, assert_one, findings, plan};

/// A file that goes with the test.
fn file(content: &[u8]) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), content).unwrap();
    file
}

#[test]
fn a_text_file_is_read_with_its_name() {
    let file = file(VALID.as_bytes());
    let source = Source::read(file.path()).unwrap();
    assert_eq!((source.name, &*source.text), (file.path().display().to_string(), VALID));
}

#[test]
fn an_empty_or_blank_file_is_refused_with_what_it_needs() {
    for content in ["", " \n\t\r\n"] {
        let error = Source::read(file(content.as_bytes()).path()).unwrap_err();
        assert!(error.to_string().ends_with("at least [node] and one [[task]]"), "{error}");
    }
}

#[test]
fn a_directory_is_refused() {
    let error = Source::read(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap_err();
    assert!(error.to_string().contains("is a directory; name the configuration file"), "{error}");
}

#[test]
fn a_binary_file_is_refused_with_its_first_wrong_byte() {
    let error = Source::read(file(b"[node]\n\xFF\x00").path()).unwrap_err();
    assert!(error.to_string().contains("byte 7 is not UTF-8"), "{error}");
}

#[test]
fn a_file_above_the_limit_is_refused_and_one_at_the_limit_read() {
    let large = file(b"");
    let (path, large) = (large.path(), large.as_file());
    large.set_len(1 << 40).unwrap();
    let error = Source::read(path).unwrap_err();
    assert!(error.to_string().contains("larger than 16 MiB"), "{error}");
    large.set_len(MAX_BYTES).unwrap();
    assert_eq!(Source::read(path).unwrap().text.len() as u64, MAX_BYTES);
}

#[test]
fn a_file_that_does_not_exist_is_refused_with_its_path() {
    let error = Source::read(Path::new("/nowhere/level.toml")).unwrap_err();
    assert!(error.to_string().starts_with("cannot read /nowhere/level.toml: "), "{error}");
}

#[test]
fn syntax_errors_are_reported_where_they_are() {
    for (name, text) in [
        ("no value", "[node]\nname = «\n"),
        ("a key twice", "[node]\nname = \"a\"\n«name = \"b\"\n"),
        ("no end of text", "[node]\nname = «\"level\n"),
    ] {
        let found = findings(text);
        assert!(found.iter().all(|finding| finding.problem == Problem::Syntax), "{found:?}");
        if let [_] = &found[..] {
            let start = found[0].span.start;
            let expected = text.find('«').unwrap();
            assert!(
                start.abs_diff(expected) <= 6,
                "{name}: {start} is not near {expected}: {found:?}"
            );
        }
        assert!(found[0].message.starts_with("this is not TOML: "), "{found:?}");
    }
}

#[test]
fn what_lacks_its_quotes_is_said_to_and_how_it_is_written() {
    let text = |value: &str| format!("[node]\nname = \"n\"\n[[task]]\nperiod = «{value}\n");
    for (value, help) in [
        ("T#100ms", "a text needs quotes: \"T#100ms\""),
        ("1ms", "a text needs quotes: \"1ms\""),
        ("fast # the first", "a text needs quotes: \"fast\""),
        ("TRUE", "write true, in lowercase letters"),
        ("10 ms", "a text needs quotes: \"10 ms\""),
        ("10 m/s # or so", "a number stands alone, without a unit: 10"),
    ] {
        assert_one(value, &text(value), Problem::Syntax, "this is not TOML", help);
    }
    let inline = findings("[node]\nname = \"n\"\nin = { timeRange = T#100ms }\n");
    let [finding] = &inline[..] else { panic!("{inline:?}") };
    assert!(finding.help.as_deref().is_some_and(|help| help.ends_with("\"T#100ms\"")));
}

#[test]
fn tables_in_single_brackets_that_stand_twice_are_one_error() {
    let task = "name = \"fast\"\nperiod = \"1ms\"\n";
    let text = format!("[node]\nname = \"n\"\n[task]\n{task}[«task]\n{task}");
    let message = "[task] stands twice, with one pair of brackets too few";
    assert_one("task", &text, Problem::Syntax, message, "write [[task]], for each of them");
    let third = format!("{text}[task]\n{task}");
    assert_one("three", &third, Problem::Syntax, message, "write [[task]]");
}

#[test]
fn a_file_that_is_something_else_is_one_error_that_says_so() {
    let markdown = format!("# A page\n\n{}", "Some prose, and no keys.\n\n".repeat(30));
    let found = findings(&markdown);
    let [finding] = &found[..] else { panic!("{found:?}") };
    assert_eq!(finding.problem, Problem::Syntax);
    assert!(finding.message.starts_with("this is not a configuration"), "{}", finding.message);
    assert!(finding.message.ends_with("nor in 29 other lines"), "{}", finding.message);
    assert!(finding.help.as_deref().is_some_and(|help| help.contains("[node]")));
}

#[test]
fn a_configuration_with_many_slips_is_not_taken_for_something_else() {
    let text = format!("[node]\nname = \"n\"\n{}", "x y\n".repeat(30));
    assert_eq!(findings(&text).len(), 30);
}

#[test]
fn a_pipe_is_refused_at_once_and_not_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    for path in [&*path, Path::new("/dev/zero")] {
        let error = Source::read(path).unwrap_err();
        assert!(error.to_string().contains("is not a file but a pipe"), "{error}");
    }
}

#[test]
fn nesting_without_end_is_an_error_and_no_stack_overflow() {
    for (open, close) in [("[", "]"), ("{a=", "}"), ("[", ""), ("{a=", ""), ("[{a=", "}]")] {
        let text = format!("x = {}1{}\n", open.repeat(100_000), close.repeat(100_000));
        assert!(plan(&text).is_err(), "{open}");
    }
    for text in
        [format!("{}x = 1\n", "a.".repeat(100_000)), format!("[{}x]\n", "a.".repeat(100_000))]
    {
        assert!(plan(&text).is_err());
    }
}

#[test]
fn a_position_counts_lines_and_characters_from_1() {
    let source = Source { name: String::new(), text: "a\nµ = 1\n".into() };
    let positions = [(0, (1, 1)), (1, (1, 2)), (2, (2, 1)), (4, (2, 2)), (8, (2, 6)), (9, (3, 1))];
    for (offset, position) in positions {
        assert_eq!(source.position(offset), position, "byte {offset}");
    }
    assert_eq!(source.position(3), source.position(99), "no character begins there");
}

#[test]
fn a_mark_behind_a_wide_character_is_counted_in_characters() {
    let text = VALID
        .replace("[node]\nname = \"level\"", "node = { \"µ\" = 1, «nam = 2, name = \"level\" }");
    let found = findings(&text);
    assert_eq!(found.len(), 2, "{found:?}");
    let text = VALID.replace("[node]\nname = \"level\"", "node = { name = \"level\", «\"µ\" = 1 }");
    assert_one("wide", &text, Problem::UnknownKey, "no key \"µ\"", "");
}

#[test]
fn positions_in_one_pass_are_those_of_each_offset() {
    let source = Source::new("n", "å = 1\n\nb = \"ü\" # µ\nc");
    let offsets: Vec<usize> = source.text.char_indices().map(|(byte, _)| byte).collect();
    let twice = || offsets.iter().flat_map(|offset| [*offset, *offset]);
    let each: Vec<_> = twice().map(|offset| source.position(offset)).collect();
    assert_eq!(source.positions(twice()).collect::<Vec<_>>(), each);
}
