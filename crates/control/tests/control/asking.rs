//! Clients that ask a node in another process.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::operated;
use crate::operated::{PARAMETERS, Parameters, Running, join, name, telemetry};
use isochrone_control::{
    Client, ClientError, Code, ControlService, DescribeParams, GetParams, Part, SetParams, Value,
    Values, running_nodes, service_name,
};
use isochrone_ipc::{Domain, IsolatedDomain, RequestClient, RequestServer};
use isochrone_testing::{PATIENCE, wait_for_some, wait_until};
use serde_json::json;

#[test]
#[ignore = "is run by the tests that ask it"]
fn takes_requests() {
    operated::take_requests();
}

#[test]
#[ignore = "is run by the tests that ask it"]
fn takes_no_requests() {
    let Ok(file) = std::env::var("ISOCHRONE_TEST_DOMAIN") else { return };
    let node = std::env::var("ISOCHRONE_TEST_NODE").unwrap();
    let participant = join(&Domain::from_file(Path::new(&file)).unwrap());
    let _telemetry = telemetry(&participant, &node);
    println!("\nrunning");
    thread::sleep(Duration::from_secs(600));
}

#[test]
fn a_node_in_another_process_describes_itself_and_is_changed() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
    let description = client.call(&DescribeParams {}).unwrap();
    assert_eq!(description.node, "level");
    assert_eq!(description.started_unix_ns, u64::MAX, "to the last digit");
    assert!(!description.configuration.changed);
    for n in 1..=50_u32 {
        let value = f64::from(n) / 3.0;
        let values = [(name(7), value)].into_iter().collect();
        let set = SetParams { values, at: Some(3.into()), ..SetParams::default() };
        let done = client.call(&set).unwrap();
        assert_eq!(done.transaction, u64::from(n));
        assert_eq!(done.tasks["fast"], Part { cycle: 3, pending: false });
        let names = vec![name(7)];
        let got = client.call(&GetParams { names, ..GetParams::default() }).unwrap();
        assert_eq!(got.values.get(&name(7)), Some(Value::Number(value)), "bit for bit");
    }
    assert_eq!(client.late_answers(), 0);
}

#[test]
fn long_results_come_in_pages_and_are_put_together() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
    let signals = client.signals(None).unwrap();
    let names: Vec<_> = signals.iter().map(|signal| signal.name.clone()).collect();
    assert_eq!(names, (0..PARAMETERS).map(name).collect::<Vec<_>>());
    let configuration = client.save().unwrap();
    assert!(configuration == "# né\n".repeat(100_000), "{} bytes", configuration.len());
}

#[test]
fn what_a_node_refuses_comes_with_its_code_and_all_findings() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
    let values = [("a", 1.0), ("b", 2.0)].into_iter().collect();
    let error = client.call(&SetParams { values, ..SetParams::default() }).unwrap_err();
    let ClientError::Refused(failure) = error else { panic!("{error}") };
    assert_eq!((failure.code, failure.findings.len()), (Code::UnknownName, 2));
    // A request that the service itself refuses does no harm to the next.
    let values = [("x".repeat(300_000), 1.0)].into_iter().collect();
    let error = client.call(&SetParams { values, ..SetParams::default() }).unwrap_err();
    assert!(error.to_string().contains("divide it"), "{error}");
    assert!(client.call(&DescribeParams {}).is_ok());
}

#[test]
fn a_node_that_does_not_run_is_told_with_those_that_do() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = join(&domain);
    let refused = |node: &str| Client::connect(&participant, node, PATIENCE).unwrap_err();
    let error = refused("level");
    let nowhere =
        format!("no node \"level\" runs here; none runs in its domain, {}", participant.domain());
    assert_eq!(error.to_string(), nowhere);
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let closed = Running::start(&domain, "asking::takes_no_requests", "closed");
    let error = refused("levl");
    assert!(error.to_string().ends_with("did you mean \"level\"?"), "{error}");
    let ClientError::NoNode { running, .. } = refused("\u{7}") else { panic!() };
    assert_eq!(running, ["closed", "level"]);
    let error = refused("closed");
    assert!(matches!(error, ClientError::NotOperated { .. }), "{error}");
    assert!(error.to_string().contains("control = \"off\""), "{error}");
    let nodes = running_nodes(&participant).unwrap();
    assert_eq!(nodes[0].process, closed.process());
}

#[test]
fn a_node_that_is_stopped_does_not_answer_in_time_and_its_late_answer_is_dropped() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
    assert!(client.call(&DescribeParams {}).is_ok());
    level.signal("-STOP");
    let stat = format!("/proc/{}/stat", level.process());
    wait_until("it is stopped", || std::fs::read_to_string(&stat).unwrap().contains(") T "));
    // However short: no answer comes.
    client.wait_for(Duration::from_millis(100));
    let error = client.call(&DescribeParams {}).unwrap_err();
    assert!(matches!(error, ClientError::NoAnswer { is_stopped: true, .. }), "{error}");
    let remedy = format!("(kill -CONT {})", level.process());
    assert!(error.to_string().contains(&remedy), "{error}");
    // What was given up before the node received it is not done afterwards.
    let values = [(name(0), 1.0)].into_iter().collect();
    let error = client.call(&SetParams { values, ..SetParams::default() }).unwrap_err();
    assert!(matches!(error, ClientError::NoAnswer { .. }), "{error}");
    level.signal("-CONT");
    drop(client);
    let mut client = Client::connect(&participant, "level", PATIENCE).unwrap();
    assert!(!client.call(&DescribeParams {}).unwrap().configuration.changed);
}

#[test]
fn a_request_that_takes_long_and_was_given_up_holds_up_nobody() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut other = Client::connect(&participant, "level", PATIENCE).unwrap();
    let values: Values<_> = [(name(0), 1.0)].into_iter().collect();
    let at =
        |at: u64| SetParams { values: values.clone(), at: Some(at.into()), ..SetParams::default() };
    let gives_up = Arc::new(AtomicBool::new(false));
    thread::scope(|scope| {
        let hasty = scope.spawn(|| {
            let client = Client::connect(&participant, "level", PATIENCE).unwrap();
            let mut client = client.interrupted_by(gives_up.clone());
            client.call(&at(3_600_000)).unwrap_err()
        });
        // One that is given up before the node has received it is not done.
        wait_until("the node has received it", || {
            other.call(&DescribeParams {}).unwrap().configuration.changed
        });
        gives_up.store(true, Ordering::Relaxed);
        let error = hasty.join().unwrap();
        assert!(matches!(error, ClientError::Interrupted { .. }), "{error}");
    });
    assert_eq!(other.call(&at(0)).unwrap().transaction, 2);
    // The next request of a client in its place is received as well, although the first is still under way.
    let mut patient = Client::connect(&participant, "level", PATIENCE).unwrap();
    assert_eq!(patient.call(&at(0)).unwrap().transaction, 3);
}

#[test]
fn a_node_that_is_killed_ends_the_waiting_of_its_clients_once_it_is_cleared() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let has_ended = AtomicBool::new(false);
    let (connected, is_connected) = std::sync::mpsc::channel();
    thread::scope(|scope| {
        let (participant, has_ended) = (&participant, &has_ended);
        scope.spawn(move || {
            is_connected.recv().unwrap();
            thread::sleep(Duration::from_millis(500));
            drop(level);
            // As everybody does who joins.
            while !has_ended.load(Ordering::Relaxed) {
                participant.clean_up();
                thread::sleep(Duration::from_millis(20));
            }
        });
        let mut client = Client::connect(participant, "level", PATIENCE).unwrap();
        connected.send(()).unwrap();
        let values = [(name(0), 1.0)].into_iter().collect();
        let set = SetParams { values, at: Some(60_000.into()), ..SetParams::default() };
        let error = client.call(&set).unwrap_err();
        has_ended.store(true, Ordering::Relaxed);
        assert!(matches!(error, ClientError::Ended { .. }), "{error}");
    });
}

#[test]
fn answers_that_are_not_ours_are_passed_over() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = join(&domain);
    let stop = AtomicBool::new(false);
    let (opened, is_open) = std::sync::mpsc::channel();
    thread::scope(|scope| {
        let (participant, stop) = (&participant, &stop);
        scope.spawn(move || {
            let server = || RequestServer::open(participant, &service_name("level")).unwrap();
            let (mut liar, mut server) = (server(), server());
            opened.send(()).unwrap();
            let answer = |bytes: &[u8], id: Option<&str>, version: &str| {
                let request: serde_json::Value = serde_json::from_slice(bytes).unwrap();
                let id = id.map_or(request["id"].clone(), |id| json!(id));
                json!({"jsonrpc": "2.0", "id": id, "result": {
                    "node": "level", "version": version, "control": "read",
                    "configuration": {"file": "", "sha256": "", "changed": false},
                    "started_unix_ns": 0, "tasks": []}})
                .to_string()
            };
            while !stop.load(Ordering::Relaxed) {
                if let Some(request) = liar.receive() {
                    let text = answer(request.bytes(), Some("another's"), "wrong");
                    request.answer(text.as_bytes()).unwrap();
                }
                // The truth comes later.
                thread::sleep(Duration::from_millis(5));
                if let Some(request) = server.receive() {
                    let text = answer(request.bytes(), None, "right");
                    request.answer(text.as_bytes()).unwrap();
                }
            }
        });
        is_open.recv().unwrap();
        let mut client = Client::connect(participant, "level", PATIENCE).unwrap();
        wait_until("an answer comes late", || {
            assert_eq!(client.call(&DescribeParams {}).unwrap().version, "right");
            client.late_answers() > 0
        });
        stop.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_desk_that_stands_by_lets_the_other_answer_and_takes_over_when_it_is_gone() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = join(&domain);
    let has_taken_over = AtomicBool::new(false);
    let stop = AtomicBool::new(false);
    let (opened, is_open) = std::sync::mpsc::channel();
    thread::scope(|scope| {
        let (participant, has_taken_over, stop) = (&participant, &has_taken_over, &stop);
        scope.spawn(move || {
            let mut node = Parameters::new();
            let mut standby = ControlService::open(participant, "level").unwrap();
            let mut active = Some(ControlService::open(participant, "level").unwrap());
            opened.send(()).unwrap();
            while !stop.load(Ordering::Relaxed) {
                if has_taken_over.load(Ordering::Relaxed) {
                    active = None;
                    standby.serve(&mut node, participant);
                } else {
                    standby.stand_by(participant);
                }
                if let Some(desk) = &mut active {
                    desk.serve(&mut node, participant);
                }
                thread::sleep(Duration::from_millis(1));
            }
        });
        is_open.recv().unwrap();
        let mut client = Client::connect(participant, "level", PATIENCE).unwrap();
        let mut set = |n: f64| {
            let values = [(name(0), n)].into_iter().collect();
            client.call(&SetParams { values, ..SetParams::default() }).unwrap()
        };
        for n in 1..=20_u32 {
            assert_eq!(set(n.into()).transaction, u64::from(n), "each is done once");
        }
        has_taken_over.store(true, Ordering::Relaxed);
        let done = set(0.0);
        assert_eq!(done.transaction, 21);
        assert_eq!(done.before.get(&name(0)), Some(Value::Number(20.0)));
        stop.store(true, Ordering::Relaxed);
    });
}

#[test]
fn what_is_no_request_is_answered_by_a_running_node_and_it_goes_on() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let _level = Running::start(&domain, "asking::takes_requests", "level");
    let participant = join(&domain);
    let mut raw = RequestClient::open(&participant, &service_name("level")).unwrap().unwrap();
    let mut ask = |bytes: &[u8]| -> serde_json::Value {
        raw.send(bytes).unwrap();
        let what = format!("there is an answer to {:?}", String::from_utf8_lossy(bytes));
        let answer = wait_for_some(&what, || raw.receive().unwrap());
        serde_json::from_slice(&answer).unwrap()
    };
    for (bytes, id, code) in [
        (&b""[..], json!(null), -32700),
        (b"{\"id\":\"7\",\"jsonr", json!("7"), -32700),
        (b"\xff\xfe", json!(null), -32700),
        (b"[{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"describe\"}]", json!(null), -32600),
        (b"{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"destroy\"}", json!("7"), -32601),
        (
            b"{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"get\",\"params\":{\"name\":1}}",
            json!("7"),
            -32602,
        ),
        (b"{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"alarms\",\"params\":{}}", json!("7"), 6),
    ] {
        let answer = ask(bytes);
        assert_eq!((&answer["id"], &answer["error"]["code"]), (&id, &json!(code)), "{answer}");
    }
    let longest = vec![b'['; isochrone_ipc::MAX_MESSAGE_BYTES];
    assert_eq!(ask(&longest)["error"]["code"], -32600);
    let answer = ask(b"{\"jsonrpc\":\"2.0\",\"id\":\"8\",\"method\":\"describe\"}");
    assert_eq!(answer["result"]["node"], "level");
}
