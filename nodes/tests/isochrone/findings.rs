//! Each error of a configuration: where it is, what is wrong, and the way out.

use isochrone_testing::{Domain, assert_says};
use serde_json::{Value, json};

/// A configuration without errors, to be spoiled.
const PLANT: &str = r#"[node]
name = "plant"

[[task]]
name = "fast"
period = "1ms"
ob = 35

[[task]]
name = "slow"
period = "10ms"
phase = "0us"

[[input]]
name = "raw"
service = "plant/analog"
task = "fast"

[[input]]
name = "switch"
type = "BOOL"
service = "plant/switch"
task = "slow"

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 2
[block.in]
value = "raw"
setChangeRate = "rate.{i}.y@prev"

[[block]]
name = "rate"
type = "ScaleLinear"
task = "fast"
count = 2
[block.in]
x = "ramp.{i}.delayedValue"
x1 = 0.0
y1 = 0.0
x2 = 1.0
y2 = 1.0
yMin = 0.0
yMax = 1.0

[[block]]
name = "saw"
type = "SawTooth"
task = "slow"
[block.in]
incrementRange = 1
endlessSteps = "switch"

[[output]]
service = "plant/saw"
task = "slow"
signals = ["saw.value"]
"#;

/// Stands in a spoiled text where the error is.
const HERE: char = '§';

struct Case {
    code: &'static str,
    /// What is replaced, and by what.
    edits: &'static [(&'static str, &'static str)],
    says: &'static [&'static str],
}

const fn case(
    code: &'static str,
    edits: &'static [(&'static str, &'static str)],
    says: &'static [&'static str],
) -> Case {
    Case { code, edits, says }
}

#[rustfmt::skip]
const CASES: &[Case] = &[
    case("unknown_key", &[("phase = ", "§phsae = ")], &["[[task]] has no key \"phsae\"", "did you mean \"phase\"?"]),
    case("unknown_key", &[("[[output]]", "[§extra]\n[[output]]")], &["\"extra\""]),
    case("bad_name", &[("\"plant\"", "§\"Plant 1\"")], &["\"Plant 1\"", "lowercase"]),
    case("missing_key", &[("ob = 35\n\n[[task]]\nname = \"slow\"\nperiod = \"10ms\"", "ob = 35\n\n§[[task]]\nname = \"slow\"")], &["no period", "write period = "]),
    // Durations.
    case("out_of_range", &[("\"10ms\"", "§\"0ms\"")], &["period 0ms is out of range", "from \"10us\" to \"1h\""]),
    case("out_of_range", &[("\"10ms\"", "§\"9us\"")], &["period 9us", "from \"10us\" to \"1h\""]),
    case("out_of_range", &[("\"10ms\"", "§\"61min\"")], &["period 61min", "from \"10us\" to \"1h\""]),
    case("out_of_range", &[("\"10ms\"", "§\"-10ms\"")], &["\"-10ms\"", "negative", "from \"10us\" to \"1h\""]),
    case("out_of_range", &[("\"10ms\"", "§\"10 parsec\"")], &["no unit \"parsec\"", "ns, us, ms, s, min, h"]),
    case("out_of_range", &[("\"10ms\"", "§\"10\"")], &["the unit is missing", "\"10ms\""]),
    case("out_of_range", &[("\"10ms\"", "§\"10.0000001ms\"")], &["whole nanoseconds"]),
    case("wrong_type", &[("\"10ms\"", "§10")], &["period is a duration such as \"1ms\", not an integer"]),
    case("out_of_range", &[("\"0us\"", "§\"10ms\"")], &["phase is not less than the period"]),
    // Numbers and words.
    case("out_of_range", &[("ob = 35", "ob = §39")], &["ob 39", "30 to 38 or 123 to 32767"]),
    case("out_of_range", &[("ob = 35", "ob = 35\npriority = §90")], &["priority 90", "from 1 to 89"]),
    case("out_of_range", &[("ob = 35", "ob = 35\nwake = §\"spinn\"")], &["\"spinn\"", "did you mean \"spin\"?"]),
    case("out_of_range", &[("\"BOOL\"", "§\"BOLL\"")], &["\"BOLL\"", "did you mean \"BOOL\"?"]),
    case("out_of_range", &[("type = \"BOOL\"", "type = \"BOOL\"\ndefault = §2")], &["default 2", "BOOL can hold"]),
    case("out_of_range", &[("\"plant/analog\"", "\"plant/analog\"\nchannel = §-1")], &["channel -1", "from 0 to 65535"]),
    case("out_of_range", &[("type = \"SawTooth\"", "type = \"SawTooth\"\ncount = §0")], &["count 0", "from 1 to"]),
    // Names that stand twice.
    case("duplicate", &[("[[input]]\nname = \"raw\"", "[[task]]\nname = §\"fast\"\nperiod = \"1ms\"\n[[input]]\nname = \"raw\"")], &["task \"fast\" is taken"]),
    case("duplicate", &[("[[block]]\nname = \"saw\"", "[[input]]\nname = §\"raw\"\ntask = \"fast\"\n[[block]]\nname = \"saw\"")], &["input \"raw\" is taken"]),
    case("duplicate", &[("[[output]]", "[[block]]\nname = §\"saw\"\ntype = \"SawTooth\"\ntask = \"slow\"\n[[output]]")], &["block \"saw\" is taken"]),
    case("duplicate", &[("[\"saw.value\"]", "[\"saw.value\"]\n[[output]]\nservice = §\"plant/saw\"\ntask = \"slow\"\nsignals = [\"saw.value\"]")], &["service \"plant/saw\" is taken"]),
    case("duplicate", &[("\"0us\"", "\"0us\"\nob = §35")], &["ob \"35\" is taken"]),
    // What does not exist.
    case("unknown_block_type", &[("\"SawTooth\"", "§\"SawTooht\"")], &["\"SawTooht\"", "did you mean \"SawTooth\"?"]),
    case("unknown_block_type", &[("\"SawTooth\"", "§\"Counter\"")], &["\"Counter\"", ": LimRateOfChangeCI", "ScaleLinear"]),
    case("unknown_task", &[("task = \"slow\"\n[block.in]", "task = §\"slwo\"\n[block.in]")], &["no task \"slwo\"", "did you mean \"slow\"?"]),
    case("missing_key", &[("service = \"plant/saw\"\ntask = \"slow\"", "service = §\"plant/saw\"")], &["which task", "fast, slow"]),
    case("unknown_pin", &[("value = \"raw\"", "§valeu = \"raw\"")], &["LimRateOfChangeCI has no input pin \"valeu\"", "did you mean \"value\"?"]),
    case("unknown_pin", &[("value = \"raw\"", "§delayedValue = 1.0")], &["delayedValue is an output pin"]),
    case("unknown_pin", &[("\"saw.value\"", "§\"saw.valeu\"")], &["block \"saw\" (SawTooth) has no output pin \"valeu\"", "did you mean \"saw.value\"?"]),
    case("unknown_pin", &[("\"saw.value\"", "§\"saw.reset\"")], &["reset is an input pin"]),
    case("unknown_pin", &[("\"saw.value\"", "§\"rate.0.Ret_Val\"")], &["(ScaleLinear) has no output pin \"Ret_Val\"", "what LGF calls Ret_Val is pin \"y\" here"]),
    case("unknown_pin", &[("\"saw.value\"", "§\"ramp.0.subFunctionStatus\"")], &["what LGF calls subFunctionStatus is pin \"subfunctionStatus\" here"]),
    case("unknown_task", &[("value = \"raw\"", "value = \"raw\"\ncallOB = §\"slwo\"")], &["no task or input \"slwo\"", "did you mean \"slow\"?"]),
    case("duplicate", &[("value = \"raw\"", "value = \"raw\"\ncallOB = §\"slow\""), ("[[block]]\nname = \"ramp\"", "[[input]]\nname = \"slow\"\ntype = \"INT\"\ntask = \"fast\"\n[[block]]\nname = \"ramp\"")], &["\"slow\" at pin callOB is a task and an input", "another name"]),
    case("out_of_range", &[("incrementRange = 1", "timeRange = §\"T#1.5ms\"")], &["pin timeRange \"T#1.5ms\": there are fractions of a millisecond", "\"T#100ms\""]),
    case("out_of_range", &[("incrementRange = 1", "timeRange = §\"100\"")], &["the unit is missing: \"100ms\"?"]),
    case("unknown_source", &[("value = \"raw\"", "value = §\"raww\"")], &["no input \"raww\"", "did you mean \"raw\"?"]),
    case("unknown_source", &[("value = \"raw\"", "value = §\"saw\"")], &["saw is a block", "\"saw.value\""]),
    case("unknown_source", &[("value = \"raw\"", "value = §\"saww.value\"")], &["no block \"saww\"", "did you mean \"saw\"?"]),
    case("unknown_source", &[("value = \"raw\"", "value = §\"raw@prev\"")], &["is an input", "@prev goes behind"]),
    case("unknown_source", &[("\"saw.value\"", "§\"rate.2.y\"")], &["no \"rate.2\"", "rate.0 to rate.1"]),
    case("unknown_source", &[("\"saw.value\"", "§\"rate.y\"")], &["which of the 2 instances", "\"rate.0.y\""]),
    case("unknown_source", &[("task = \"fast\"\ncount = 2\n[block.in]\nx = ", "task = \"fast\"\ncount = 3\n[block.in]\nx = §")], &["no \"ramp.2\"", "instance 2 of rate", "ramp.0 to ramp.1"]),
    // Pins.
    case("missing_pin", &[("name = \"rate\"", "name = §\"rate\""), ("yMax = 1.0\n", "")], &["pin yMax of block \"rate\" is not connected", "[block.in]"]),
    case("missing_pin", &[("name = \"rate\"", "name = §\"rate\""), ("yMin = 0.0\nyMax = 1.0\n", "")], &["pins yMin, yMax", "are not connected"]),
    case("type_mismatch", &[("= \"switch\"\n\n[[output]]", "= §\"rate.0.y\"\n\n[[output]]")], &["\"rate.0.y\" is LREAL, but pin endlessSteps takes BOOL"]),
    case("type_mismatch", &[("= \"switch\"\n\n[[output]]", "= §1\n\n[[output]]")], &["1 is no BOOL", "write true or false"]),
    case("type_mismatch", &[("incrementRange = 1", "incrementRange = §1.5")], &["1.5 is no INT", "whole number"]),
    case("type_mismatch", &[("x1 = 0.0", "x1 = §true")], &["true is no LREAL", "a number"]),
    case("out_of_range", &[("incrementRange = 1", "incrementRange = §40000")], &["40000 does not fit", "-32768 to 32767"]),
    case("out_of_range", &[("x1 = 0.0", "x1 = §nan")], &["x1 cannot be NaN"]),
    case("wrong_type", &[("x1 = 0.0", "x1 = §[0.0]")], &["\"x1\"", "not array"]),
    case("loop", &[("\"rate.{i}.y@prev\"", "§\"rate.{i}.y\"")], &["loop: ramp.0 -> rate.0 -> ramp.0", "@prev"]),
    // Services, which iceoryx2 has to carry.
    case("bad_name", &[("\"plant/saw\"", "§\"\"")], &["name", "empty", "such as \"plant/level\""]),
    case("bad_name", &[("\"plant/saw\"", "§\" \"")], &["\" \"", "begins or ends with a blank"]),
    case("bad_name", &[("\"plant/analog\"", "§\"plänt\"")], &["\"plänt\"", "'ä'", "ASCII"]),
    case("bad_name", &[("\"plant/saw\"", "§\"iox2://saw\"")], &["\"iox2://saw\"", "iceoryx2 keeps", "choose another"]),
    case("syntax", &[("ob = 35", "ob = §")], &["not TOML"]),
];

impl Case {
    /// The spoiled text, and line and column of the error.
    fn spoil(&self) -> (String, usize, usize) {
        let mut text = PLANT.to_owned();
        for (from, to) in self.edits {
            assert_eq!(text.matches(from).count(), 1, "{from}");
            text = text.replace(from, to);
        }
        let before = text.split(HERE).next().unwrap();
        let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
        let line = before.matches('\n').count() + 1;
        assert_eq!(text.matches(HERE).count(), 1, "{:?}", self.edits);
        (text.replace(HERE, ""), line, column)
    }
}

fn errors(document: &str) -> Vec<Value> {
    let document: Value = serde_json::from_str(document).unwrap();
    assert_eq!(document["warnings"], json!([]));
    document["errors"].as_array().unwrap().clone()
}

#[test]
fn the_configuration_that_is_spoiled_here_is_right() {
    let folder = Domain::with(&[("plant.toml", PLANT)]);
    folder.run("check --strict plant.toml").silently();
}

#[test]
fn an_error_is_shown_where_it_is_with_the_way_out() {
    for case in CASES {
        let (text, line, column) = case.spoil();
        let folder = Domain::with(&[("plant.toml", &text)]);
        let shown = folder.run("check plant.toml").refused(2);
        let excerpt = text.lines().nth(line - 1).unwrap();
        let place = format!("[plant.toml:{line}:{column}]");
        assert_says(&shown, &["plant.toml: 1 error\n", &place, excerpt]);
        assert_says(&shown, case.says);

        let ran = folder.run("check --json plant.toml");
        assert_eq!((ran.code(), ran.stderr), (2, shown.clone()), "people are told, too");
        let [error] = errors(&ran.stdout).try_into().unwrap_or_else(|all| panic!("{all:?}"));
        let found = (&error["code"], &error["line"], &error["column"]);
        assert_eq!(found, (&json!(case.code), &json!(line), &json!(column)), "{shown}");
        assert_says(&shown, &[error["message"].as_str().unwrap()]);
        if let Some(remedy) = error["remedy"].as_str() {
            assert_says(&shown, &[format!("help: {remedy}")]);
        }
    }
}

#[test]
fn a_service_name_may_be_as_long_as_that_of_its_layouts_allows_and_no_longer() {
    for (length, code) in [(238, 0), (239, 2)] {
        let text = PLANT.replace("plant/saw", &"s".repeat(length));
        let ran = Domain::with(&[("plant.toml", &text)]).run("check plant.toml");
        assert_eq!(ran.code(), code, "{}", ran.stderr);
        if code == 2 {
            assert_says(&ran.refused(2), &["[plant.toml:57:11]", "238"]);
        }
    }
}

#[test]
fn every_verb_that_reads_a_configuration_refuses_it_alike() {
    let (text, ..) = CASES[0].spoil();
    let folder = Domain::with(&[("plant.toml", &text)]);
    let shown = folder.run("check plant.toml").refused(2);
    assert_eq!(folder.run("simulate plant.toml --cycles 3").refused(2), shown);
    assert_eq!(folder.run("run plant.toml --seconds 1").refused(2), shown);
}

#[test]
fn all_errors_of_a_file_are_shown_together_in_its_order() {
    let mut text = PLANT.to_owned();
    let mut places = Vec::new();
    for (from, to) in [
        ("\"plant\"", "§\"Plant\""),
        ("\"1ms\"", "§\"1 parsec\""),
        ("phase = ", "§phsae = "),
        ("\"plant/analog\"", "§\"\""),
        ("value = \"raw\"", "value = §\"rwa\""),
        ("x = \"ramp.{i}.delayedValue\"", "§z = 1.0\nx = 0.0"),
        ("yMin = 0.0", "yMin = §nan"),
        ("\"SawTooth\"", "§\"SawTeeth\""),
        ("\"saw.value\"", "\"saw.value\", §\"rate.7.y\""),
    ] {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    for (line, content) in text.lines().enumerate() {
        if let Some(before) = content.split_once(HERE).map(|(before, _)| before) {
            places.push((line + 1, before.chars().count() + 1));
        }
    }
    let folder = Domain::with(&[("plant.toml", &text.replace(HERE, ""))]);
    let shown = folder.run("check plant.toml").refused(2);
    assert_says(&shown, &["plant.toml: 9 errors\n"]);
    let mut rest = shown.as_str();
    for (line, column) in &places {
        let place = format!("[plant.toml:{line}:{column}]");
        rest = rest.split_once(&place).unwrap_or_else(|| panic!("{place} in order in\n{shown}")).1;
    }
    let found = errors(&folder.run("check --json plant.toml").stdout);
    let found: Vec<_> =
        found.iter().map(|error| (error["line"].clone(), error["column"].clone())).collect();
    let places: Vec<_> = places.iter().map(|(line, column)| (json!(line), json!(column))).collect();
    assert_eq!(found, places);
}

#[test]
fn columns_count_characters_and_a_tab_is_one() {
    let text = PLANT.replace(
        "value = \"raw\"",
        "\tsetChangeRate = 1.0 # ä\n\tdefaultOutValue = 1.0\n\tvalue = \"rwa\"",
    );
    let text = text.replace("setChangeRate = \"rate.{i}.y@prev\"\n", "");
    let ran = Domain::with(&[("plant.toml", &text)]).run("check --json plant.toml");
    assert_eq!(ran.code(), 2);
    assert_eq!(errors(&ran.stdout)[0]["column"], 10);
}
