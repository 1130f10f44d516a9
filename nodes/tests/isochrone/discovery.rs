//! Finding what there is: `list`, and names that are nearly right.

use iceoryx2::prelude::NodeBuilder;
use isochrone_ipc::{FrameHeader, ipc};
use isochrone_testing::plants::{RELAY, tank};
use isochrone_testing::{Domain, is_full_volume};
use serde_json::Value;

fn listed(domain: &Domain) -> Value {
    domain.answer("list --json")
}

fn service<'a>(listed: &'a Value, name: &str) -> &'a Value {
    let services = listed["services"].as_array().unwrap();
    services.iter().find(|service| service["name"] == name).unwrap_or_else(|| panic!("{listed}"))
}

#[test]
fn the_list_has_every_node_and_service_with_rate_publisher_and_signals() {
    let (domain, _node) = tank(RELAY);
    let mut publisher =
        domain.start("publish relay/in --value 4,true --signals level,full --rate 250");
    publisher.wait_for("publishing");
    // On a machine that is busy with other tests an announcement may come after the look.
    let is_whole = |listed: &Value| service(listed, "relay/in")["rate_is_measured"] == false;
    let listed = (0..20).map(|_| listed(&domain)).find(is_whole).unwrap();
    let names = |of: &Value| {
        let names = of.as_array().unwrap().iter().map(|node| node["name"].as_str().unwrap());
        names.map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(names(&listed["nodes"]), ["isochrone/publish", "isochrone/relay"], "{listed}");
    assert_eq!(
        names(&listed["services"]),
        ["isochrone/relay/telemetry", "relay/in", "relay/out"],
        "{listed}"
    );
    let input = service(&listed, "relay/in");
    assert_eq!(input["rate_hz"], 250.0);
    assert_eq!(input["rate_is_measured"], false);
    assert_eq!(input["publishers"][0]["pid"], publisher.id());
    assert_eq!(names(&input["subscribers"]), ["isochrone/relay"]);
    let signals = serde_json::json!([{"name": "level"}, {"name": "full", "type": "BOOL"}]);
    assert_eq!(input["signals"], signals);
    let telemetry = service(&listed, "isochrone/relay/telemetry");
    assert_eq!(telemetry["rate_is_measured"], true, "{telemetry}");

    let is_whole = |text: &String| text.contains("relay/in  250 Hz");
    let text = (0..20).map(|_| domain.run("list").expect_code(0).stdout).find(is_whole).unwrap();
    for part in ["2 nodes", "3 services", "full   BOOL", "isochrone/relay (pid"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let names = domain.run("list --names").expect_code(0).stdout;
    assert_eq!(names, "isochrone/relay/telemetry\nrelay/in\nrelay/out\n");
}

#[test]
fn where_nothing_runs_the_list_is_empty_and_says_so() {
    let domain = Domain::new();
    let ended = domain.run("list").expect_code(0);
    assert_eq!(ended.stdout, "");
    assert!(ended.stderr.contains("nothing runs in this domain"), "{}", ended.stderr);
    assert_eq!(
        listed(&domain),
        serde_json::json!({"control_nodes": [], "meetings": [], "starved_sources": [], "nodes": [], "services": []})
    );
    domain.expect_no_leftovers();
}

#[test]
fn a_service_that_is_not_there_is_told_the_one_that_was_probably_meant() {
    let domain = Domain::new();
    let _publisher = domain.publish("plant/level --value 1");
    // On a busy machine the time may be up before it has looked; then it is said in the end only.
    let ended = (0..20)
        .map(|_| domain.run("subscribe plant/levle --seconds 200ms").expect_code(3))
        .find(|ended| ended.stderr.contains("waiting for service \"plant/levle\""))
        .unwrap();
    let meant = ended.stderr.matches("did you mean \"plant/level\"?").count();
    assert_eq!(meant, 2, "while it waits, and in the end: {}", ended.stderr);
    domain.expect("subscribe other/thing --seconds 200ms", 3, &["isochrone list"]);
}

#[test]
fn each_level_of_the_log_tells_more_and_only_the_last_the_insides_of_iceoryx2() {
    const SET_UP: &str = "publishes service \"a/b\" (channels: 1)";
    const CREATED: &str = "created service \"a/b\"";
    let domain = Domain::new();
    let log = |flags: &str| domain.run(&format!("publish a/b --value 1 --count 1 {flags}")).stderr;
    let says = |flags: &str| {
        let log = log(flags);
        ["iceoryx2 domain: root path", SET_UP, CREATED, "iceoryx2_bb"]
            .map(|text| log.contains(text))
    };
    assert_eq!(says(""), [false, false, false, false]);
    assert_eq!(says("-v"), [true, true, false, false]);
    assert_eq!(says("-vv"), [true, true, true, false]);
    assert_eq!(says("-vvv"), [true, true, true, true]);
}

#[test]
fn a_log_of_the_second_level_tells_which_peers_a_port_has() {
    let domain = Domain::new();
    let mut publisher = domain.publish("a/b --value 1 -vv");
    let mut subscriber = domain.start("subscribe a/b -vv");
    publisher.wait_for("service \"a/b\" has 1 subscriber now");
    subscriber.wait_for("service \"a/b\" has 1 publisher now");
    subscriber.stop().expect_code(0);
    publisher.wait_for("service \"a/b\" has 0 subscribers now");
}

#[test]
fn a_service_that_another_program_made_is_told_with_what_it_lacks() {
    let domain = Domain::new();
    let other = NodeBuilder::new().config(domain.config()).create::<ipc::Service>().unwrap();
    let _service = other
        .service_builder(&"a/b".try_into().unwrap())
        .publish_subscribe::<[f64]>()
        .user_header::<FrameHeader>()
        .subscriber_max_buffer_size(3)
        .subscriber_max_borrowed_samples(2)
        .create()
        .unwrap();
    let log = domain.run("publish a/b --value 1 --count 1 -v").stderr;
    let told = "service \"a/b\" is used as its creator made it: 3 frames wait for a reader, where 256 \
        were asked for; to change that, end all its processes and start this one first";
    assert!(log.contains(told), "{log}");
}

#[test]
fn a_list_with_too_few_descriptors_says_so_and_takes_nothing_for_known_that_it_could_not_ask() {
    let (domain, _node) = tank(RELAY);
    let is_too_low = |limit: &u32| {
        let limited = format!("ulimit -n {limit}; exec \"$0\" \"$@\"");
        let ended = domain.start_by(&["sh", "-c", &limited], "list").finish();
        assert!(!ended.stdout.contains("control off"), "{limit}: {}", ended.stdout);
        let why = format!("too many open files: the limit is {limit}, raise it (ulimit -n)");
        let is_told = ended.stderr.contains(&why);
        if !is_told {
            // On a busy machine the node may not answer soon, which is told as well.
            ended.expect_code(0);
        }
        is_told
    };
    let limits = (8..=40).step_by(if is_full_volume() { 2 } else { 6 });
    let enough = limits.into_iter().find(|limit| !is_too_low(limit)).unwrap();
    assert!((12..40).contains(&enough), "{enough} descriptors are enough");
}
