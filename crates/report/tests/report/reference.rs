//! docs/report.md against what reports hold.

use crate::made_up;
use isochrone_model::AlarmTotals;
use isochrone_report::{RecordingReport, Report};
use isochrone_timing::{TaskTiming, WarningCode};
use serde_json::Value;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/report.md");

/// Every key of a document; those of `histograms` are names of distributions.
fn keys(value: &Value, into: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                into.push(key.clone());
                if key != "histograms" {
                    keys(value, into);
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| keys(value, into)),
        _ => {}
    }
}

/// The table of the codes, as the page has it.
fn warning_codes() -> String {
    let row = |code: &WarningCode| {
        let remedy = if code.remedy().is_empty() { "none" } else { code.remedy() };
        format!("| `{code}` | {} | {remedy} |\n", code.meaning())
    };
    let rows = WarningCode::ALL.iter().map(row).collect::<String>();
    format!("| Code | Meaning | Usual remedy |\n|---|---|---|\n{rows}")
}

#[test]
fn the_page_has_the_meaning_and_the_remedy_of_every_warning_code() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (_, table) = page.split_once("## Warning codes\n\n").unwrap();
    assert_eq!(table, warning_codes(), "put this table there:\n{}", warning_codes());
}

#[test]
fn the_reference_names_every_key_of_a_task_that_follows() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let task = TaskTiming::new(1_000_000).following().report("fast");
    let mut words = Vec::new();
    keys(&serde_json::to_value(task).unwrap(), &mut words);
    assert!(words.contains(&"follow_wait_ns".to_owned()), "{words:?}");
    for word in words.iter().filter(|word| word.contains("follow") || word.contains("timed")) {
        assert!(page.contains(&format!("| `{word}` |")), "docs/report.md says nothing of `{word}`");
    }
}

#[test]
fn the_reference_names_every_key_of_a_report() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let mut words = Vec::new();
    let recording = Some(RecordingReport::default());
    let process_alarms = Some(AlarmTotals::default());
    let report = Report { recording, process_alarms, ..made_up::report() };
    keys(&serde_json::to_value(report).unwrap(), &mut words);
    assert!(words.len() > 100);
    for word in words {
        assert!(page.contains(&format!("| `{word}` |")), "docs/report.md says nothing of `{word}`");
    }
}
