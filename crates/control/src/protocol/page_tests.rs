//! What the page on the control protocol says is what there is.

use std::collections::BTreeSet;

use super::Method;
use crate::Code;

fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/control.md");
    std::fs::read_to_string(path).unwrap()
}

/// What the page says of a method.
fn section(page: &str, method: &str) -> String {
    let (_, methods) = page.split_once("## Methods").unwrap();
    let start = format!("\n### {method}\n");
    let (_, section) = methods
        .split_once(&start)
        .unwrap_or_else(|| panic!("docs/control.md has no heading `### {method}`"));
    section.split("\n### ").next().unwrap().to_owned()
}

fn members(value: &serde_json::Value, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(object) => {
            found.extend(object.keys().filter(|key| *key != "TASK" && *key != "NAME").cloned());
            object.values().for_each(|value| members(value, found));
        }
        serde_json::Value::Array(items) => items.iter().for_each(|item| members(item, found)),
        _ => {}
    }
}

#[test]
fn every_method_is_described_with_all_of_its_parameters_and_results() {
    let page = page();
    for method in Method::ALL {
        let mut text = section(&page, method.as_str());
        for parameter in method.params() {
            assert!(text.contains(&format!("`{parameter}`")), "{method:?} lacks {parameter}");
        }
        if text.contains("as for `set`") {
            text += &section(&page, "set");
        }
        // What every finding has stands under the errors.
        text += page.split_once("### Errors").unwrap().1.split("\n## ").next().unwrap();
        let mut found = BTreeSet::new();
        members(&serde_json::to_value(method.example()).unwrap(), &mut found);
        for member in found {
            assert!(text.contains(&format!("`{member}`")), "{method:?} lacks {member}");
        }
    }
}

#[test]
fn every_code_is_described() {
    let page = page();
    for code in Code::ALL {
        assert!(page.contains(&format!("\n| {} |", code.number())), "{code:?}");
    }
}
