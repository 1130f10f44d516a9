//! Watching a running node from the command line: values and alarms as they change.

use isochrone_testing::assert_says;
use isochrone_testing::plants::{TANK, tank};
use rustix::process::Signal;
use serde_json::{Value, json};

#[test]
fn watch_prints_what_changes_and_ends_with_a_signal() {
    let (domain, _node) = tank(TANK);
    let mut watch = domain.start_until(
        "watch tank ramp.setChangeRate beat.timeRange",
        "ramp.setChangeRate=10  beat.timeRange=T#1s500ms\n",
    );
    domain.stdout("set tank ramp.setChangeRate=4");
    watch.wait_for("ramp.setChangeRate=4\n");
    watch.signal(Signal::INT);
    let watched = watch.finish().expect_code(0).stdout;
    assert_eq!(watched.matches("beat.timeRange").count(), 1, "it did not change: {watched}");
    let lines = domain.stdout("watch tank level --rate 50 --count 3 --json");
    let cycles = lines.lines().map(|line| {
        let line: Value = serde_json::from_str(line).unwrap();
        assert_eq!(line["values"], json!({"level": 0.0}));
        line["tasks"]["fast"]["cycle"].as_u64().unwrap()
    });
    assert!(cycles.collect::<Vec<_>>().is_sorted(), "{lines}");
    let refused = domain.expect("watch tank nothing", 1, &["\"nothing\""]);
    assert!(!refused.stderr.contains("nothing was changed"), "{}", refused.stderr);
    domain.expect("watch tank level --rate 0", 2, &["50 Hz"]);
}

#[test]
fn alarms_name_what_is_wrong_and_follow_it() {
    let (domain, _node) = tank(TANK);
    let mut follow = domain.start_until("alarms tank --follow", "came   level");
    let alarms = domain.answer("alarms tank --json");
    assert_eq!(alarms[0]["name"], "level", "{alarms}");
    let publisher = domain.publish("tank/in --value 20");
    follow.wait_for("went   level");
    publisher.kill();
    follow.wait_until("that it comes again", |out, _| out.matches("came   level").count() >= 2);
    follow.stop().expect_code(0);
    let told = ["since cycle", "level  fast", "service \"tank/in\" is older than max_age"];
    assert_says(&domain.stdout("alarms tank"), &told);
    assert!(alarms[0]["since_unix_ns"].is_u64() && alarms[0]["task"] == "fast", "{alarms}");
}

#[test]
fn a_signal_ends_a_verb_that_waits_for_a_node_that_is_stopped() {
    let (domain, node) = tank(TANK);
    let watch = domain.start_until("watch tank level", "level=");
    node.signal(Signal::STOP);
    // It gives the node 5 s, which a busy machine may let pass first.
    let ended = watch.stop();
    if ended.status.code() != Some(0) {
        assert_says(&ended.expect_code(1).stderr, &["did not answer within 5s"]);
    }
    let mut get = domain.start("get tank level");
    get.wait_until_it_handles_signals();
    get.signal(Signal::TERM);
    let ended = get.finish().expect_code(1).says(&["ended by a signal"]);
    assert_eq!(ended.stdout, "");
    node.signal(Signal::CONT);
}

#[test]
fn an_alarm_tells_why_an_input_does_not_fit_and_what_it_is_now() {
    let by_name = "service = \"tank/in\"\nsignal = \"level\"";
    let (domain, _node) = tank(&TANK.replace("service = \"tank/in\"", by_name));
    let mut follow = domain.start_until("alarms tank --follow", "came   level");
    let _publisher = domain.start("publish tank/in --value 20 --signals other");
    follow.wait_for("takes no sample: service \"tank/in\" of ");
    follow.wait_for("have no signal \"level\"");
}
