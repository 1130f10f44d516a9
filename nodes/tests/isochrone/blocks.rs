//! `blocks`: the catalogue in four forms.

use isochrone_blocks::{CATALOGUE, Origin, Pin, PinDefault, PinType};
use isochrone_testing::{Domain, assert_says};
use serde_json::{Value, json};

fn blocks(args: &str) -> String {
    Domain::new().run(&format!("blocks {args}")).silently()
}

fn documents(args: &str) -> Vec<Value> {
    let document: Value = serde_json::from_str(&blocks(args)).unwrap();
    document["blocks"].as_array().unwrap().clone()
}

#[test]
fn the_text_shows_every_block_with_every_pin_and_status_word() {
    let overview = blocks("");
    for known in CATALOGUE {
        let shown = &blocks(known.name);
        assert!(shown.starts_with(&format!("{}\n", known.name)), "{shown}");
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let row = words(&format!("{} {}", known.name, known.doc()));
        assert!(overview.lines().any(|line| words(line) == row), "{row} in\n{overview}");
        let rows: Vec<Vec<&str>> =
            shown.lines().map(|line| line.split_whitespace().collect()).collect();
        for (direction, pins) in [("in", known.inputs), ("out", known.outputs)] {
            for pin in pins {
                let cells = [direction, pin.name, pin.pin_type.as_str()];
                assert!(rows.iter().any(|row| row.starts_with(&cells)), "{cells:?} in\n{shown}");
            }
        }
        if let Some(document) = known.follows {
            assert_says(shown, &[format!("  Follows {document}.\n")]);
        }
        for word in known.status {
            let code = format!("16#{:04X}", word.code);
            let row = rows.iter().find(|row| row.starts_with(&[&code, word.name]));
            let row = row.unwrap_or_else(|| panic!("{word:?} in\n{shown}")).join(" ");
            assert_says(&row, &[word.meaning]);
            assert_eq!(row.ends_with("(isochrone's word, not LGF's)"), word.origin == Origin::Ours);
        }
        for sentence in known.computes {
            assert_says(shown, &[format!("    {sentence}\n")]);
        }
        for decision in known.decisions {
            assert_says(shown, &[format!("    {}: {}\n", decision.silent_on, decision.chosen)]);
        }
    }
}

#[test]
fn defaults_are_written_as_in_the_documents_of_the_library() {
    for (block, row) in [
        ("LimRateOfChangeCI", "in value LREAL 0.0 Signal"),
        ("LimRateOfChangeCI", "in setChangeRate LREAL 0.0 1/s Rate"),
        ("LimRateOfChangeCI", "in enDefaultOutValue BOOL FALSE Preset"),
        ("LimRateOfChangeCI", "in callOB INT calling task Cyclic-interrupt"),
        ("ScaleLinear", "in yMax LREAL required High"),
        ("ScaleLinear", "out y LREAL Scaled"),
        ("SawTooth", "in timeRange TIME 0 ms Time"),
    ] {
        let text = blocks(block);
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.lines().any(|line| words(line).starts_with(row)), "{row:?} in\n{text}");
    }
}

#[test]
fn one_block_can_be_asked_for() {
    let text = blocks("SawTooth");
    assert!(text.starts_with("SawTooth\n  Generates"), "{text}");
    assert!(!text.contains("ScaleLinear") && !text.ends_with("\n\n"), "{text}");
    let [saw] = documents("SawTooth --json").try_into().unwrap();
    assert_eq!(saw["name"], "SawTooth");
    let markdown = blocks("SawTooth --format markdown");
    assert_eq!(markdown.lines().count(), 3, "{markdown}");
}

#[test]
fn a_block_type_that_does_not_exist_is_refused_with_those_that_do() {
    let names: Vec<_> = CATALOGUE.iter().map(|known| known.name).collect();
    for name in ["SawTeeth", "sawtooth", "LimRate"] {
        for form in ["", "--json", "--format markdown"] {
            let error = Domain::new().run(&format!("blocks {name} {form}")).refused(2);
            assert_says(&error, &[format!("\"{name}\"")]);
            assert_says(&error, &names);
        }
    }
}

#[test]
fn the_json_holds_the_whole_catalogue() {
    let pin = |pin: &Pin| json!({ "name": pin.name, "type": pin.pin_type.as_str(), "unit": pin.unit, "doc": pin.doc(), "aliases": pin.aliases });
    let input = |input: &Pin| {
        let mut value = pin(input);
        value["required"] = json!(input.default == PinDefault::Required);
        value["default"] = match (input.default, input.pin_type) {
            (PinDefault::Required | PinDefault::CallingTask, _) => json!(null),
            (PinDefault::Value(slot), PinType::Bool) => json!(slot == 1.0),
            (PinDefault::Value(slot), PinType::Lreal) => json!(slot),
            (PinDefault::Value(slot), _) => json!(slot as i64),
        };
        value["latched_by"] = json!(input.latched_by);
        value
    };
    let blocks = documents("--json");
    assert_eq!(blocks.len(), CATALOGUE.len() + 1, "and Expr");
    for (known, shown) in CATALOGUE.iter().zip(blocks) {
        assert_eq!(shown["name"], known.name);
        assert_eq!(shown["doc"], known.doc());
        assert_eq!(shown["follows"], json!(known.follows));
        assert_eq!(
            shown["inputs"],
            known.inputs.iter().map(input).collect::<Value>(),
            "{}",
            known.name
        );
        assert_eq!(
            shown["outputs"],
            known.outputs.iter().map(pin).collect::<Value>(),
            "{}",
            known.name
        );
        let status = known.status.iter().map(|word| {
            json!({
                "code": word.code,
                "word": format!("16#{:04X}", word.code),
                "name": word.name,
                "origin": if word.origin == Origin::Ours { "ours" } else { "document" },
                "meaning": word.meaning,
            })
        });
        assert_eq!(shown["status"], status.collect::<Value>(), "{}", known.name);
        assert_eq!(shown["computes"], json!(known.computes), "{}", known.name);
        let decisions = known.decisions.iter();
        let decisions = decisions.map(|d| json!({ "silent_on": d.silent_on, "chosen": d.chosen }));
        assert_eq!(shown["decisions"], decisions.collect::<Value>(), "{}", known.name);
    }
}

#[test]
fn the_two_ways_to_ask_for_json_are_one() {
    assert_eq!(blocks("--json"), blocks("--format json"));
    let error = Domain::new().run("blocks --json --format text").refused(2);
    assert_says(&error, &["--json", "--format"]);
}

#[test]
fn the_markdown_is_one_table_with_a_row_for_each_document_and_all_blocks() {
    let markdown = blocks("--format markdown");
    assert!(markdown.lines().all(|line| line.matches('|').count() == 3), "two cells: {markdown}");
    for known in CATALOGUE {
        assert_eq!(markdown.matches(&format!("`{}`", known.name)).count(), 1, "{markdown}");
    }
}
