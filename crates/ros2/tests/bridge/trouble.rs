//! Peers that come late, are killed, or do not fit.

use crate::harness::{Bridge, Given, Source, frame, message};

const BOTH: &str = r#"
    [[to_ros]]
    service = "plant/level"
    topic = "/level"
    type = "std_msgs/msg/Float64"
    fields = { data = "y" }
    [[from_ros]]
    topic = "/cmd"
    type = "std_msgs/msg/Float64"
    service = "ros/cmd"
    fields = { data = "u" }
"#;

fn source(bridge: &Bridge) -> Source {
    Source::start(&bridge.domain, "plant/level", |frame| Given::of(&[("y", frame as f64)]))
}

#[test]
fn a_peer_that_is_killed_and_started_again_goes_on() {
    let bridge = Bridge::start(BOTH);
    let _source = source(&bridge);
    for number in [1.0, 2.0] {
        let values = format!("{{\"data\": {number}}}");
        let mut level = bridge.peer(&["subscribe", "/level", "Float64"]);
        let cmd = bridge.peer(&["publish", "/cmd", "Float64", &values]);
        message(&mut level, "a message", |_| true);
        frame(&bridge.domain, "ros/cmd", "its frame comes", |taken| taken.values[0].1 == number);
        cmd.kill();
        level.kill();
    }
    bridge.stop();
}

#[test]
fn a_best_effort_subscriber_gets_what_is_sent_reliably() {
    let bridge = Bridge::start(BOTH);
    let _source = source(&bridge);
    let mut level = bridge.peer(&["subscribe", "/level", "Float64", "--best-effort"]);
    message(&mut level, "a message", |_| true);
    bridge.stop();
}

#[test]
fn a_quality_of_service_that_does_not_fit_is_told_with_what_would() {
    let mut reliable = Bridge::start(BOTH);
    let arguments = ["publish", "/cmd", "Float64", "{}", "--best-effort"];
    let peer = reliable.peer(&arguments);
    reliable.process.wait_for(
        "a publisher of /cmd does not fit in its quality of service, so nothing comes from it: the publisher sends \
         best-effort, and the subscriber wants reliable; write qos = \"sensor_data\" in its [[from_ros]]",
    );
    drop(peer);
    reliable.stop();
    let best_effort = BOTH.replace("\" }", "\" }\nqos = \"sensor_data\"");
    let mut bridge = Bridge::start(&best_effort);
    let _peer = bridge.peer(&arguments);
    frame(&bridge.domain, "ros/cmd", "a frame comes", |_| true);
    let _reliable = bridge.peer(&["subscribe", "/level", "Float64"]);
    bridge.process.wait_for(
        "a subscriber of /level does not fit in its quality of service, so it gets nothing: the publisher sends \
         best-effort, and the subscriber wants reliable; write qos = \"default\" in its [[to_ros]]",
    );
    bridge.stop();
}

#[test]
fn a_peer_of_another_type_is_told_and_nothing_passes() {
    let mut bridge = Bridge::start(BOTH);
    let _source = source(&bridge);
    let _other = bridge.peer(&["publish", "/cmd", "Twist", "{\"linear\": {\"x\": 9}}"]);
    let other = bridge.peer(&["subscribe", "/level", "Int32"]);
    bridge.process.wait_for("a publisher of /cmd has the type geometry_msgs::msg::dds_::Twist_");
    bridge.process.wait_for("a subscriber of /level has the type std_msgs::msg::dds_::Int32_");
    let _right = bridge.peer(&["publish", "/cmd", "Float64", r#"{"data": 4}"#]);
    let mut level = bridge.peer(&["subscribe", "/level", "Float64"]);
    message(&mut level, "a message", |_| true);
    let taken = frame(&bridge.domain, "ros/cmd", "a frame comes", |_| true);
    assert_eq!(taken.values, [("u".to_owned(), 4.0)]);
    assert!(!other.stop().stdout.contains("data"));
    bridge.stop();
}
