//! Variables: what operators do to them from the command line, and what the node makes of it.

use isochrone_testing::{Domain, Ended, Plant, Process, assert_says, wait_until};
use serde_json::json;

/// A set point that a ramp of its task and one of another read, and a switch. `fast` publishes the set point and what
/// follows it at once.
const NODE: &str = r#"
[node]
name = "oven"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[task]]
name = "slow"
period = "20ms"
[[variable]]
name = "setpoint"
type = "LREAL"
initial = 20.0      # in degrees
range = [0.0, 100.0]
task = "fast"
[[variable]]
name = "on"
type = "BOOL"
initial = false
task = "fast"
[[block]]
name = "heat"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "setpoint", setChangeRate = inf, enDefaultOutValue = "on", defaultOutValue = -1.0 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "setpoint", setChangeRate = 1000.0 }
[[output]]
service = "oven/out"
task = "fast"
signals = ["setpoint", "on", "heat.delayedValue"]
"#;

fn oven(arguments: &str) -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("oven.toml", NODE, arguments);
    (domain, node)
}

#[test]
fn a_variable_is_shown_set_undone_and_forced_by_its_name() {
    let (domain, node) = oven("");
    let shown = domain.stdout("show oven setpoint on late.value");
    let rows: Vec<Vec<&str>> =
        shown.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[1], ["setpoint", "20", "variable", "LREAL", "0", "to", "100"]);
    assert_eq!(rows[2], ["on", "FALSE", "variable", "BOOL"]);
    assert_eq!(rows[3][..3], ["late.value", "20", "wired"]);
    let settable = domain.stdout("show oven --parameters --names");
    assert!(
        settable.starts_with("setpoint\non\nheat.") && !settable.contains(".value\n"),
        "{settable}"
    );
    let described = &domain.answer("show oven setpoint --json")["signals"][0];
    let said = ["role", "type", "unit", "ok", "limits", "doc"].map(|key| &described[key]);
    let expected = [
        &json!("variable"),
        &json!("LREAL"),
        &json!(null),
        &json!(null),
        &json!([0.0, 100.0]),
        &json!("Value that operators give."),
    ];
    assert_eq!(said, expected);

    domain.run("set oven setpoint=35.5 on=TRUE --comment warm").expect_code(0).prints(&[
        "transaction 1, from cycle ",
        "  setpoint  20     -> 35.5\n",
        "  on        FALSE  -> TRUE\n",
    ]);
    assert_eq!(domain.stdout("get oven setpoint on heat.delayedValue"), "35.5\nTRUE\n-1\n");
    wait_until("the other task has read it", || {
        domain.stdout("get oven late.delayedValue") == "35.5\n"
    });
    domain.expect(
        "set oven setpoint=101 setpont=1 on=2 setpoint.ok=1",
        1,
        &[
            "101 is outside the limits of \"setpoint\", 0.0 to 100.0",
            "did you mean \"setpoint\"?",
            "2 is no BOOL",
            "setpoint is a variable, which has its value alone",
        ],
    );
    domain.run("force oven setpoint=50 --hold").expect_code(0);
    wait_until("the other task has read the force", || {
        domain.answer("show oven late.value --json")["signals"][0]["quality"] == json!(["FORCED"])
    });
    domain.expect("force oven setpoint=-1 --hold", 1, &["-1 is outside the limits"]);
    domain.run("set oven setpoint=40").expect_code(0).says(&["\"setpoint\" is forced"]);
    domain.run("get oven setpoint").expect_code(0).prints(&["50\n"]).says(&["is FORCED"]);
    domain.run("release oven setpoint").expect_code(0).prints(&["setpoint  50  -> 40"]);
    domain.run("undo oven").expect_code(0).prints(&["40  -> 35.5"]);
    let journal = domain.stdout("journal oven");
    assert_says(&journal, &["set 1, cycle ", ": warm\n  setpoint  20     -> 35.5\n", "release "]);

    let saved = domain.stdout("save oven");
    let expected = NODE.replace("20.0      #", "35.5      #").replace("= false\n", "= true\n");
    assert_eq!(saved, expected);
    domain.run("save oven --in-place").expect_code(0);
    drop(node.stop().expect_code(0));
    domain.run("check --strict oven.toml").expect_code(0).prints(&[
        "2 tasks, 0 inputs, 2 variables, 2 blocks, 1 output",
        "    setpoint  LREAL  initial 35.5, from 0.0 to 100.0\n",
    ]);
}

#[test]
fn what_reads_two_variables_sees_both_new_values_in_one_cycle() {
    let (domain, _node) = oven("");
    let mut scope = domain.start_with(&[
        "scope",
        "oven",
        "--trigger",
        "rising on",
        "setpoint",
        "on",
        "heat.value",
        "--pre",
        "20ms",
        "--post",
        "20ms",
        "-o",
        "shot.csv",
    ]);
    scope.wait_for("armed: waiting for rising on");
    domain.run("set oven setpoint=7.25 on=TRUE").expect_code(0);
    scope.finish().expect_code(0);
    let shot = domain.read("shot.csv");
    let rows: Vec<&str> = shot.lines().collect();
    let first = rows.iter().position(|row| row.starts_with("0.0,")).unwrap();
    let values = |row: &str| row.split(',').skip(2).take(3).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(values(rows[0]), ["setpoint", "on", "heat.value"]);
    assert_eq!(values(rows[first - 1]), ["20.0", "0.0", "20.0"], "{shot}");
    assert_eq!(values(rows[first]), ["7.25", "1.0", "7.25"], "{shot}");
}

#[test]
fn apply_adds_and_removes_variables_and_keeps_what_was_set() {
    let (domain, _node) = oven("");
    domain.run("set oven setpoint=35.5").expect_code(0);
    let rate =
        "[[variable]]\nname = \"rate\"\ninitial = 3\ntask = \"slow\"\n[[variable]]\nname = \"on\"";
    let new = NODE
        .replace("[[variable]]\nname = \"on\"", rate)
        .replace("setChangeRate = 1000.0", "setChangeRate = \"rate\"");
    domain.write("new.toml", &new);
    let dry = domain.stdout("apply oven new.toml --dry-run");
    let changes = "\n  added    rate\n  removed  nothing\n  changed  late.setChangeRate: 1000 -> rate\n  \
        stays    setpoint at 35.5, as it was set (the file has 20)\n  kept     heat\n           late\n";
    assert_says(&dry, &[changes]);
    domain.run("apply oven new.toml --allow-missed").expect_code(0).prints(&[changes]);
    assert_eq!(domain.stdout("get oven setpoint rate late.setChangeRate"), "35.5\n3\n3\n");
    domain.run("set oven rate=2.5").expect_code(0);

    domain.write("narrow.toml", new.replace("[0.0, 100.0]", "[0.0, 30.0]"));
    domain.expect("apply oven narrow.toml", 1, &["35.5 is outside the limits of \"setpoint\""]);
    domain.write("other.toml", new.replace("initial = 20.0 ", "initial = 25.0 "));
    domain
        .run("apply oven other.toml --allow-missed")
        .expect_code(0)
        .prints(&["setpoint: 35.5 -> 25\n"]);
    assert_eq!(domain.stdout("get oven setpoint rate"), "25\n2.5\n");
    domain.run("apply oven oven.toml --allow-missed").expect_code(0).prints(&["  removed  rate\n"]);
    domain.expect("get oven rate", 1, &["there is no signal \"rate\""]);
}

#[test]
fn a_recorded_run_repeats_what_was_set_bit_for_bit() {
    let (domain, node) = oven("--record run.mcap");
    assert_eq!(domain.stdout("get oven setpoint"), "20\n", "a cycle had the initial value");
    for arguments in [
        "set oven setpoint=0.1 on=TRUE",
        "set oven on=FALSE",
        "force oven setpoint=3 --seconds 0.1",
    ] {
        domain.run(arguments).expect_code(0);
    }
    let new = NODE.replace(
        "name = \"on\"",
        "name = \"more\"\ninitial = 1.5\ntask = \"slow\"\n[[variable]]\nname = \"on\"",
    );
    domain.write("new.toml", new.replace("setChangeRate = 1000.0", "setChangeRate = \"more\""));
    domain.run("apply oven new.toml --allow-missed").expect_code(0);
    for arguments in ["set oven setpoint=0.3 more=0.7", "undo oven"] {
        domain.run(arguments).expect_code(0);
    }
    node.stop().expect_code(0);
    let said = domain.run("replay run.mcap").expect_code(0).stdout;
    assert!(said.starts_with("the same, bit for bit: "), "{said}");
    // The same operations on another initial value: only what was before the first set differs.
    domain.write("other.toml", NODE.replace("initial = 20.0 ", "initial = 21.0 "));
    domain.expect("replay run.mcap --config other.toml", 1, &["setpoint"]);
}

#[test]
fn a_column_of_the_table_gives_a_variable_its_values_in_simulate() {
    let domain = Domain::with(&[("oven.toml", NODE)]);
    let header = "cycle,setpoint,on,heat.delayedValue\n";
    let out = domain.run("simulate oven.toml --cycles 2").silently();
    assert_eq!(out, format!("{header}0,20.0,0.0,20.0\n1,20.0,0.0,20.0\n"));
    domain.write("in.csv", "setpoint\n1.5\n2.5\n");
    let out = domain.run("simulate oven.toml --inputs in.csv --cycles 3").silently();
    assert_eq!(out, format!("{header}0,1.5,0.0,1.5\n1,2.5,0.0,2.5\n2,2.5,0.0,2.5\n"));
    domain.write("in.csv", "on,setpoint\n0,1\n2,NaN\n1,3\n");
    let Ended { stdout, stderr, .. } =
        domain.run("simulate oven.toml --inputs in.csv").expect_code(0);
    assert_eq!(stdout, format!("{header}0,1.0,0.0,1.0\n1,1.0,0.0,1.0\n2,3.0,1.0,-1.0\n"));
    assert_says(&stderr, &["note: 2 samples were rejected", "cannot hold", "(cycle 1)"]);
    domain.write("in.csv", "setpoint.ok\n1\n");
    domain.expect("simulate oven.toml --inputs in.csv", 2, &["\"setpoint.ok\"", "setpoint, on"]);
}

#[test]
fn an_input_without_a_service_is_noted_and_refused_where_run_would_refuse_it() {
    let text = Plant::new("deaf").task("t", "1ms").column("x", "BOOL").output("out", &["x"]);
    let folder = Domain::with(&[("deaf.toml", &text)]);
    let shown = folder.run("check deaf.toml").silently();
    assert_says(
        &shown,
        &[
            "    x  BOOL  no service (only for simulate)  default FALSE\n",
            "  deaf.toml:7:8: input \"x\" has no service: ",
            "make a [[variable]] of a value that operators give",
        ],
    );
    let input = &folder.run("check --json deaf.toml").json()["tasks"][0]["inputs"][0];
    assert_eq!((&input["service"], &input["default"]), (&json!(null), &json!(false)));
    let refused = folder.run("check --strict deaf.toml").refused(2);
    assert_says(&refused, &["[deaf.toml:7:8]", "input \"x\" has no service", "[[variable]]"]);
    assert_eq!(folder.run("run deaf.toml").refused(2), refused);
    folder.run("simulate deaf.toml --cycles 1").silently();
}
