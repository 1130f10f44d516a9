use miette::{GraphicalReportHandler, GraphicalTheme};
use proptest::prelude::*;

use super::*;
use crate::{Diagnostic, Diagnostics, Excerpts, Problem};

/// Two places, the lines around each, and the frame: nothing is longer, whatever the file is.
const MOST_CHARS: usize = 20_000;

fn diagnostic(span: Range<usize>) -> Diagnostic {
    Diagnostic::new(Problem::Duplicate, span, "it is wrong")
}

/// What people see.
fn shown(text: &str, diagnostics: Vec<Diagnostic>) -> String {
    let diagnostics = Diagnostics::new(Source::new("f.toml", text), diagnostics);
    let mut shown = String::new();
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::none());
    handler
        .with_context_lines(1)
        .with_wrap_lines(false)
        .render_report(&mut shown, &Excerpts::from(diagnostics))
        .unwrap();
    shown
}

/// What stands above the carets of the only diagnostic.
fn underlined(shown: &str) -> String {
    let lines: Vec<&str> = shown.lines().collect();
    let carets = lines.iter().position(|line| line.contains('^')).unwrap();
    let columns = lines[carets - 1].chars().flat_map(|c| match c {
        '水' | '👩' | '🔬' => vec![c; 2],
        '\u{200d}' => vec![],
        c => vec![c],
    });
    let chars = columns.zip(lines[carets].chars());
    chars.filter(|(_, mark)| *mark == '^').map(|(c, _)| c).collect()
}

#[test]
fn a_short_file_is_shown_as_it_is() {
    let text = "[node]\nname = \"Ä\"\n\n[[task]]\n";
    let shown = shown(text, vec![diagnostic(14..18)]);
    let excerpt = " ,-[f.toml:2:8]\n 1 | [node]\n 2 | name = \"Ä\"\n   :        ^^^\n 3 | \n";
    assert!(shown.contains(excerpt), "{shown}");
}

#[test]
fn a_place_anywhere_in_a_line_of_200000_characters_is_shown_with_what_is_around_it() {
    for filler in ["x", "ä", "水", "\t", "👩‍🔬", "\u{1b}", "\r"] {
        let filler = filler.repeat(200_000 / filler.chars().count());
        let middle = filler.len() / filler.chars().count() * 100_000;
        let middle = (middle..).find(|byte| filler.is_char_boundary(*byte)).unwrap();
        for at in [0, middle, filler.len()] {
            let line = format!("{}<HERE>{}", &filler[..at], &filler[at..]);
            let text = format!("# before\n{line}\n# after\n");
            let start = "# before\n".len() + at;
            let shown = shown(&text, vec![diagnostic(start..start + "<HERE>".len())]);
            assert_eq!(underlined(&shown), "<HERE>", "{shown}");
            let column = filler[..at].chars().count() + 1;
            assert!(shown.contains(&format!("[f.toml:2:{column}]")), "{shown}");
            assert!(shown.contains(" 1 | # before\n") && shown.contains(" 3 | # after\n"));
            assert!(shown.chars().count() < MOST_CHARS);
        }
    }
}

#[test]
fn of_a_place_that_is_longer_than_what_is_shown_the_beginning_is_shown() {
    let line = "x".repeat(100_000);
    let long = shown(&line, vec![diagnostic(10_000..90_000)]);
    assert_eq!(underlined(&long), "x".repeat(LINE_CHARS - CHARS_BEFORE));
    assert!(long.contains("[f.toml:1:10001]"), "{long}");

    let many = shown(&"line\n".repeat(10_000), vec![diagnostic(5..40_000)]);
    assert!(many.contains("[f.toml:2:1]") && many.lines().count() < 15, "{many}");
    assert!(many.contains("\n 6 |") && !many.contains("\n 7 |"), "{many}");
}

#[test]
fn two_places_far_from_each_other_are_shown_without_what_is_between_them() {
    let text = "first = 1\n".repeat(3_000) + "x\nx\nx\nagain = 1\n";
    let start = text.len() - "again = 1\n".len();
    let other = Diagnostic { first: Some(10_000..10_005), ..diagnostic(start..start + 5) };
    let far = shown(&text, vec![other]);
    assert!(far.contains("[f.toml:3004:1]") && far.contains("[f.toml:1001:1]"), "{far}");
    assert!(far.contains("the first") && far.lines().count() < 25, "{far}");

    let near = shown("a = 1\na = 2\n", vec![Diagnostic { first: Some(0..1), ..diagnostic(6..7) }]);
    assert_eq!(near.matches("f.toml:").count(), 2, "one excerpt: {near}");
    assert!(near.contains("[f.toml:2:1]") && near.contains("the first"), "{near}");
}

#[test]
fn two_places_far_from_each_other_in_one_line_are_shown_apart() {
    let line =
        format!("{}FIRST{}AGAIN{}", "x".repeat(70_000), "y".repeat(70_000), "z".repeat(70_000));
    let diagnostic = Diagnostic { first: Some(70_000..70_005), ..diagnostic(140_005..140_010) };
    let shown = shown(&line, vec![diagnostic]);
    assert!(shown.contains("[f.toml:1:70001]") && shown.contains("[f.toml:1:140006]"), "{shown}");
    assert!(shown.contains("xFIRSTy") && shown.contains("yAGAINz"), "{shown}");
}

#[test]
fn of_many_diagnostics_the_first_are_shown_and_all_are_counted() {
    let line = "[".repeat(80_000);
    let all: Vec<Diagnostic> = (0..80_000).map(|at| diagnostic(at..at + 1)).collect();
    let shown = shown(&line, all);
    assert!(shown.contains("f.toml: 80000 errors"));
    assert!(shown.contains("the first 20 are shown, and 79980 more are not"));
    assert_eq!(shown.matches("it is wrong").count(), 20);
}

#[test]
fn of_a_long_sentence_the_beginning_and_the_end_are_shown() {
    let name = "ä".repeat(50_000);
    let message = format!("node \"{name}\" is no name");
    let diagnostic =
        Diagnostic::new(Problem::BadName, 0..0, message.as_str()).help(message.as_str());
    assert_eq!(diagnostic.message, message, "programs get all of it");
    let shown = shown("", vec![diagnostic]);
    assert!(shown.contains("node \"ä") && shown.contains("\" is no name"), "{shown}");
    assert!(shown.chars().count() < 2_000, "{shown}");
}

#[test]
fn what_a_file_says_to_a_terminal_is_escaped() {
    let text = "name = \"\u{1b}[2J\u{9b}31m\"\n";
    let diagnostic =
        Diagnostic::new(Problem::BadName, 7..21, "name \"\u{1b}[2J\" is none").help("\u{7}");
    let shown = shown(text, vec![diagnostic]);
    assert!(shown.contains(r#"name = "\u001b[2J\u009b31m""#), "{shown}");
    assert!(shown.contains(r#"name "\u001b[2J" is none"#) && shown.contains(r"\u0007"), "{shown}");
    assert!(!shown.contains(|c: char| c.is_control() && c != '\n'));
}

/// Text as nobody writes it: some lines are long, some empty, and every kind of character occurs.
fn any_text() -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        4 => "[a-z =\"\\[\\]]{0,40}",
        1 => any::<String>(),
        2 => ("[aä水\t\u{1b}\r]", 1..2_000_usize).prop_map(|(c, n)| c.repeat(n)),
        2 => prop_oneof![Just("\n"), Just("\r\n"), Just("\r"), Just("\n\n")].prop_map(str::to_owned),
    ];
    prop::collection::vec(piece, 0..20).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn whatever_the_file_and_the_places_are_they_are_shown_in_bounds(
        text in any_text(),
        places in prop::collection::vec((0.0..1.01, 0.0..0.1, prop::option::of(0.0..1.01)), 1..4),
    ) {
        let byte = |part: f64| (part * text.len() as f64) as usize;
        let diagnostics = places.iter().map(|(start, length, first)| Diagnostic {
            first: first.map(|start| byte(start)..byte(start) + 3),
            ..diagnostic(byte(*start)..byte(start + length))
        });
        let diagnostics: Vec<Diagnostic> = diagnostics.collect();
        let count = diagnostics.len();
        let starts: Vec<_> = diagnostics.iter().map(|diagnostic| diagnostic.span.start).collect();
        let shown = shown(&text, diagnostics);
        prop_assert!(shown.chars().count() < MOST_CHARS * count);
        prop_assert!(!shown.contains(|c: char| c.is_control() && c != '\n'));
        let source = Source::new("f.toml", text.as_str());
        for start in starts {
            let (line, column) = source.position(within(&text, &(start..start)).start);
            let place = format!("[f.toml:{line}:{column}]");
            prop_assert!(shown.contains(&place), "{place}\n{shown}");
        }
    }
}
