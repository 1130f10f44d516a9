//! A peer on Fast DDS, the default of ROS 2. It is built here, and knows bytes alone.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use isochrone_testing::{Process, not_tested};

use crate::harness::{Bridge, Given, Source, frame, ready};
use crate::operate::with_node;

const FLOAT: &str = "std_msgs::msg::dds_::Float64_";

/// The peer; `None` where Fast DDS is not installed.
fn program() -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let build = || {
        if !Path::new("/usr/include/fastdds/dds").exists() {
            return None;
        }
        let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fast_peer");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fast_peer.cpp");
        let built = Command::new("c++")
            .args(["-std=c++17", "-o"])
            .args([&program, &source])
            .args(["-lfastrtps", "-lfastcdr"])
            .output()
            .unwrap();
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        Some(program)
    };
    let program = PROGRAM.get_or_init(build).as_deref();
    if program.is_none() {
        not_tested("Fast DDS", "libfastrtps-dev is not installed");
    }
    program
}

fn peer(program: &Path, bridge: &Bridge, verb: &str, words: &[&str]) -> Process {
    let mut command = Command::new(program);
    command.args([verb, &bridge.dds_domain.to_string()]).args(words);
    ready(command)
}

#[test]
fn messages_cross_to_fast_dds_and_back() {
    let Some(program) = program() else { return };
    let bridge = Bridge::start(
        r#"
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
        "#,
    );
    let _source = Source::start(&bridge.domain, "plant/level", |_| Given::of(&[("y", 1.5)]));
    let mut level = peer(program, &bridge, "subscribe", &["/level", FLOAT]);
    level.wait_for("00010000000000000000f83f");
    let _cmd = peer(program, &bridge, "publish", &["/cmd", FLOAT, "000100000000000000000440"]);
    let taken = frame(&bridge.domain, "ros/cmd", "a frame comes", |_| true);
    assert_eq!(taken.values, [("u".to_owned(), 2.5)]);
    bridge.stop();
}

#[test]
fn a_client_on_fast_dds_gets_the_answer_to_its_request() {
    let Some(program) = program() else { return };
    with_node("[[parameters]]\nnode = \"level\"\n", |bridge| {
        // No prefix, any depth.
        let request = format!("00010000{}", "00".repeat(16));
        let kind = "rcl_interfaces::srv::dds_::ListParameters";
        let words = ["/level/list_parameters", kind, &request];
        let mut client = peer(program, bridge, "call", &words);
        let name: String = "ramp.setChangeRate".bytes().map(|byte| format!("{byte:02x}")).collect();
        client.wait_for(&name);
    });
}
