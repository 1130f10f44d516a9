//! Files that chance wrote.

use proptest::prelude::*;

use crate::findings::{VALID, plan};

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
            assert!(findings.all.iter().any(|finding| !finding.is_warning()), "{findings:?}");
            let starts = findings.all.iter().map(|finding| finding.span.start);
            assert!(starts.clone().is_sorted(), "not in the order of the file: {findings:?}");
            for finding in &findings.all {
                assert!(text.get(finding.span.clone()).is_some(), "{finding:?} points nowhere");
                assert!(!finding.message.is_empty());
            }
            let shown =
                format!("{:?}", miette::Report::new(isochrone_engine::Excerpts::from(findings)));
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
