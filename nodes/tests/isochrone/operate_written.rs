//! Values and names as they are written on the command line, and what is said where they are written otherwise.

use isochrone_testing::assert_says;
use isochrone_testing::plants::{TANK, tank};

#[test]
fn each_value_that_cannot_be_read_is_named_with_what_would_be_right() {
    let (domain, _node) = tank(TANK);
    let set = "set tank ramp.setChangeRate=1,5 ramp.defaultOutValue=0x10 beat.timeRange=5mm beat.numberSteps=on. \
               ramp.enDefaultOutValue=5 ramp.callOB=fsat";
    let says = [
        "nothing was changed",
        "ramp.setChangeRate: decimals have a point, not a comma: 1.5",
        "ramp.defaultOutValue: a number of base 16 is written as 16#10, not 0x10",
        "beat.timeRange: \"5mm\" is no time: there is no unit \"mm\"",
        "beat.numberSteps: a value is true, false, a number",
        "5 is no BOOL, as \"ramp.enDefaultOutValue\" is; write true or false",
        "ramp.callOB: there is no task \"fsat\"; give an OB number, calling task, or a task: fast",
    ];
    domain.expect(set, 2, &says);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate"), "10\n");
}

#[test]
fn only_a_time_is_given_with_a_unit() {
    let (domain, _node) = tank(TANK);
    for wrong in ["ramp.defaultOutValue=1.0m", "ramp.setChangeRate=0.5h", "beat.numberSteps=5s"] {
        for verb in ["set tank", "force tank --hold"] {
            let says = ["only a TIME", "write the number alone"];
            domain.expect(&format!("{verb} {wrong}"), 2, &says);
        }
    }
    let refused = domain.expect("set tank ramp.setChangeRate=1.5mm", 2, &["in 1/s"]);
    assert!(!refused.stderr.contains("units are"), "{}", refused.stderr);
    domain.expect("set tank ramp.setChangeRate=1,5", 2, &["a point, not a comma: 1.5"]);
    domain.expect("set tank beat.timeRang=5s", 1, &["did you mean \"beat.timeRange\"?"]);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate beat.numberSteps"), "10\n3\n");
    domain.run("set tank beat.timeRange=0.5s").expect_code(0);
    assert_eq!(domain.stdout("get tank beat.timeRange"), "T#500ms\n");
}

#[test]
fn words_in_another_order_or_without_quotes_are_met_with_what_would_be_right() {
    let (domain, _node) = tank(TANK);
    domain.expect("set ramp.setChangeRate=1", 2, &["the name of the node comes first"]);
    domain.expect("set tank ramp.setChangeRate=1 --comment sensor 3", 2, &["needs quotes"]);
    domain.expect("release tank", 2, &["--all"]);
    domain.expect("undo tank x", 2, &["number of a transaction"]);
    domain.expect("set tank ramp.setChangeRate=1 --at 5s", 2, &["+500"]);
    domain.expect("set tank ramp.set*=1", 1, &["write each name"]);
    domain.expect("get tank tank.toml", 1, &["is a file in this folder", "quotes"]);
    let ahead = domain.stdout("set tank ramp.setChangeRate=2 --at +50");
    assert_says(&ahead, &["transaction 1, from cycle ", "10  -> 2"]);
}
