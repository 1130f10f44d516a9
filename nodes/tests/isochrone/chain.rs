//! `chain`: how long values take through nodes.

use isochrone_testing::plants::{RELAY, relay_with, second_relay, tank};
use isochrone_testing::{Domain, Process};
use serde_json::Value;

/// A source and two nodes behind it, all of them sending.
fn three(domain: &Domain) -> Vec<Process> {
    let mut processes = vec![
        domain.start_node("relay.toml", RELAY, ""),
        domain.start_node("second.toml", &second_relay(), ""),
    ];
    let source = domain.publish("relay/in --value 4 --rate 200");
    processes.push(source);
    processes
}

/// Measures until something was measured: a machine that is busy may keep a process from its CPU for long.
fn measured(domain: &Domain, arguments: &str) -> String {
    let mut ended = (0..20).map(|_| domain.run(&format!("chain {arguments}")));
    ended.find(|ended| ended.status.code() == Some(0)).unwrap().stdout
}

#[test]
fn the_way_of_every_value_is_measured_hop_by_hop() {
    let domain = Domain::new();
    let _processes = three(&domain);
    let chain = measured(&domain, "relay/in relay/out second/out --seconds 2 --json");
    let chain: Value = serde_json::from_str(&chain).unwrap();
    let hops = chain["hops"].as_array().unwrap();
    assert_eq!(hops.len(), 2, "{chain}");
    for (hop, (from, to, node)) in
        hops.iter().zip([("relay/in", "relay/out", "relay"), ("relay/out", "second/out", "second")])
    {
        assert_eq!(
            (&hop["from"], &hop["to"], &hop["node"]),
            (&from.into(), &to.into(), &node.into())
        );
        // A publisher that loses its CPU while it sends may reach this program too late.
        assert!(hop["unknown"].as_u64() < hop["latency_ns"]["count"].as_u64(), "{chain}");
    }
    let times = |of: &Value| {
        let latency = &of["latency_ns"];
        ["min", "max"].map(|key| latency[key].as_u64().unwrap())
    };
    let ([first, _], [second, _], [whole, _]) = (times(&hops[0]), times(&hops[1]), times(&chain));
    assert!(whole >= first + second, "{chain}");
    assert!(chain["latency_ns"]["count"].as_u64() <= hops[0]["latency_ns"]["count"].as_u64());
    let services = chain["services"].as_array().unwrap();
    assert_eq!(services[1]["publisher"], "relay", "{chain}");
    assert_eq!(services[1]["period_ns"], 2_000_000, "{chain}");

    let text = measured(&domain, "relay/in relay/out --seconds 1");
    for part in ["1 hop measured", "relay/in -> relay/out  relay", "whole way", "p99.9"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

#[test]
fn services_that_are_no_chain_are_refused_with_those_that_are() {
    let domain = Domain::new();
    let _processes = three(&domain);
    let refused =
        |arguments: &str, code| domain.run(&format!("chain {arguments}")).expect_code(code).stderr;
    let left_out = refused("relay/in second/out", 2);
    assert!(left_out.contains("isochrone chain relay/in relay/out second/out"), "{left_out}");
    let turned = refused("relay/out relay/in", 2);
    assert!(turned.contains("does not read \"relay/out\"; it reads no service"), "{turned}");
    let mistyped = refused("relay/in relay/uot", 3);
    assert!(mistyped.contains("did you mean \"relay/out\"?"), "{mistyped}");
    let twice = refused("relay/in relay/out relay/in", 2);
    assert!(twice.contains("is named twice"), "{twice}");
    let alone = refused("relay/in", 2);
    assert!(alone.contains("isochrone chain"), "{alone}");
}

#[test]
fn a_node_that_ends_during_the_measurement_ends_it_and_is_named() {
    let domain = Domain::new();
    let mut processes = three(&domain);
    let chain = domain.start_until(
        "chain relay/in relay/out second/out --seconds 60",
        "measuring relay/in -> relay/out -> second/out",
    );
    let second = processes.remove(1);
    second.stop().expect_code(0);
    chain
        .finish()
        .expect_code(1)
        .prints(&["whole way"])
        .says(&["the publisher of \"second/out\" ended"]);
}

#[test]
fn a_node_that_is_killed_during_the_measurement_is_named() {
    let domain = Domain::new();
    let mut processes = three(&domain);
    let chain = domain
        .start_until("chain relay/in relay/out --seconds 4", "measuring relay/in -> relay/out");
    processes.remove(0).kill();
    // What a killed process leaves may be swept up meanwhile; then its publisher has left.
    chain.finish().expect_code(1).says(&["\"relay/out\""]);
}

/// The output does not depend on the first input, whose samples are newer than those of the second.
fn two_inputs() -> String {
    relay_with("[[input]]\nname = \"y\"\nservice = \"relay/other\"").replace("[\"x\"]", "[\"y\"]")
}

#[test]
fn a_node_that_reads_a_service_but_computes_nothing_from_it_leaves_too_little_to_judge() {
    let (domain, _node) = tank(&two_inputs());
    let _source = domain.publish("relay/in --value 4 --rate 200");
    let ended = domain.run("chain relay/in relay/out --seconds 1").expect_code(4);
    let said = "no frame of \"relay/out\" goes back to a frame of \"relay/in\"";
    assert!(ended.stderr.contains(said), "{}", ended.stderr);
    assert!(ended.stderr.contains("the oldest sample behind them came from elsewhere"));
}
