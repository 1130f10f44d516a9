//! A pin that can be without a value, set and set back by a user.

use crate::program::assert_says;
use isochrone_testing::Domain;

const TANK: &str = r#"
[node]
name = "tank"
[[task]]
name = "fast"
period = "10ms"
ob = 35
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
[block.in]
value = 25.0
setChangeRate = 10.0
callOB = 35            # as the others
[[block]]
name = "free"
type = "LimRateOfChangeCI"
in = { value = 25.0, setChangeRate = 10.0 }
[[output]]
service = "tank/out"
signals = ["ramp.delayedValue"]
"#;

#[test]
fn a_call_ob_is_set_back_as_it_is_shown_and_saved_and_replayed_so() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", TANK, "--record tank.mcap");
    domain.run("set tank free.callOB=35").expect_code(0);
    let back = ["set", "tank", "free.callOB=calling task", "ramp.callOB=NaN"];
    let back = domain.start_with(&back).finish().expect_code(0);
    assert_says(
        &back.stdout,
        &["free.callOB  35  -> calling task", "ramp.callOB  35  -> calling task"],
    );
    let shown = domain.run("get tank free.callOB ramp.callOB").expect_code(0);
    assert_eq!(shown.stdout, "calling task\ncalling task\n");
    assert_says(&domain.run("journal tank").expect_code(0).stdout, &["35  -> calling task"]);
    for pin in ["ramp.setChangeRate", "ramp.enDefaultOutValue"] {
        let refused = domain.start_with(&["set", "tank", &format!("{pin}=calling task")]);
        let refused = refused.finish().expect_code(2);
        assert_says(&refused.stderr, &["\"calling task\" is for a callOB"]);
        let refused = domain.run(&format!("set tank {pin}=NaN")).expect_code(1);
        assert_says(&refused.stderr, &["NaN is no"]);
    }
    let saved = domain.run("save tank").expect_code(0).stdout;
    assert_eq!(saved, TANK.replace("callOB = 35            #", "callOB = nan           #"));
    domain.write("saved.toml", &saved);
    domain.run("check saved.toml").expect_code(0);
    node.stop().expect_code(0);
    let again = domain.run("replay tank.mcap").expect_code(0);
    assert_says(&again.stdout, &["the same"]);
}
