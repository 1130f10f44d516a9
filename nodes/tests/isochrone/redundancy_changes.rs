//! Two processes of one node: another configuration, and what is too large or comes too often.

use crate::redundancy::{
    RUN, Reader, STEP, assert_goes_on, domain, holder, ramps, redundancy, standby, takeovers,
};
use isochrone_testing::{Domain, Plant, wait_until};
use serde_json::json;

/// The ramps, and so many more in the fast task.
fn with_more(count: u32) -> String {
    let more = format!(
        "name = \"more\"\ntype = \"LimRateOfChangeCI\"\ntask = \"fast\"\ncount = {count}\n\
         [block.in]\nvalue = 1e6\nsetChangeRate = 1.0\n[[block]]\nname = \"late\""
    );
    ramps().to_string().replace("name = \"late\"", &more)
}

#[test]
fn a_configuration_is_changed_between_two_standbys_and_no_cycle_is_lost() {
    let domain = domain();
    let mut holds = holder(&domain);
    let fast = Reader::of(&domain, "level/fast");
    // With more blocks, with fewer, and with other constants.
    let more = with_more(90);
    let other = ramps().to_string().replace("20.0", "10.0");
    // A busy machine leaves no time between two cycles.
    for (file, text) in [("more.toml", more), ("other.toml", other)] {
        domain.write(file, &text);
        domain.run(&format!("apply level {file} --allow-missed")).expect_code(0);
        domain.expect(RUN, 1, &["runs another configuration"]);
        let run = format!("run {file} --redundant --after 100");
        let mut stands_by = domain.start_until(&run, "can be taken over");
        holds.kill();
        stands_by.wait_for("is taken over by this process");
        holds = stands_by;
    }
    let values = domain.answer("get level late.setChangeRate ramp.delayedValue --json");
    assert_eq!(values["values"]["late.setChangeRate"], json!(10.0));
    let (frames, [restarts, others, _]) = fast.end();
    assert_goes_on(&frames, STEP);
    assert_eq!((takeovers(&frames), restarts, others), (2, 0, 0));
}

#[test]
fn a_configuration_with_more_state_than_can_be_handed_over_is_refused_and_the_node_goes_on() {
    let domain = domain();
    let _first = holder(&domain);
    domain.write("many.toml", with_more(2_000));
    let help = ["room for", "end both processes of the node"];
    domain.expect("apply level many.toml --allow-missed", 1, &help);
    domain.write("most.toml", with_more(50_000));
    let limit = ["a redundant node at most 1048576"];
    domain.expect("apply level most.toml --allow-missed", 1, &limit);
    let _second = standby(&domain);
}

#[test]
fn the_journal_of_a_process_that_takes_over_again_has_the_configuration_that_was_applied() {
    let domain = domain();
    let other = ramps().to_string().replace("20.0", "10.0");
    domain.write("other.toml", &other);
    let run = |file: &str| format!("run {file} --redundant --after 1000 --journal level.jsonl");
    let _first = domain.start_until(&run("level.toml"), "waits for a standby");
    domain.run("apply level other.toml --allow-missed").expect_code(0);
    let _second = domain.start_until(&run("other.toml"), "can be taken over");
    for _ in 0..2 {
        let holder = redundancy(&domain)["holder"].clone();
        wait_until("the node is handed over", || {
            domain.run("switch level");
            redundancy(&domain)["holder"] != holder
        });
        wait_until("the other one follows", || redundancy(&domain)["is_complete"] == true);
    }
    domain.run("set level late.setChangeRate=7").expect_code(0);
    let journal = domain.read("level.jsonl");
    let begins = |line: &&str| line.contains("setChangeRate = 10.0");
    let last = journal.lines().rfind(|line| line.contains("\"configuration\""));
    assert!(last.is_some_and(|line| begins(&line)), "{journal}");
}

#[test]
fn two_takeovers_within_a_second_are_an_alarm_of_the_new_holder() {
    let domain = domain();
    let run = "run level.toml --redundant --after 1000";
    let _first = domain.start_until(run, "waits for a standby");
    let _second = domain.start_until(run, "can be taken over");
    let has_alarm =
        || domain.answer("alarms level --json").to_string().contains("taken over twice");
    assert!(!has_alarm());
    // A busy machine may need more than a second for two of them.
    wait_until("two switches come within a second", || {
        domain.run("switch level");
        has_alarm()
    });
}

#[test]
fn a_node_with_more_state_than_1_mib_is_refused_as_redundant_and_runs_alone() {
    let ramps = Plant::new("large").task("fast", "100ms").ramp("ramp", "value = 1.0");
    let plant = ramps.with("count = 20000");
    let domain = Domain::with(&[("large.toml", &plant)]);
    let refused = ["bytes of state", "at most 1048576", "divide the node"];
    domain.expect("run large.toml --redundant", 1, &refused);
    domain.start_until("run large.toml", "is running").stop().expect_code(0);
}
