//! Expressions in a node: what people see of them, do to them and keep of them.

use isochrone_testing::{Domain, Process, cells, wait_until};
use serde_json::{Value, json};

/// A set point and a switch that people give, and expressions on them and on each other.
const NODE: &str = r#"
[node]
name = "tank"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[variable]]
name = "sp"
initial = 6.0
unit = "m"
[[variable]]
name = "div"
initial = 2.0
[[block]]
name = "e"
type = "Expr"
unit = "m"
comment = "What is left to do"
out = { error = "sp - 1.0", isHigh = "sp > 5.0 AND NOT (div = 0.0)", ratio = "sp / div" }
[[block]]
name = "sum"
type = "Expr"
out = { n = 'LREAL_TO_INT("sum.n@prev" + 1)', area = '"sum.area@prev" + e.error' }
[[block]]
name = "twin"
type = "Expr"
count = 2
out = { y = '"twin.{i}.y@prev" + e.ratio' }
[[output]]
service = "tank/out"
signals = ["e.error", "e.isHigh", "e.ratio", "e.status", "sum.n", "sum.area", "twin.1.y"]
"#;

fn tank(arguments: &str) -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, arguments);
    (domain, node)
}

fn value(domain: &Domain, name: &str) -> f64 {
    let answer = domain.answer(&format!("get tank {name} --json"));
    answer["values"][name].as_f64().unwrap_or_else(|| panic!("{answer}"))
}

#[test]
fn check_shows_expressions_with_their_types_and_what_each_depends_on() {
    let domain = Domain::with(&[("tank.toml", NODE)]);
    let ended = domain.run("check tank.toml").expect_code(0);
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let text = words(&ended.stdout);
    for line in [
        "e.isHigh BOOL = sp > 5.0 AND NOT (div = 0.0)",
        "twin.{i}.y LREAL = \"twin.{i}.y@prev\" + e.ratio",
        "sum.area@prev -> sum.area",
        "div -> e.ratio",
        "e.ratio -> twin.1.y",
    ] {
        assert!(text.contains(line), "{line:?} is not in {}", ended.stdout);
    }
    let document = domain.answer("check tank.toml --json");
    let expected = json!({ "output": "sum.n", "type": "INT", "expression": "LREAL_TO_INT(\"sum.n@prev\" + 1)" });
    let expressions = document["tasks"][0]["expressions"].as_array().unwrap();
    assert!(expressions.contains(&expected), "{expressions:?}");
}

#[test]
fn a_simulation_computes_what_the_expressions_say() {
    let domain = Domain::with(&[("tank.toml", NODE)]);
    let csv = domain.stdout("simulate tank.toml --cycles 3");
    let rows = cells(&csv);
    assert_eq!(rows[3][1..], ["5.0", "1.0", "3.0", "0.0", "3.0", "15.0", "9.0"]);
}

#[test]
fn what_feeds_an_expression_is_set_and_its_outputs_are_read_and_forced() {
    let (domain, _node) = tank("");
    domain.run("set tank sp=11 div=0").expect_code(0);
    assert_eq!((value(&domain, "e.error"), value(&domain, "e.ratio")), (10.0, 3.0), "held");
    assert_eq!(value(&domain, "e.status"), f64::from(0x8210));
    domain.run("alarms tank").expect_code(0).prints(&["16#8210", "a division by zero"]);
    domain.run("force tank e.isHigh=true e.ratio=77 --hold").expect_code(0);
    assert_eq!(value(&domain, "e.ratio"), 77.0);
    domain.run("set tank div=10").expect_code(0);
    domain.run("release tank e.ratio").expect_code(0);
    assert_eq!(value(&domain, "e.ratio"), 1.1);
    domain.run("set tank e.error=1").expect_code(1).says(&["output pin"]);
    domain.run("get tank e.sp").expect_code(1).says(&["e.error, e.isHigh, e.ratio, e.status"]);
}

#[test]
fn another_expression_is_an_online_change_that_goes_on_with_the_outputs_of_the_same_name() {
    let (domain, _node) = tank("");
    wait_until("it has counted", || value(&domain, "sum.n") > 20.0);
    let other = NODE
        .replace("+ e.error'", "+ 0.0 * e.error'")
        .replace("sp - 1.0\"", "sp + 100.0\", extra = \"sp > 0.0\"");
    domain.write("other.toml", &other);
    let before = value(&domain, "sum.area");
    let answer = domain.answer("apply tank other.toml --allow-missed --json");
    assert_eq!(answer["changed"], json!(["e.error", "sum.area"]), "{answer}");
    assert_eq!((&answer["added"], &answer["removed"]), (&json!(["e.extra"]), &json!([])));
    assert_eq!(answer["kept"], json!(["e", "sum", "twin"]));
    let texts =
        |values: &Value| (values["before"]["wire"].clone(), values["after"]["wire"].clone());
    assert_eq!(texts(&answer["values"][0]), (json!("sp - 1.0"), json!("sp + 100.0")), "{answer}");
    assert_eq!(value(&domain, "e.error"), 106.0);
    let area = value(&domain, "sum.area");
    assert!(area >= before && (area / 5.0).fract() == 0.0, "{area} after {before}");
    assert!(value(&domain, "sum.n") > 20.0);
    let answer = domain.answer("apply tank tank.toml --allow-missed --json");
    assert_eq!((&answer["added"], &answer["removed"]), (&json!([]), &json!(["e.extra"])));
    let wrong = NODE.replace("sp - 1.0", "spp - 1.0");
    domain.write("wrong.toml", &wrong);
    domain.run("apply tank wrong.toml").expect_code(2).says(&["\"spp\"", "did you mean \"sp\"?"]);
}

#[test]
fn a_forced_or_protected_output_is_not_lost_by_a_change() {
    let (domain, _node) = tank("");
    domain.run("force tank e.ratio=1 --hold").expect_code(0);
    let without = NODE.replace(", ratio = \"sp / div\"", "").replace("e.ratio", "e.error");
    let without = without
        .replace("\"e.error\", \"e.isHigh\", \"e.error\"", "\"e.error\", \"e.isHigh\", \"sp\"");
    domain.write("without.toml", &without);
    domain.run("apply tank without.toml --allow-missed").expect_code(1);
    let other = NODE.replace("sp / div", "sp * div");
    domain.write("other.toml", &other);
    domain.run("apply tank other.toml --allow-missed").expect_code(0);
    assert_eq!(value(&domain, "e.ratio"), 1.0, "the force stays");
    domain.run("release tank e.ratio").expect_code(0);
    assert_eq!(value(&domain, "e.ratio"), 12.0);
}

#[test]
fn save_writes_what_was_set_and_leaves_the_expressions_as_they_are() {
    let (domain, _node) = tank("");
    domain.run("set tank div=4").expect_code(0);
    domain.run("save tank -o saved.toml").expect_code(0);
    assert_eq!(domain.read("saved.toml"), NODE.replace("initial = 2.0", "initial = 4.0"));
}

#[test]
fn a_recorded_run_with_changed_expressions_is_repeated_bit_for_bit() {
    let (domain, node) = tank("--record run.mcap");
    domain.run("set tank sp=0.1 div=0.3").expect_code(0);
    domain.write("other.toml", NODE.replace("+ e.error'", "+ SQRT(ABS(e.error))'"));
    domain.run("apply tank other.toml --allow-missed").expect_code(0);
    domain.run("set tank div=0").expect_code(0);
    node.ends_in_order();
    domain.run("replay run.mcap").expect_code(0).prints(&["the same, bit for bit"]);
}

#[test]
fn a_restart_goes_on_with_accumulated_values_also_with_other_expressions() {
    let retained = NODE.replace("[[task]]", "retain = true\n[[task]]");
    let domain = Domain::with(&[
        ("tank.toml", &retained),
        ("other.toml", &retained.replace("+ e.error'", "+ 2.0 * e.error'")),
    ]);
    let run = |file: &str| {
        domain.run(&format!("run {file} --state tank.state --cycles 10")).expect_code(0);
        let state = domain.answer("state tank.state --json");
        ["sum.n", "sum.area"].map(|name| state["values"][name].as_f64().unwrap())
    };
    assert_eq!(run("tank.toml"), [10.0, 50.0]);
    assert_eq!(run("tank.toml"), [20.0, 100.0]);
    assert_eq!(run("other.toml"), [30.0, 200.0]);
}

#[test]
fn the_printed_page_shows_an_expression_and_what_it_reads() {
    let domain = Domain::with(&[("tank.toml", NODE)]);
    domain.run("document tank.toml -o tank.html").expect_code(0);
    let page = domain.read("tank.html");
    for part in
        ["sp &gt; 5.0 AND NOT (div = 0.0)", "\u{2190} sp, div", "\u{2190} twin.{i}.y@prev, e.ratio"]
    {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("e.sp"), "what an expression reads is no pin");
}

#[test]
fn blocks_shows_how_an_expression_is_written() {
    let domain = Domain::new();
    domain.run("blocks Expr").expect_code(0).prints(&[
        "out = { error = ",
        "16#8210",
        "last good value",
    ]);
    domain.run("blocks Exp").expect_code(2).says(&["Expr"]);
}
