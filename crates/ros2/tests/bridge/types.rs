//! What becomes of values in messages of each kind, both ways.

use std::time::{SystemTime, UNIX_EPOCH};

use isochrone_cyclic::{Clock, Monotonic};
use serde_json::json;

use crate::harness::{Bridge, Given, Source, frame, message};

const LEVEL: &[(&str, f64)] = &[("level.y", 1.5), ("pump.speed", -0.25), ("pump.on", 1.0)];

#[test]
fn values_of_a_frame_become_fields_of_messages_of_each_kind() {
    let bridge = Bridge::start(
        r#"
        [ros2]
        node = "bridge"
        namespace = "/plant"
        [[to_ros]]
        service = "plant/level"
        topic = "level"
        type = "std_msgs/msg/Float64"
        fields = { data = "level.y" }
        [[to_ros]]
        service = "plant/level"
        topic = "/cmd"
        type = "geometry_msgs/Twist"
        fields = { "linear.x" = "level.y", "angular.z" = "pump.speed", "linear.z" = 7 }
        [[to_ros]]
        service = "plant/level"
        topic = "~/joints"
        type = "sensor_msgs/msg/JointState"
        names = ["level", "pump"]
        fields = { "header.frame_id" = "base", "position[]" = ["level.y", "pump.speed"], "velocity" = "*.v", "effort[1]" = "level.y" }
        [[to_ros]]
        service = "plant/level"
        topic = "/imu"
        type = "sensor_msgs/msg/Imu"
        fields = { "angular_velocity.y" = "pump.speed", "orientation_covariance[8]" = "level.y" }
        [[to_ros]]
        service = "plant/level"
        topic = "/array"
        type = "std_msgs/msg/Float64MultiArray"
        fields = { "data[]" = ["pump.speed", "level.y", "pump.on"] }
        "#,
    );
    let mut peers = [
        ("/plant/level", "Float64"),
        ("/cmd", "Twist"),
        ("/plant/bridge/joints", "JointState"),
        ("/imu", "Imu"),
        ("/array", "Float64MultiArray"),
    ]
    .map(|(topic, kind)| bridge.peer(&["subscribe", topic, kind]));
    let _source = Source::start(&bridge.domain, "plant/level", |_| {
        let more = [("level.v", 10.0), ("pump.v", 20.0)];
        Given::of(&[LEVEL, &more].concat())
    });
    let [level, twist, joints, imu, array] = &mut peers;
    let any = |peer| message(peer, "a message", |_| true);
    assert_eq!(any(level), json!({"data": 1.5}));
    let twist = any(twist);
    assert_eq!(twist["linear"], json!({"x": 1.5, "y": 0.0, "z": 7.0}));
    assert_eq!(twist["angular"], json!({"x": 0.0, "y": 0.0, "z": -0.25}));
    let joints = any(joints);
    assert_eq!(joints["name"], json!(["level", "pump"]));
    assert_eq!(joints["position"], json!([1.5, -0.25]));
    assert_eq!(joints["velocity"], json!([10.0, 20.0]));
    assert_eq!(joints["effort"], json!([0.0, 1.5]));
    assert_eq!(joints["header"]["frame_id"], "base");
    let imu = any(imu);
    assert_eq!(imu["angular_velocity"]["y"], -0.25);
    assert_eq!(imu["orientation"]["w"], 1.0);
    assert_eq!(imu["orientation_covariance"][8], 1.5);
    assert_eq!(any(array)["data"], json!([-0.25, 1.5, 1.0]));
    bridge.stop();
}

#[test]
fn fields_of_messages_become_values_of_frames_of_each_kind() {
    let bridge = Bridge::start(
        r#"
        [[from_ros]]
        topic = "/level"
        type = "std_msgs/msg/Float64"
        service = "ros/level"
        fields = { data = "level" }
        [[from_ros]]
        topic = "/cmd_vel"
        type = "geometry_msgs/msg/Twist"
        service = "ros/cmd"
        fields = { "linear.x" = "v", "angular.z" = "w" }
        [[from_ros]]
        topic = "/joints"
        type = "sensor_msgs/msg/JointState"
        service = "ros/joints"
        names = ["b", "a"]
        fields = { "position[]" = "*.q", "velocity[0]" = "first" }
        [[from_ros]]
        topic = "/imu"
        type = "sensor_msgs/msg/Imu"
        service = "ros/imu"
        fields = { "linear_acceleration.z" = "g", "angular_velocity_covariance[4]" = "c" }
        [[from_ros]]
        topic = "/array"
        type = "std_msgs/msg/Float64MultiArray"
        service = "ros/array"
        fields = { "data[]" = ["x", "y"] }
        "#,
    );
    let _peers = [
        ("/level", "Float64", r#"{"data": 2.5}"#),
        ("/cmd_vel", "Twist", r#"{"linear": {"x": 0.5}, "angular": {"z": -1}}"#),
        ("/joints", "JointState", r#"{"name": ["a", "x", "b"], "position": [1, 2, 3], "velocity": [4]}"#),
        ("/imu", "Imu", r#"{"linear_acceleration": {"z": 9.81}, "angular_velocity_covariance": [0, 1, 2, 3, 4, 5, 6, 7, 8]}"#),
        ("/array", "Float64MultiArray", r#"{"data": [1, 2, 3]}"#),
    ]
    .map(|(topic, kind, values)| bridge.peer(&["publish", topic, kind, values]));
    for (service, expected) in [
        ("ros/level", &[("level", 2.5)][..]),
        ("ros/cmd", &[("v", 0.5), ("w", -1.0)]),
        ("ros/joints", &[("b.q", 3.0), ("a.q", 1.0), ("first", 4.0)]),
        ("ros/imu", &[("g", 9.81), ("c", 4.0)]),
        ("ros/array", &[("x", 1.0), ("y", 2.0)]),
    ] {
        let expected: Vec<_> =
            expected.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let taken = frame(&bridge.domain, service, "a frame comes", |_| true);
        assert_eq!(taken.values, expected);
        assert!(taken.flags.is_empty());
    }
    bridge.stop();
}

#[test]
fn without_a_file_each_signal_is_a_topic_and_each_number_a_signal() {
    let arguments =
        ["--to-ros", "plant/level", "--from-ros", "/cmd_vel", "geometry_msgs/msg/Twist"];
    let bridge = Bridge::start_with("", &arguments);
    let _source = Source::start(&bridge.domain, "plant/level", |_| {
        Given::of(&[("level.y", 1.5), ("axis.17.delayedValue", 2.0), ("broken", f64::NAN)])
    });
    let mut level = bridge.peer(&["subscribe", "/plant/level/level/y", "Float64"]);
    let mut axis = bridge.peer(&["subscribe", "/plant/level/axis_17/delayed_value", "Float64"]);
    let _cmd = bridge.peer(&["publish", "/cmd_vel", "Twist", r#"{"angular": {"y": 3}}"#]);
    assert_eq!(message(&mut level, "a message", |_| true), json!({"data": 1.5}));
    assert_eq!(message(&mut axis, "a message", |_| true), json!({"data": 2.0}));
    let taken = frame(&bridge.domain, "cmd_vel", "a frame comes", |_| true);
    let names: Vec<&str> = taken.values.iter().map(|(name, _)| &**name).collect();
    let axes = ["linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"];
    assert_eq!(names, axes);
    assert_eq!(taken.values[4].1, 3.0);
    let domain = bridge.dds_domain;
    bridge.stop().says(&[
        &format!(
            "bridging plant/level -> /plant/level/SIGNAL, /cmd_vel -> cmd_vel; DDS domain {domain}, this machine alone. Press \
             Ctrl-C to end it."
        ),
        "plant/level -> /plant/level/SIGNAL: a value is not sent on /plant/level/broken: the signal broken is NaN",
        "\nplant/level -> /plant/level/SIGNAL: ",
    ]);
}

#[test]
fn time_stamps_cross_in_both_directions() {
    let bridge = Bridge::start(
        r#"
        [[to_ros]]
        service = "plant/joints"
        topic = "/out"
        type = "sensor_msgs/msg/JointState"
        fields = { "position[]" = ["q"] }
        [[from_ros]]
        topic = "/in"
        type = "sensor_msgs/msg/JointState"
        service = "ros/joints"
        fields = { "position[0]" = "q" }
        [[from_ros]]
        topic = "/simulated"
        type = "sensor_msgs/msg/JointState"
        service = "ros/simulated"
        fields = { "position[0]" = "q" }
        "#,
    );
    let source_ns = Monotonic.now_ns();
    let source_unix_ns = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as i128;
    let _source = Source::start(&bridge.domain, "plant/joints", move |_| Given {
        source_ns,
        ..Given::of(&[("q", 1.0)])
    });
    let mut out = bridge.peer(&["subscribe", "/out", "JointState"]);
    let sent = message(&mut out, "a message", |_| true);
    let stamp = &sent["header"]["stamp"];
    let ns = |part: &str| i128::from(stamp[part].as_i64().unwrap());
    let stamp_ns = ns("sec") * 1_000_000_000 + ns("nanosec");
    // Between the two readings of the clocks above there is no wait.
    assert!((stamp_ns - source_unix_ns).abs() < 50_000_000, "{stamp} is not {source_unix_ns}");

    let before_ns = Monotonic.now_ns();
    let values = r#"{"header": {"stamp": "now"}, "position": [1]}"#;
    let _stamped = bridge.peer(&["publish", "/in", "JointState", values]);
    let taken = frame(&bridge.domain, "ros/joints", "a frame comes", |_| true);
    assert!((before_ns..=Monotonic.now_ns()).contains(&taken.source_ns), "{taken:?}");

    let values = r#"{"header": {"stamp": {"sec": 12}}, "position": [1]}"#;
    let _simulated = bridge.peer(&["publish", "/simulated", "JointState", values]);
    let taken = frame(&bridge.domain, "ros/simulated", "a frame comes", |_| true);
    assert!((before_ns..=Monotonic.now_ns()).contains(&taken.source_ns), "{taken:?}");
    bridge.stop().says(&["time stamps in messages are not used", "unused_stamps"]);
}
