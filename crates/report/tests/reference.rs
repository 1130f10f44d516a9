//! docs/report.md against what reports hold.

use isochrone_timing::WarningCode;
use serde_json::Value;

mod made_up;

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

#[test]
fn the_reference_names_every_key_of_a_report_and_every_warning_code() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let mut words = Vec::new();
    keys(&serde_json::to_value(made_up::report()).unwrap(), &mut words);
    assert!(words.len() > 100);
    words.extend(WarningCode::ALL.iter().map(|code| code.as_str().to_owned()));
    for word in words {
        assert!(page.contains(&format!("| `{word}` |")), "docs/report.md says nothing of `{word}`");
    }
}
