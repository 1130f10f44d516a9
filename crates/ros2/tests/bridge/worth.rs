//! What a value is worth crosses, and what is worth nothing does not.

use isochrone_ipc::SignalReader;
use isochrone_model::Flags;
use rustix::process::Signal;
use serde_json::json;

use crate::harness::{Bridge, Given, Source, frame, message, next};

/// A link to this topic with these keys.
fn link(topic: &str, keys: &str) -> String {
    format!(
        "[[to_ros]]\nservice = \"plant/level\"\ntopic = \"{topic}\"\ntype = \"std_msgs/msg/Float64\"\n\
         fields = {{ data = \"y\" }}\n{keys}\n"
    )
}

#[test]
fn a_bad_frame_is_sent_or_the_last_good_one_or_nothing() {
    let links = [
        link("/send", "quality = \"/quality\""),
        link("/hold", "on_bad = \"hold\""),
        link("/stop", "on_bad = \"stop\""),
    ];
    let bridge = Bridge::start(&links.concat());
    let mut peers =
        ["/send", "/hold", "/stop"].map(|topic| bridge.peer(&["subscribe", topic, "Float64"]));
    let mut quality = bridge.peer(&["subscribe", "/quality", "DiagnosticStatus"]);
    // A good frame, then a bad one, and so on.
    let _source = Source::start(&bridge.domain, "plant/level", |frame| {
        let (y, flags) = if frame % 2 == 0 { (1.0, Flags::FORCED) } else { (2.0, Flags::ERROR) };
        Given { flags, ..Given::of(&[("y", y)]) }
    });
    let [send, hold, stop] = &mut peers;
    message(send, "a bad value", |it| *it == json!({"data": 2.0}));
    for peer in [hold, stop] {
        message(peer, "a good value", |it| *it == json!({"data": 1.0}));
    }
    let error = message(&mut quality, "a bad frame's worth", |it| it["level"] == 2);
    assert_eq!((&error["name"], &error["message"]), (&json!("plant/level"), &json!("ERROR")));
    assert_eq!(error["values"][0], json!({"key": "flags", "value": "32"}));
    let good = message(&mut quality, "a good frame's worth", |it| it["level"] == 0);
    assert_eq!(good["message"], "FORCED");
    let peers = peers.map(|peer| peer.stop().stdout);
    let bad = peers.map(|stdout| stdout.contains("2.0"));
    assert_eq!(bad, [true, false, false]);
    bridge
        .stop()
        .says(&[" bad", "a frame is not sent: its flags are ERROR, and on_bad is \"stop\""]);
}

#[test]
fn nan_and_what_does_not_fit_is_dropped_and_counted_in_both_directions() {
    let bridge = Bridge::start(
        r#"
        [[to_ros]]
        service = "plant/level"
        topic = "/number"
        type = "std_msgs/msg/Float64"
        fields = { data = "y" }
        [[to_ros]]
        service = "plant/level"
        topic = "/whole"
        type = "std_msgs/msg/Int32"
        fields = { data = "n" }
        [[from_ros]]
        topic = "/in"
        type = "std_msgs/msg/Float64MultiArray"
        service = "ros/in"
        fields = { "data[1]" = "x" }
        "#,
    );
    let mut number = bridge.peer(&["subscribe", "/number", "Float64"]);
    let mut whole = bridge.peer(&["subscribe", "/whole", "Int32"]);
    let source = Source::start(&bridge.domain, "plant/level", |frame| match frame % 3 {
        0 => Given::of(&[("y", f64::NAN), ("n", 0.5)]),
        1 => Given::of(&[("y", f64::INFINITY), ("n", 1e10)]),
        _ => Given::of(&[("y", 3.0), ("n", -7.0)]),
    });
    message(&mut number, "an infinite value", |it| it["data"] == "inf");
    message(&mut number, "a number", |it| it["data"] == 3.0);
    message(&mut whole, "a whole number", |it| it["data"] == -7);
    assert!(!number.stop().stdout.contains("nan"));
    let sent = whole.stop().stdout;
    assert!(sent.lines().skip(1).all(|line| line == r#"{"data": -7}"#), "{sent}");
    drop(source);
    let _bad = bridge.peer(&["publish", "/in", "Float64MultiArray", r#"{"data": [1, NaN]}"#]);
    let _short = bridge.peer(&["publish", "/in", "Float64MultiArray", r#"{"data": [1]}"#]);
    let _good = bridge.peer(&["publish", "/in", "Float64MultiArray", r#"{"data": [1, 5]}"#]);
    let taken = frame(&bridge.domain, "ros/in", "a frame comes", |_| true);
    assert_eq!(taken.values, [("x".to_owned(), 5.0)]);
    let ended = bridge.stop().says(&[
        "plant/level -> /number: a frame is not sent: the signal y is NaN",
        "plant/level -> /whole: a frame is not sent: data: ",
        "not_a_number",
        "misfit",
        "a message is dropped: data[1] (signal x) is NaN",
        "a message is dropped: it has no data[1] (signal x)",
    ]);
    // Whatever comes after the first of a kind is counted.
    let times = |text| ended.stderr.matches(text).count();
    assert_eq!([times("a frame is not sent"), times("a message is dropped")], [2, 2]);
}

#[test]
fn readers_learn_that_a_topic_is_silent_and_that_the_bridge_ends() {
    let bridge = Bridge::start(
        r#"
        [[from_ros]]
        topic = "/level"
        type = "std_msgs/msg/Float64"
        service = "ros/level"
        fields = { data = "level" }
        max_gap = "200ms"
        "#,
    );
    let Bridge { domain, process, .. } = &bridge;
    let participant = domain.join("reader");
    let mut reader = SignalReader::open(&participant, "ros/level", &[]).unwrap();
    let mut next =
        |what: &str, flag: Flags| next(&mut reader, what, |taken| taken.flags == flag).values[0].1;
    let peer = bridge.peer(&["publish", "/level", "Float64", r#"{"data": 2.5}"#]);
    assert_eq!(next("a good frame comes", Flags::NONE), 2.5);
    peer.kill();
    assert_eq!(next("a stale frame comes", Flags::STALE), 2.5);
    // Another peer makes it good again.
    let _peer = bridge.peer(&["publish", "/level", "Float64", r#"{"data": 3.5}"#]);
    assert_eq!(next("a good frame comes", Flags::NONE), 3.5);
    process.signal(Signal::TERM);
    assert_eq!(next("the last frame comes", Flags::STOPPED), 3.5);
    bridge.stop().says(&["gaps"]);
}
