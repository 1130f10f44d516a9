//! Parameters and diagnostics of a node that runs in this process.

use isochrone::prelude::*;
use serde_json::{Value, json};

use crate::harness::{Bridge, message};

const LEVEL: &str = r#"
    [node]
    name = "level"
    [limits]
    "ramp.setChangeRate" = [0.0, 50.0]
    [[task]]
    name = "fast"
    period = "2ms"
    [[variable]]
    name = "target"
    type = "LREAL"
    initial = 25.0
    [[block]]
    name = "ramp"
    type = "LimRateOfChangeCI"
    in = { value = "target", setChangeRate = 10.0 }
    [[output]]
    service = "plant/level"
    signals = ["ramp.delayedValue"]
"#;

/// A bridge, and a node beside it.
pub(crate) fn with_node(configuration: &str, test: impl FnOnce(&mut Bridge)) {
    let mut bridge = Bridge::start(configuration);
    let file = bridge.domain.write("level.toml", LEVEL);
    let plan = Plan::read(&file, &Rules { catalogue: CATALOGUE, ..Rules::default() }).unwrap();
    let node = Node::prepare(&plan, bridge.domain.join("level")).unwrap().start();
    test(&mut bridge);
    node.finish().unwrap();
    bridge.stop();
}

/// What a service answers.
#[track_caller]
fn answer(bridge: &Bridge, service: &str, kind: &str, request: &Value) -> Value {
    let topic = format!("/plant/level/{service}");
    let mut peer = bridge.peer(&["call", &topic, kind, &request.to_string()]);
    message(&mut peer, "an answer", |_| true)
}

#[test]
fn the_parameters_of_a_node_are_those_of_a_node_of_ros() {
    let configuration = "[ros2]\nnamespace = \"/plant\"\n[[parameters]]\nnode = \"level\"\n";
    with_node(configuration, |bridge| {
        let list = json!({"prefixes": [], "depth": 0});
        let listed = answer(bridge, "list_parameters", "ListParameters", &list);
        let names = listed["result"]["names"].as_array().unwrap();
        assert!(names.contains(&json!("ramp.setChangeRate")) && names.contains(&json!("target")));
        assert!(!names.contains(&json!("ramp.delayedValue")));
        assert!(listed["result"]["prefixes"].as_array().unwrap().contains(&json!("ramp")));

        let names = json!({"names": ["ramp.setChangeRate", "nothing"]});
        let got = answer(bridge, "get_parameters", "GetParameters", &names);
        assert_eq!(got["values"][0]["double_value"], 10.0);
        assert_eq!([&got["values"][0]["type"], &got["values"][1]["type"]], [3, 0]);
        let types = answer(bridge, "get_parameter_types", "GetParameterTypes", &names);
        assert_eq!(types["types"], json!([3, 0]));
        let described = answer(bridge, "describe_parameters", "DescribeParameters", &names);
        let range = &described["descriptors"][0]["floating_point_range"][0];
        assert_eq!((&range["from_value"], &range["to_value"]), (&json!(0.0), &json!(50.0)));

        let mut events = bridge.peer(&["subscribe", "/parameter_events", "ParameterEvent"]);
        // An integer is taken for a double; the second is beyond its limits.
        let wanted = json!({"parameters": {"target": 30, "ramp.setChangeRate": 99.0}});
        let set = answer(bridge, "set_parameters", "SetParameters", &wanted);
        assert_eq!(set["results"][0], json!({"successful": true, "reason": ""}));
        assert_eq!(set["results"][1]["successful"], false);
        let reason = set["results"][1]["reason"].as_str().unwrap();
        assert!(reason.contains("ramp.setChangeRate") && reason.contains("50"), "{reason}");
        let event = message(&mut events, "an event", |_| true);
        assert_eq!(event["node"], "/plant/level");
        assert_eq!(event["changed_parameters"][0]["name"], "target");
        assert_eq!(event["changed_parameters"][0]["value"]["double_value"], 30.0);

        // All or nothing.
        let wanted = json!({"parameters": {"target": 40.0, "ramp.setChangeRate": 99.0}});
        let service = ("set_parameters_atomically", "SetParametersAtomically");
        let set = answer(bridge, service.0, service.1, &wanted);
        assert_eq!(set["result"]["successful"], false);
        let got = answer(bridge, "get_parameters", "GetParameters", &json!({"names": ["target"]}));
        assert_eq!(got["values"][0]["double_value"], 30.0);
        let wanted = json!({"parameters": {"target": 40.0, "ramp.setChangeRate": 9.0}});
        let set = answer(bridge, service.0, service.1, &wanted);
        assert_eq!(set["result"]["successful"], true);

        let wanted = json!({"parameters": {"use_sim_time": true}});
        let set = answer(bridge, "set_parameters", "SetParameters", &wanted);
        let reason = set["results"][0]["reason"].as_str().unwrap();
        assert!(reason.contains("use_sim_time cannot be set"), "{reason}");
    });
}

#[test]
fn diagnostics_say_how_nodes_and_links_are() {
    let configuration = "[diagnostics]\nrate = 5\n[[to_ros]]\nservice = \"plant/level\"\ntopic = \"/level\"\n\
                         type = \"std_msgs/msg/Float64\"\nfields = { data = \"ramp.delayedValue\" }\n\
                         [[to_ros]]\nservice = \"plant/levle\"\n";
    with_node(configuration, |bridge| {
        let mut peer = bridge.peer(&["subscribe", "/diagnostics", "DiagnosticArray"]);
        let status = |array: &Value, name: &str| {
            let all = array["status"].as_array().unwrap();
            all.iter().find(|status| status["name"] == name).cloned()
        };
        let value = |status: &Value, key: &str| {
            let all = status["values"].as_array().unwrap();
            let found = all.iter().find(|pair| pair["key"] == key)?;
            Some(found["value"].as_str().unwrap().to_owned())
        };
        let link = "isochrone-ros2: plant/level -> /level";
        let whole = message(&mut peer, "a node with its jitter", |array| {
            let node = status(array, "isochrone: level");
            let jitter = node.and_then(|node| value(&node, "fast.release_jitter_p50_us"));
            jitter.is_some_and(|jitter| jitter.parse::<f64>().is_ok())
                && status(array, link).is_some_and(|link| value(&link, "sent") != Some("0".into()))
        });
        let node = status(&whole, "isochrone: level").unwrap();
        assert_eq!(node["level"], 0, "{node}");
        assert!(value(&node, "fast.missed").is_some() && value(&node, "fast.alarms").is_some());
        let misspelt = "isochrone-ros2: plant/levle -> /plant/levle/SIGNAL";
        let whole = message(&mut peer, "a link that hears nothing", |array| {
            status(array, misspelt).is_some_and(|link| link["level"] == 1)
        });
        assert_eq!(
            status(&whole, misspelt).unwrap()["message"],
            "silent: nobody publishes plant/levle; plant/levle -> /plant/levle/SIGNAL: 0 sent"
        );
        assert_eq!(status(&whole, link).unwrap()["level"], 0);
        bridge.process.wait_for(
            "nobody publishes \"plant/levle\" (did you mean \"plant/level\"?); of services with a publisher, there is: \
             plant/level",
        );
    });
}
