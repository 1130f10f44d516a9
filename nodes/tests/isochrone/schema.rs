//! The JSON Schema of a configuration, by a validator that is not ours.

use std::path::Path;
use std::process::Command;

use isochrone_testing::Domain;

use crate::interpreter;

/// Prints for each file the errors that the schema finds, and an empty line.
const VALIDATE: &str = r#"
import json, sys, tomllib
from jsonschema import Draft7Validator
schema = json.load(open("schema.json"))
Draft7Validator.check_schema(schema)
for name in sys.argv[1:]:
    for error in Draft7Validator(schema).iter_errors(tomllib.load(open(name, "rb"))):
        print(".".join(map(str, error.path)), error.message.replace("\n", " "))
    print()
"#;

/// A node whose second line is this.
fn node(line: &str) -> String {
    format!(
        "{line}\n[node]\nname = \"n\"\n[[task]]\nname = \"t\"\nperiod = \"1ms\"\n\
         [[block]]\nname = \"s\"\ntype = \"ScaleLinear\"\n\
         in = {{ x = 1.0, x1 = 0.0, y1 = 0.0, x2 = 1.0, y2 = 1.0, yMin = 0.0, yMax = 1.0 }}\n"
    )
}

#[test]
fn python_finds_every_configuration_of_this_project_valid_and_wrong_ones_invalid() {
    let Some(python) = interpreter::python("jsonschema, tomllib", "jsonschema") else { return };
    let domain = Domain::new();
    domain.write("schema.json", domain.stdout("check --schema"));
    domain.write("validate.py", VALIDATE);
    let validate = |files: &[String]| {
        let mut command = Command::new(&python);
        let output =
            command.arg("validate.py").args(files).current_dir(domain.path("")).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };

    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = |path: &str| {
        let entries = std::fs::read_dir(root.join(path)).unwrap();
        entries.map(|entry| entry.unwrap().path())
    };
    let examples = folder("examples").filter(|path| {
        path.extension().is_some_and(|it| it == "toml") && !path.ends_with("Cargo.toml")
    });
    let golden = folder("golden").map(|case| case.join("config.toml"));
    let reference = root.join("crates/engine/src/reference/example.toml");
    let files = examples.chain(golden).chain([reference]);
    let files: Vec<_> = files.map(|path| path.to_str().unwrap().to_owned()).collect();
    assert!(files.len() > 20, "{files:?}");
    assert_eq!(validate(&files).trim(), "");

    let plain = node("");
    for (text, wanted) in [
        (node("colour = 1"), "Additional properties are not allowed ('colour' was unexpected)"),
        (plain.replace("ScaleLinear", "ScaleLiner"), "'ScaleLiner' is not one of"),
        (plain.replace("{ x =", "{ ex ="), "'x' is a required property"),
        (plain.replace("{ x", "{ ex = 1.0, x"), "block.0.in 'ex' does not match"),
        (plain.replace("{ x = 1.0", "{ x = true"), "block.0.in.x True is not of type"),
        (plain.replace("\"1ms\"", "1"), "task.0.period 1 is not of type 'string'"),
        (plain.replace("[node]", "[node]\ncontrol = \"all\""), "node.control 'all' is not one of"),
        (plain.replace("period", "wake = 1\nperiod"), "task.0.wake 1 is not one of"),
    ] {
        domain.write("wrong.toml", &text);
        let found = validate(&["wrong.toml".to_owned()]);
        assert!(found.contains(wanted), "{wanted}: {found}");
    }
}
