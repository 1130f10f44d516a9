//! Many programs that ask one running node, at once and one after the other, well and badly.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{
    Client, ClientError, Code, DescribeParams, GetParams, JournalParams, SetParams, Value,
    service_name,
};
use isochrone_ipc::{Depth, FrameSubscriber, Participant, RequestClient, ipc};
use isochrone_testing::{
    Domain, PATIENCE, Plant, Process, role, role_domain, volume, wait_for_ok, wait_for_some,
    wait_until,
};
use rustix::process::Signal;
use serde_json::json;

/// Two parameters, whose values go out in the frames of the cycle, and a counter with its copy.
fn pair() -> Plant {
    Plant::new("level")
        .task("t", "1ms")
        .saw("saw", "incrementRange = 3, numberSteps = 1000")
        .times(1.0, "copy", "\"saw.value\"")
        .times(1.0, "one", "0.0")
        .times(1.0, "other", "0.0")
        .output("level/out", &["one.y", "other.y"])
}

fn start(domain: &Domain) -> Process {
    domain.start_node("node.toml", &pair(), "")
}

fn connect(participant: &Participant<ipc::Service>) -> Client<ipc::Service> {
    Client::connect(participant, "level", PATIENCE).unwrap()
}

/// Sets both parameters to one number, with opposite signs.
fn both(value: f64) -> SetParams {
    let values = [("one.x", value), ("other.x", -value)].into_iter().collect();
    SetParams { values, ..SetParams::default() }
}

#[test]
fn of_many_transactions_no_reader_of_frames_or_values_sees_a_half() {
    const WRITERS: u64 = 6;
    let transactions = volume(10_000) as u64;
    /// That many frames and values are read, at least, while transactions are written.
    const READINGS: u64 = 100;
    let domain = Domain::new();
    let _process = start(&domain);
    let written = AtomicU64::new(0);
    let (frames, reads) = (AtomicU64::new(0), AtomicU64::new(0));
    let is_over = AtomicBool::new(false);
    // A busy machine may keep the readers from their CPU: then more is written.
    let is_enough = || {
        let [frames, reads] = [&frames, &reads].map(|seen| seen.load(Ordering::Relaxed));
        written.load(Ordering::Relaxed) >= transactions && frames.min(reads) >= READINGS
    };
    let since = Instant::now();
    let opposite = |a: f64, b: f64| a.to_bits() == (-b).to_bits() || (a == 0.0 && b == 0.0);
    thread::scope(|scope| {
        let writers: Vec<_> = (0..WRITERS)
            .map(|writer| {
                let (domain, written, is_enough) = (&domain, &written, &is_enough);
                scope.spawn(move || {
                    let participant = domain.join("writer");
                    let mut client = connect(&participant);
                    let mut random = 0x9E37_79B9_7F4A_7C15 ^ (writer << 32);
                    while !is_enough() {
                        assert!(since.elapsed() < 4 * PATIENCE, "the readers see nothing");
                        random ^= random << 13;
                        random ^= random >> 7;
                        random ^= random << 17;
                        client.call(&both(random as f64 / 3.0)).unwrap();
                        written.fetch_add(1, Ordering::Relaxed);
                    }
                })
            })
            .collect();
        scope.spawn(|| {
            let participant = domain.join("observer");
            let mut subscriber =
                FrameSubscriber::open(&participant, "level/out", 2, Depth::All).unwrap();
            while !is_over.load(Ordering::Relaxed) {
                while let Some(frame) = subscriber.next(0) {
                    let [one, other] = frame.values() else { panic!() };
                    assert!(opposite(*one, *other), "{one} {other}");
                    frames.fetch_add(1, Ordering::Relaxed);
                }
                thread::sleep(Duration::from_millis(1));
            }
        });
        scope.spawn(|| {
            let participant = domain.join("reader");
            let mut client = connect(&participant);
            let names: Vec<_> = ["*.*".to_owned()].into();
            while !is_over.load(Ordering::Relaxed) {
                let read = client.call(&GetParams { names: names.clone(), ..Default::default() });
                let values = read.unwrap().values;
                let number = |name| match values.get(name) {
                    Some(Value::Number(number)) => number,
                    Some(Value::Integer(number)) => number as f64,
                    value => panic!("{name}: {value:?}"),
                };
                assert!(opposite(number("one.x"), number("other.x")), "{values:?}");
                assert!(opposite(number("one.y"), number("other.y")), "{values:?}");
                assert!(number("one.x") == number("one.y"), "after the blocks stepped: {values:?}");
                assert!(number("saw.value") == number("copy.y"), "of one cycle: {values:?}");
                reads.fetch_add(1, Ordering::Relaxed);
            }
        });
        let ended: Vec<_> = writers.into_iter().map(|writer| writer.join()).collect();
        is_over.store(true, Ordering::Relaxed);
        ended.into_iter().for_each(|ended| ended.unwrap());
    });
    let written = written.into_inner();
    let participant = domain.join("reader");
    let newest =
        connect(&participant).call(&JournalParams { since: Some(written), limit: None }).unwrap();
    assert_eq!(newest.entries[0].sequence, written, "each was done once");
    assert_eq!(newest.total, 1);
}

/// What a client does that is killed: asks for something that will happen, and waits.
#[test]
#[ignore = "is run by the test that kills it"]
fn waits_for_its_answer() {
    let Some(domain) = role_domain() else { return };
    let participant = Participant::join("victim", domain).unwrap();
    let mut client = connect(&participant);
    let tasks = client.call(&DescribeParams {}).unwrap().tasks;
    let at = Some((tasks[0].cycle + 900).into());
    client.call(&SetParams { at, ..both(1.0) }).unwrap();
}

/// All other clients that a node has places for, once those who were killed are cleared.
fn others(participant: &Participant<ipc::Service>) -> Vec<Client<ipc::Service>> {
    let connected =
        |_| wait_for_ok("there is a place", || Client::connect(participant, "level", PATIENCE));
    let mut others: Vec<_> = (1..isochrone_ipc::MAX_CLIENTS).map(connected).collect();
    for other in &mut others {
        assert!(other.call(&both(2.0)).is_ok());
    }
    others
}

/// Descriptors of a process, and its mappings of shared memory.
fn held(process: &Process) -> (usize, usize) {
    let of = |what: &str| format!("/proc/{}/{what}", process.id());
    let maps = std::fs::read_to_string(of("maps")).unwrap();
    let shared = maps.lines().filter(|line| line.contains("/dev/shm/")).count();
    (std::fs::read_dir(of("fd")).unwrap().count(), shared)
}

#[test]
fn a_client_that_is_killed_between_request_and_answer_holds_nothing_and_what_it_asked_for_happens()
{
    let domain = Domain::new();
    let process = start(&domain);
    let participant = domain.join("operator");
    let mut client = connect(&participant);
    let (mut asked, mut attempts) = (Vec::new(), 0);
    let mut before = None;
    // More than a service has places for, twice.
    while asked.len() < 24 {
        let command = role("operate_together::waits_for_its_answer", &domain.config_file());
        let mut victim = Process::start(command);
        // On a busy machine the victim may ask too late, or have its answer before it is killed.
        let mut received = None;
        wait_until("the node has the request", || {
            let journal = client.call(&JournalParams::default()).unwrap();
            let mut pending = journal.pending.into_iter().map(|pending| pending.transaction);
            received = pending.find(|transaction| !asked.contains(transaction));
            received.is_some() || victim.is_over()
        });
        victim.kill();
        attempts += 1;
        assert!(attempts < 100, "{} requests in a hundred attempts", asked.len());
        assert!(client.call(&DescribeParams {}).is_ok());
        asked.extend(received);
        if asked.len() == 12 && before.is_none() {
            let _others = others(&participant);
            before = Some(held(&process));
        }
    }
    wait_until("all that was asked for has happened", || {
        let entries = client.call(&JournalParams::default()).unwrap().entries;
        asked.iter().all(|asked| entries.iter().any(|entry| entry.transaction == *asked))
    });
    // Once they are cleared, there is room for all again, and the node holds no more than before.
    let _others = others(&participant);
    let (descriptors, mappings) = before.unwrap();
    wait_until(&format!("it holds no more than {before:?} after the first twelve"), || {
        let now = held(&process);
        now.0 <= descriptors && now.1 <= mappings
    });
}

#[test]
fn what_is_no_request_is_answered_with_what_is_wrong_and_the_node_goes_on() {
    let domain = Domain::new();
    let _process = start(&domain);
    let participant = domain.join("operator");
    let mut raw = RequestClient::open(&participant, &service_name("level")).unwrap().unwrap();
    let mut ask = |bytes: &[u8]| -> serde_json::Value {
        raw.send(bytes).unwrap();
        let answer = wait_for_some("there is an answer", || raw.receive().unwrap());
        serde_json::from_slice(&answer).unwrap()
    };
    let request = |method: &str, params: serde_json::Value| {
        json!({"jsonrpc": "2.0", "id": "7", "method": method, "params": params}).to_string()
    };
    for (text, code) in [
        (String::new(), -32700),
        ("{\"id\":\"7\",\"jsonr".to_owned(), -32700),
        ("[]".to_owned(), -32600),
        (format!("[{}]", request("describe", json!({}))), -32600),
        (request("describe", json!({})).replace("2.0", "1.0"), -32600),
        (request("destroy", json!({})), -32601),
        (request("set", json!({"value": {"one.x": 1.0}})), -32602),
        (request("set", json!({"values": {"one.x": "fast"}})), -32602),
        (request("force", json!({"values": {"one.x": "16#1x"}})), -32602),
        (request("set", json!({"values": {"one.x": [1.0]}})), 3),
        (request("set", json!({"values": {"one.x": "NaN"}})), 3),
        (request("set", json!({"values": {"one.x": 1.0}, "at": -1})), -32602),
        (request("save", json!({"offset": 5})), -32602),
    ] {
        let answer = ask(text.as_bytes());
        assert_eq!(answer["error"]["code"], code, "{text}: {answer}");
    }
    let longest = vec![b'['; isochrone_ipc::MAX_MESSAGE_BYTES];
    assert_eq!(ask(&longest)["error"]["code"], -32600);
    assert_eq!(ask(request("describe", json!({})).as_bytes())["result"]["node"], "level");
    drop(raw);
    // A longer one is not sent at all.
    let mut client = connect(&participant);
    let values = [("x".repeat(300_000), 1.0)].into_iter().collect();
    let error = client.call(&SetParams { values, ..SetParams::default() }).unwrap_err();
    assert!(error.to_string().contains("divide it"), "{error}");
    assert_eq!(client.call(&JournalParams::default()).unwrap().total, 0);
}

#[test]
fn a_client_that_waits_when_the_node_ends_is_told_so() {
    let domain = Domain::new();
    let process = start(&domain);
    let participant = domain.join("operator");
    let mut client = connect(&participant);
    let at = Some((client.call(&DescribeParams {}).unwrap().tasks[0].cycle + 950).into());
    thread::scope(|scope| {
        let waiting = scope.spawn(move || {
            thread::sleep(Duration::from_millis(100));
            process.stop().expect_code(0);
        });
        match client.call(&SetParams { at, ..both(1.0) }) {
            Err(ClientError::Ended { .. }) => {}
            Err(ClientError::Refused(failure)) => assert_eq!(failure.code, Code::TooLate),
            // The machine was slower than the cycle.
            Ok(_) => {}
            Err(error) => panic!("{error}"),
        }
        waiting.join().unwrap();
    });
}

#[test]
fn a_client_that_waits_for_a_node_that_is_killed_is_told_so() {
    let domain = Domain::new();
    let process = start(&domain);
    let participant = domain.join("operator");
    let mut client = connect(&participant);
    client.call(&DescribeParams {}).unwrap();
    // Nothing is answered any more, and the service has its server all the same.
    process.signal(Signal::STOP);
    thread::scope(|scope| {
        let killer = scope.spawn(move || {
            thread::sleep(Duration::from_millis(300));
            process.kill();
        });
        let since = Instant::now();
        let asked = client.call(&both(1.0));
        assert!(matches!(asked, Err(ClientError::Ended { .. })), "{asked:?}");
        assert!(since.elapsed() < PATIENCE, "it is told when it would have given up");
        killer.join().unwrap();
    });
    let again = Client::connect(&participant, "level", PATIENCE);
    assert!(matches!(again, Err(ClientError::NoNode { .. })), "{again:?}");
    // What it left is no obstacle for the next one.
    let _next = start(&domain);
    assert!(connect(&participant).call(&both(1.0)).is_ok());
}
