//! A node whose blocks or inputs go wrong says so, once for each time.

use isochrone_testing::{Domain, Plant};

fn troubled() -> Plant {
    Plant::new("troubled")
        .task("t", "2ms")
        .input("rate", "plant/rate", "channel = 0\nmax_age = \"200ms\"\ndefault = 1.0")
        .input("count", "plant/rate", "type = \"INT\"\nchannel = 1")
        .ramp("ramp", "value = 1.0, setChangeRate = \"rate\"")
}

#[test]
fn blocks_and_inputs_that_go_wrong_are_logged_once_with_the_reason() {
    let domain = Domain::with(&[("node.toml", &troubled())]);
    let mut publisher = domain.start_with(&["publish", "plant/rate", "--value=-1,0.5"]);
    publisher.wait_for("publishing");
    let mut node =
        domain.start_until("run node.toml", "block \"ramp\" (LimRateOfChangeCI) reports 16#8200");
    node.wait_for("input \"count\" rejects 0.5, which INT cannot hold; it keeps its value");
    publisher.stop().expect_code(0);
    node.wait_for("input \"rate\" is stale: its last sample");
    let mut publisher = domain.start_with(&["publish", "plant/rate", "--value", "1,2"]);
    node.wait_for("input \"rate\" takes samples again");
    node.wait_for("input \"count\" takes samples again");
    node.wait_for("block \"ramp\" (LimRateOfChangeCI) reports no error any more");
    publisher.wait_for("publishing");
    publisher.stop().expect_code(0);
    let ended = node.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("reports 16#8200").count(), 1, "{}", ended.stderr);
    let again = ended.stderr.lines().filter(|line| line.contains("takes samples again"));
    assert!(!ended.stderr.contains("isochrone_runtime"), "{}", ended.stderr);
    assert!(again.clone().all(|line| line.contains("INFO")), "{}", ended.stderr);
}

#[test]
fn with_fail_on_block_errors_a_node_with_errors_exits_with_status_1() {
    let domain = Domain::with(&[("node.toml", &troubled())]);
    let run = "run node.toml --cycles 50 --fail-on-block-errors";
    domain.run(run).expect_code(0);
    domain.write("node.toml", troubled().replace("default = 1.0", "default = -1.0"));
    domain.expect(run, 1, &["task \"t\": 50 steps of blocks reported an error"]);
    domain.run("run node.toml --cycles 50").expect_code(0);
}

/// A block whose rate of change follows a wave, and one that goes wrong in between.
fn chatter() -> Plant {
    Plant::new("chatter")
        .task("t", "2ms")
        .input("rate", "plant/rate", "signal = \"rate\"")
        .input("rest", "plant/other", "channel = 0\ndefault = 1.0")
        .ramp("chatters", "value = 1.0, setChangeRate = \"rate\"")
        .ramp("other", "value = 1.0, setChangeRate = \"rest\"")
}

#[test]
fn a_block_that_chatters_hides_no_other_and_its_last_state_is_told() {
    let domain = Domain::with(&[("node.toml", &chatter())]);
    let wave = "publish plant/rate --wave square --frequency 50 --rate 500 --signals rate";
    let publisher = domain.start_until(wave, "publishing");
    let mut node = domain.start_until("run node.toml", "such messages were left out)");
    let other = domain.start_with(&["publish", "plant/other", "--value=-1"]);
    node.wait_for("block \"other\" (LimRateOfChangeCI) reports 16#8200");
    publisher.stop().expect_code(0);
    // Whatever was said last of the wave, its block is well in the end.
    domain.run("publish plant/rate --value 1 --signals rate --rate 100 --count 50").expect_code(0);
    let ended = node.stop().expect_code(0);
    other.stop().expect_code(0);
    let of = |block: &str| {
        let lines =
            ended.stderr.lines().filter(|line| line.contains(&format!("block \"{block}\"")));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let last = of("chatters").pop().unwrap();
    assert!(last.contains("no error any more"), "{}", ended.stderr);
    let other = of("other");
    assert!(other.len() == 1 && !other[0].contains("left out"), "{}", ended.stderr);
}
