//! Configurations that are right, and what is said of those that are not.

use std::path::Path;

use isochrone::prelude::{CATALOGUE, Plan, Rules};
use isochrone_testing::{Domain, Ended, assert_says};

use crate::harness::program;

/// Checks a configuration.
fn check(text: &str, arguments: &[&str]) -> Ended {
    let domain = Domain::new();
    let mut command = program(&domain);
    if !text.is_empty() {
        command.arg(domain.write("ros2.toml", text));
    }
    command.arg("--check").args(arguments).output().unwrap().into()
}

#[test]
fn what_a_configuration_does_is_shown() {
    let text = r#"
        [ros2]
        namespace = "/plant"
        domain = 7
        [[to_ros]]
        service = "plant/level"
        topic = "level"
        type = "std_msgs/msg/Float64"
        fields = { data = "level.y" }
        [[from_ros]]
        topic = "/cmd_vel"
        type = "geometry_msgs/msg/Twist"
        service = "robot/cmd"
        fields = { "linear.x" = "v", "angular.z" = "w" }
        max_gap = "200ms"
        qos = "sensor_data"
        depth = 20
        [[to_ros]]
        service = "plant/level"
        topic = "/rare"
        type = "std_msgs/msg/Float64"
        fields = { data = "level.y" }
        rate = 30
        on_bad = "hold"
        quality = "worth"
        "#;
    let shown = check(text, &["--to-ros", "plant/pump-2"]).expect_code(0).stdout;
    let lines = [
        "node isochrone in /plant, DDS domain 7",
        "plant/level -> /plant/level: std_msgs/msg/Float64 of level.y",
        "plant/pump-2 -> /plant/pump_2/SIGNAL: std_msgs/msg/Float64 for each signal",
        "/cmd_vel -> robot/cmd: v, w of geometry_msgs/msg/Twist (max_gap = \"200ms\", qos = \"sensor_data\", depth = 20)",
        "plant/level -> /rare: std_msgs/msg/Float64 of level.y (rate = 30, on_bad = \"hold\", quality = \"/plant/worth\")",
    ];
    assert_says(&shown, &lines);
}

#[test]
fn an_error_names_its_place_and_the_way_out() {
    let to_ros = |keys: &str| format!("[[to_ros]]\nservice = \"s\"\n{keys}\n");
    let of =
        |kind: &str, fields: &str| to_ros(&format!("type = \"{kind}\"\nfields = {{ {fields} }}"));
    let from_ros = |keys: &str| {
        format!(
            "[[from_ros]]\ntopic = \"/t\"\ntype = \"sensor_msgs/msg/JointState\"\nservice = \"s\"\n{keys}\n"
        )
    };
    for (text, says) in [
        ("[ros3]".to_owned(), &["the file has no key \"ros3\"", "did you mean \"ros2\"?"][..]),
        ("[ros2]\nnode = \"a-b\"\n".to_owned(), &["no name of a node", "write node = \"a_b\""]),
        ("[ros2]\n".to_owned(), &["the file says nothing to do"]),
        ("[ros2\n".to_owned(), &["ros2.toml:1"]),
        (to_ros("topic = \"/a b\""), &["' ' stands in it", "write topic = \"/a_b\""]),
        (to_ros("quality = \"/a b\""), &["' ' stands in it", "write quality = \"/a_b\""]),
        (to_ros("type = \"std_msgs/msg/Float6\""), &["did you mean \"std_msgs/msg/Float64\"?"]),
        (to_ros("type = \"own_msgs/msg/Pmp\""), &["there is no definition", "--msg-path"]),
        (to_ros("type = \"Twist\""), &["did you mean \"geometry_msgs/msg/Twist\"?"]),
        (to_ros("type = \"JointStates\""), &["did you mean \"sensor_msgs/msg/JointState\"?"]),
        (
            to_ros("type = \"geometry_msgs/msg/Twist\""),
            &["has no fields", "write fields = { \"linear.x\" = \"level.y\" }"],
        ),
        (to_ros("").replace("\"s\"", "\"/s\""), &["begins with a slash", "write service = \"s\""]),
        (to_ros("qos = \"best_effort\""), &["write qos = \"sensor_data\""]),
        (to_ros("qos = \"reliable\""), &["write qos = \"default\""]),
        (to_ros("topic = \"/x\"\nquality = \"/x\""), &["/x is the topic of the values already"]),
        (
            of("std_msgs/msg/Float64", "data = \"y\"") + &of("std_msgs/msg/Int32", "data = \"n\""),
            &["/s has the type std_msgs/msg/Int32 here, and std_msgs/msg/Float64 above"],
        ),
        ("[ros2]\nnamespace = \"plant\"\n".into(), &["a slash", "write namespace = \"/plant\""]),
        (
            "[[parameters]]\nnode = \"/plant/level\"\n".into(),
            &["is no control node", "write node = \"level\""],
        ),
        (
            of("geometry_msgs/msg/Twist", "v = \"linear.x\""),
            &["has no field \"v\"", "message field = signal: \"linear.x\" = \"v\""],
        ),
        (
            of("geometry_msgs/msg/Twist", "linear.x = \"v\""),
            &["linear is a table", "quote the name: \"linear.x\" = \"v\""],
        ),
        (of("std_msgs/msg/Int32", "data = [1]"), &["data is a signal or an int32"]),
        (to_ros("fields = { data = \"y\" }"), &["has fields and no type"]),
        (to_ros("rate = 0"), &["rate is a number from 0.001 to 100000, not 0"]),
        (to_ros("on_bad = \"stay\""), &["on_bad is not \"stay\""]),
        (to_ros("depth = 1.5"), &["depth is a whole number"]),
        (of("std_msgs/msg/Float64", "date = \"y\""), &["has no field \"date\"; it has data"]),
        (of("std_msgs/msg/Float64", "data = 5"), &["fields has constants alone"]),
        (of("std_msgs/msg/UInt8", "data = 300"), &["300 is no uint8"]),
        (of("std_msgs/msg/Header", "stamp = \"y\""), &["name a number in it"]),
        (of("sensor_msgs/msg/JointState", "position = \"q\""), &["position is a sequence"]),
        (of("sensor_msgs/msg/Imu", "orientation_covariance = [\"a\"]"), &["no float64[9]"]),
        (from_ros("max_gap = \"5\""), &["the unit is missing"]),
        (
            from_ros("max_gap = 200"),
            &["max_gap is a text with a unit", "write max_gap = \"200ms\""],
        ),
        (from_ros("fields = { position = \"q\" }"), &["name a number in it"]),
        (from_ros("names = [\"a\"]\nfields = { position = [\"p\", \"q\"] }"), &["2 signals for 1"]),
        (
            from_ros("fields = { \"position[0]\" = \"q\", \"position[1]\" = \"q\" }"),
            &["signal \"q\" already"],
        ),
        (
            from_ros(""),
            &[
                "no field of sensor_msgs/msg/JointState becomes a signal",
                "write fields = { \"position[]\" = [\"v\"] }",
            ],
        ),
        (
            from_ros("").replace("sensor_msgs/msg/JointState", "std_msgs/msg/String"),
            &["nothing of std_msgs/msg/String can be a signal"],
        ),
        (
            from_ros("").replace("\"s\"", "\"/s\""),
            &["begins with a slash", "write service = \"s\""],
        ),
        (from_ros("").replace("\"s\"", "\"isochrone/x\""), &["is reserved"]),
        (
            from_ros("fields = { \"position[0]\" = \"q\" }").repeat(2),
            &["\"s\" has a topic already; a service has one writer"],
        ),
    ] {
        let ended = check(&text, &[]).expect_code(2).expect_readable();
        assert_eq!(ended.stdout, "");
        assert_says(&ended.stderr, says);
    }
}

#[test]
fn a_misspelt_field_is_one_error() {
    let text = "[[from_ros]]\ntopic = \"/t\"\ntype = \"geometry_msgs/msg/Twist\"\nservice = \"s\"\n\
                fields = { \"lineal.x\" = \"v\" }\n";
    let stderr = check(text, &[]).expect_code(2).stderr;
    assert_says(&stderr, &["1 error", "has no field \"lineal\""]);
    assert!(!stderr.contains("becomes a signal"), "{stderr}");
}

#[test]
fn what_is_only_odd_is_told_and_does_not_stop_it() {
    let text = "[[from_ros]]\ntopic = \"/t\"\ntype = \"std_msgs/msg/Float64MultiArray\"\nservice = \"s\"\n\
                names = [\"a\", \"b\"]\nfields = { \"data[]\" = \"*.x\" }\n";
    let ended = check(text, &[]).expect_code(0).expect_readable();
    assert_says(&ended.stdout, &["/t -> s: a.x, b.x of std_msgs/msg/Float64MultiArray"]);
    let says = ["has no field for names: they stand for its", "1 warning"];
    assert_says(&ended.stderr, &says);
}

#[test]
fn the_command_line_is_checked_too() {
    for (arguments, says) in [
        (&[][..], "nothing to do"),
        (&["--from-ros", "/x", "std_msgs/msg/String"], "nothing of std_msgs/msg/String can be a"),
        (
            &["--from-ros", "/x", "sensor_msgs/msg/JointState"],
            "with [[from_ros]] and fields = { \"position[]\" = [\"v\"] }",
        ),
        (&["--from-ros", "/x", "std_msgs/msg/Flt"], "there is no definition of std_msgs/Flt"),
        (&["--from-ros", "/x", "Twist"], "did you mean \"geometry_msgs/msg/Twist\"?"),
        (&["--show", "JointState"], "did you mean \"sensor_msgs/msg"),
        (&["--to-ros", "/plant/level"], "write --to-ros plant/level"),
        (&["--to-ros", "x", "--namespace", "plant"], "does not begin with a slash; \"/plant\" is"),
        (&["--to-ros", "x", "--node", "a b"], "is no name of ROS"),
        (&["--to-ros", "x", "--domain", "233"], "233"),
        (&["--to-ros", "x", "--msg-path", "/nowhere"], "cannot read /nowhere"),
    ] {
        assert_says(&check("", arguments).expect_code(2).stderr, &[says]);
    }
}

#[test]
fn definitions_of_ones_own_are_found() {
    let domain = Domain::new();
    std::fs::create_dir_all(domain.path("msgs/pumps/msg")).unwrap();
    domain.write("msgs/pumps/msg/Pump.msg", "std_msgs/Header header\nfloat32 rpm\nbool[2] on\n");
    let msgs = domain.path("msgs");
    let shown: Ended = program(&domain)
        .args(["--show", "pumps/msg/Pump", "--msg-path"])
        .arg(&msgs)
        .output()
        .unwrap()
        .into();
    let lines =
        ["pumps::msg::dds_::Pump_", "header.stamp.sec: int32", "rpm: float32", "on: bool[2]"];
    shown.expect_code(0).prints(&lines);
    let file = domain.write(
        "ros2.toml",
        "[ros2]\nmsg_path = [\"msgs\"]\n[[from_ros]]\ntopic = \"/p\"\ntype = \"pumps/msg/Pump\"\nservice = \"p\"\n",
    );
    let checked: Ended = program(&domain).arg(file).arg("--check").output().unwrap().into();
    checked.expect_code(0).prints(&["/p -> p: rpm, on.0, on.1 of pumps/msg/Pump"]);
}

fn page() -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/ros2.md");
    std::fs::read_to_string(page).unwrap()
}

#[test]
fn all_types_are_listed_and_are_on_the_page() {
    let domain = Domain::new();
    let shown: Ended = program(&domain).arg("--show").output().unwrap().into();
    let shown = shown.expect_code(0).stdout;
    let types: Vec<_> = shown.lines().filter_map(|line| line.split_once("/msg/")).collect();
    assert!(types.contains(&("sensor_msgs", "JointState")) && !shown.contains("_Request"));
    let page = page();
    for (package, name) in types {
        // What the bridge itself needs is none to bridge.
        if !["rcl_interfaces", "rmw_dds_common"].contains(&package) {
            assert!(page.contains(&format!("`{name}`")), "{package}/{name} is not on the page");
        }
    }
}

#[test]
fn the_configurations_of_the_page_are_right() {
    let page = page();
    let blocks: Vec<&str> =
        page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    let (of_nodes, of_bridges): (Vec<&str>, Vec<&str>) =
        blocks.iter().partition(|block| block.starts_with("[[input]]"));
    assert_eq!((of_nodes.len(), of_bridges.len()), (1, 2));
    for block in of_bridges {
        assert_eq!(check(block, &[]).expect_code(0).stderr, "");
    }
    for block in of_nodes {
        let node = "[node]\nname = \"robot\"\n[[task]]\nname = \"fast\"\nperiod = \"2ms\"\n";
        let output = "[[output]]\nservice = \"robot/speed\"\nsignals = [\"speed\"]\n";
        let domain = Domain::new();
        let file = domain.write("node.toml", format!("{node}{block}{output}"));
        Plan::read(&file, &Rules { catalogue: CATALOGUE, ..Rules::default() }).unwrap();
    }
}
