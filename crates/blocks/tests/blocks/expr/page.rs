//! The page of the language, docs/expressions.md: all its examples hold.

use isochrone_blocks::PinType;
use isochrone_blocks::expr::Mistake;
use isochrone_blocks::literal::{parse_based, parse_time_ms};

use super::{program, value};

const PAGE: &str = include_str!("../../../../../docs/expressions.md");

/// The rows of the tables with this head, by their cells.
fn rows(head: &'static str) -> Vec<Vec<&'static str>> {
    let mut rows = Vec::new();
    let mut lines = PAGE.lines();
    while lines.any(|line| line == head) {
        let table = lines.by_ref().skip(1).take_while(|line| line.starts_with('|'));
        rows.extend(table.map(|row| -> Vec<_> {
            row.trim_matches('|').split('|').map(|cell| cell.trim().trim_matches('`')).collect()
        }));
    }
    rows
}

fn signals() -> Vec<(&'static str, PinType, f64)> {
    let signal = |row: Vec<&'static str>| {
        let of = PinType::ALL.into_iter().find(|of| of.as_str() == row[1]).expect(row[1]);
        (row[0], of, row[2].parse().expect(row[2]))
    };
    rows("| signal | type | value |").into_iter().map(signal).collect()
}

/// The result that a cell shows.
fn shown(of: PinType, cell: &str) -> Result<f64, u16> {
    let based = parse_based(cell).map(|it| it.unwrap().number);
    match (of, based) {
        (PinType::Word, Some(word)) => Ok(word as f64),
        (_, Some(status)) => Err(status as u16),
        (PinType::Time, _) => Ok(f64::from(parse_time_ms(cell).unwrap())),
        (PinType::Bool, _) => Ok(f64::from(u8::from(cell == "TRUE"))),
        (_, _) => Ok(cell.parse().expect(cell)),
    }
}

#[test]
fn the_examples_are_worth_what_the_page_says() {
    let (signals, examples) = (signals(), rows("| expression | type | is |"));
    assert!(signals.len() == 12 && examples.len() >= 50, "{}", examples.len());
    for example in examples {
        let text = example[0];
        let (of, result) = value(text, &signals);
        assert_eq!(of.as_str(), example[1], "{text}");
        assert_eq!(result, shown(of, example[2]), "{text}");
    }
}

#[test]
fn the_mistakes_are_answered_as_the_page_says() {
    let mistakes = rows("| text | is answered |");
    assert!(mistakes.len() > 5);
    for row in mistakes {
        let Mistake { message, help, .. } = program(row[0], &signals()).unwrap_err();
        assert_eq!(format!("{message}: {}", help.unwrap_or_default()), row[1], "{}", row[0]);
    }
}

#[test]
fn the_page_has_every_function_and_its_inputs() {
    // What is said of an unknown function lists all.
    let help = program("unknown(1)", &[]).unwrap_err().help.unwrap();
    let names: Vec<_> = help.strip_prefix("there are ").unwrap().split(", ").collect();
    assert!(names.len() > 30);
    for name in names {
        let help = program(&format!("{name}()"), &[]).unwrap_err().help.unwrap();
        let form = help.strip_prefix("write ").unwrap();
        assert!(PAGE.contains(&format!("`{form}`")), "{form}");
    }
}
