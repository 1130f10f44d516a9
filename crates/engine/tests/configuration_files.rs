//! Files that are no configuration, files with many mistakes, and files that chance wrote.

mod findings;

use std::fs;
use std::path::Path;

use findings::{VALID, assert_one, findings, plan};
use isochrone_engine::{MAX_BYTES, Problem, ReadError, Source};
use proptest::prelude::*;

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
        assert!(matches!(error, ReadError::Empty { .. }), "{error:?}");
        assert!(error.to_string().ends_with("at least [node] and one [[task]]"), "{error}");
    }
}

#[test]
fn a_directory_is_refused() {
    let error = Source::read(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap_err();
    assert!(matches!(error, ReadError::Directory { .. }), "{error:?}");
    assert!(error.to_string().contains("is a directory; name the configuration file"), "{error}");
}

#[test]
fn a_binary_file_is_refused_with_its_first_wrong_byte() {
    let error = Source::read(file(b"[node]\n\xFF\x00").path()).unwrap_err();
    assert!(matches!(error, ReadError::NotText { offset: 7, .. }), "{error:?}");
    assert!(error.to_string().contains("byte 7 is not UTF-8"), "{error}");
}

#[test]
fn a_file_above_the_limit_is_refused_and_one_at_the_limit_read() {
    let large = file(b"");
    let (path, large) = (large.path(), large.as_file());
    large.set_len(1 << 40).unwrap();
    let error = Source::read(path).unwrap_err();
    assert!(matches!(error, ReadError::TooLarge { .. }), "{error:?}");
    assert!(error.to_string().contains("larger than 16 MiB"), "{error}");
    large.set_len(MAX_BYTES).unwrap();
    assert_eq!(Source::read(path).unwrap().text.len() as u64, MAX_BYTES);
}

#[test]
fn a_file_that_does_not_exist_is_refused_with_its_path() {
    let error = Source::read(Path::new("/nowhere/level.toml")).unwrap_err();
    assert!(matches!(error, ReadError::Io { .. }), "{error:?}");
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
    ] {
        assert_one(value, &text(value), Problem::Syntax, "this is not TOML", help);
    }
    let inline = findings("[node]\nname = \"n\"\nin = { timeRange = T#100ms }\n");
    let [finding] = &inline[..] else { panic!("{inline:?}") };
    assert!(finding.help.as_deref().is_some_and(|help| help.ends_with("\"T#100ms\"")));
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
        assert!(matches!(error, ReadError::NotAFile { .. }), "{error:?}");
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
fn all_mistakes_of_a_file_are_reported_together_in_its_order() {
    use Problem::*;
    let mistakes = [
        ("name = \"level\"", "name = \"Level\"", BadName),
        ("phase = \"100us\"", "phase = \"2ms\"", OutOfRange),
        ("overrun =", "overun =", UnknownKey),
        ("channel = 7", "channel = \"7\"", WrongType),
        ("y1 = 0.0\n", "", MissingPin),
        ("yMin = 0.0", "ymin = 0.0", UnknownPin),
        ("type = \"LimRateOfChangeCI\"", "type = \"LimRate\"", UnknownBlockType),
        ("timeRange = 50", "timeRange = 5.0", TypeMismatch),
        ("task = \"fast\"\nsignals", "task = \"slow\"\nsignals", UnknownTask),
        ("\"scale.y\", \"ramp", "\"scael.y\", \"ramp", UnknownSource),
    ];
    let mut text = VALID.to_string();
    for (from, to, _) in mistakes {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    // Without a type; and its name is taken.
    text += "[[block]]\nname = \"saw\"\nin.x = 1\n";
    let found: Vec<Problem> = findings(&text).iter().map(|finding| finding.problem).collect();
    let expected = [
        BadName,
        OutOfRange,
        UnknownKey,
        WrongType,
        MissingPin,
        UnknownPin,
        UnknownBlockType,
        TypeMismatch,
        UnknownTask,
        UnknownSource,
        MissingKey,
        Duplicate,
    ];
    assert_eq!(found, expected);
}

#[test]
fn the_help_is_the_same_in_every_run() {
    let text = VALID.replace("value = \"scale.y\"", "value = \"q\"");
    let text = text.replace("\"scale.y\", ", "\"q.y\", ");
    let first: Vec<_> = findings(&text).into_iter().map(|finding| finding.help).collect();
    for _ in 0..20 {
        let again: Vec<_> = findings(&text).into_iter().map(|finding| finding.help).collect();
        assert_eq!(again, first);
    }
}

/// A change that chance makes to a text: to its bytes, or to its lines.
#[derive(Clone, Debug)]
enum Change {
    Delete(usize, usize),
    Duplicate(usize, usize),
    Replace(usize, String),
    DeleteLine(usize),
    DuplicateLine(usize),
    SwapLines(usize, usize),
}

fn change() -> impl Strategy<Value = Change> {
    let words = prop::sample::select(&[
        "0",
        "-1",
        "99999999999999999999",
        "nan",
        "inf",
        "true",
        "\"\"",
        "\"{i}\"",
        "[]",
        "{}",
        "[[task]]",
        "[block.in]",
        "\"ramp.{i}.delayedValue@prev\"",
        "\"ramp.0.delayedValue\"",
        "raw",
        "=",
        "\"",
        "µ",
        "\0",
        "1.0",
        "0xFFFFFFFFFFFFFFFFFF",
        "1979-05-27",
        "\"saw.value\"",
        "\n",
        "#",
        "SawTooth",
        "5ms",
    ]);
    let at = || 0usize..1000;
    prop_oneof![
        (at(), 1usize..20).prop_map(|(at, len)| Change::Delete(at, len)),
        (at(), 1usize..60).prop_map(|(at, len)| Change::Duplicate(at, len)),
        (at(), words).prop_map(|(at, word)| Change::Replace(at, word.to_string())),
        (at(), any::<char>()).prop_map(|(at, char)| Change::Replace(at, char.to_string())),
        at().prop_map(Change::DeleteLine),
        at().prop_map(Change::DuplicateLine),
        (at(), at()).prop_map(|(a, b)| Change::SwapLines(a, b)),
    ]
}

/// Where the `at`th character begins, or the text ends.
fn byte(text: &str, at: usize) -> usize {
    text.char_indices().nth(at).map_or(text.len(), |(byte, _)| byte)
}

fn apply(text: &mut String, change: &Change) {
    let mut lines: Vec<&str> = text.lines().collect();
    let count = lines.len().max(1);
    match change {
        Change::Delete(at, len) => {
            let range = byte(text, *at)..byte(text, at + len);
            return text.replace_range(range, "");
        }
        Change::Duplicate(at, len) => {
            let copy = text[byte(text, *at)..byte(text, at + len)].to_string();
            return text.insert_str(byte(text, *at), &copy);
        }
        Change::Replace(at, word) => {
            let range = byte(text, *at)..byte(text, at + word.len());
            return text.replace_range(range, word);
        }
        Change::DeleteLine(line) if !lines.is_empty() => drop(lines.remove(line % count)),
        Change::DuplicateLine(line) if !lines.is_empty() => {
            lines.insert(line % count, lines[line % count])
        }
        Change::SwapLines(a, b) if !lines.is_empty() => lines.swap(a % count, b % count),
        _ => {}
    }
    *text = lines.join("\n");
}

/// Plans a text; whatever it says, the findings must be usable.
fn survive(text: &str) {
    match plan(text) {
        Ok(plan) => {
            for mut engine in isochrone_engine::TaskEngine::build(&plan).unwrap() {
                engine.step(0);
            }
        }
        Err(findings) => {
            assert!(findings.findings.iter().any(|finding| !finding.is_warning()), "{findings:?}");
            let starts = findings.findings.iter().map(|finding| finding.span.start);
            assert!(starts.clone().is_sorted(), "not in the order of the file: {findings:?}");
            for finding in &findings.findings {
                assert!(text.get(finding.span.clone()).is_some(), "{finding:?} points nowhere");
                assert!(!finding.message.is_empty());
            }
            let shown = format!("{:?}", miette::Report::new(findings));
            assert!(!shown.is_empty());
        }
    }
}

proptest! {
    #[test]
    fn no_text_makes_the_plan_panic(changes in prop::collection::vec(change(), 1..6)) {
        let mut text = VALID.replace("count = 3", "count = 2");
        for change in &changes {
            apply(&mut text, change);
        }
        survive(&text);
    }

    #[test]
    fn no_value_in_any_place_makes_the_plan_panic(line in 0usize..60, value in "[-+0-9a-z\"'\\[\\]{}.@_ ]{0,12}") {
        let mut lines: Vec<String> = VALID.lines().map(str::to_owned).collect();
        let line = line % lines.len();
        if let Some((key, _)) = lines[line].split_once('=') {
            lines[line] = format!("{key}= {value}");
        }
        survive(&lines.join("\n"));
    }
}

/// Blocks in a file of which every second line is a wire from a block that does not exist.
fn with_wrong_wires(blocks: usize) -> String {
    let mut text = "[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n".to_string();
    for block in 0..blocks {
        text += &format!(
            "[[block]]\nname = \"ramp_{block}\"\ntype = \"LimRateOfChangeCI\"\n\
             in.value = \"rmap_{block}.delayedValue\"\n"
        );
    }
    text
}

#[test]
fn every_wrong_wire_of_a_huge_file_is_found_and_the_first_ones_are_explained() {
    let found = findings(&with_wrong_wires(20_000));
    assert_eq!(found.len(), 20_000);
    for (block, finding) in found.iter().take(20).enumerate() {
        assert_eq!(finding.message, format!("there is no block \"rmap_{block}\""));
        let help = finding.help.as_deref().unwrap_or_default();
        assert_eq!(help, format!("did you mean \"ramp_{block}\"?"));
    }
    let last = found.last().and_then(|finding| finding.help.as_deref()).unwrap_or_default();
    assert!(last.starts_with("there are 20000: ramp_0, ramp_1, "), "{last}");
}

#[test]
fn every_wrong_wire_of_a_file_of_common_size_is_explained() {
    let found = findings(&with_wrong_wires(100));
    for (block, finding) in found.iter().enumerate() {
        let help = finding.help.as_deref().unwrap_or_default();
        assert_eq!(help, format!("did you mean \"ramp_{block}\"?"));
    }
}

#[test]
fn positions_in_one_pass_are_those_of_each_offset() {
    let source = Source::new("n", "å = 1\n\nb = \"ü\" # µ\nc");
    let offsets: Vec<usize> = source.text.char_indices().map(|(byte, _)| byte).collect();
    let twice = || offsets.iter().flat_map(|offset| [*offset, *offset]);
    let each: Vec<_> = twice().map(|offset| source.position(offset)).collect();
    assert_eq!(source.positions(twice()).collect::<Vec<_>>(), each);
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
