//! A connection that failed comes about after all. Alone in its process, whose limits it changes.

#[path = "ipc/domain/mod.rs"]
mod domain;

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use domain::Domain;
use isochrone_ipc::{Delivery, Participant, RequestClient, RequestServer, ipc};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

const SERVICE: &str = "isochrone/plant/control";
const PATIENCE: Duration = Duration::from_secs(60);

#[test]
fn a_client_that_came_while_the_server_had_no_file_descriptors_is_answered_afterwards() {
    let domain = Domain::new();
    let node = domain.join::<ipc::Service>();
    let mut server = RequestServer::open(&node, SERVICE).unwrap();
    let mut upkeep = server.upkeep();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "asks_once", "--ignored", "--nocapture"])
        .env("ISOCHRONE_TEST_DOMAIN", domain.file())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut say = child.stdin.take().unwrap();
    let mut wait_for = |word: &str| {
        lines.find(|line| line.as_ref().is_ok_and(|line| line == word)).unwrap().unwrap();
    };
    wait_for("joined");

    let before = getrlimit(Resource::Nofile);
    setrlimit(Resource::Nofile, Rlimit { current: Some(64), ..before }).unwrap();
    let filling: Vec<_> = std::iter::from_fn(|| File::open("/dev/null").ok()).collect();
    assert!(!filling.is_empty());
    writeln!(say, "go").unwrap();
    wait_for("asked");
    assert!(server.receive().is_none());
    drop(filling);
    setrlimit(Resource::Nofile, before).unwrap();
    // iceoryx2 does not come back to it.
    for _ in 0..50 {
        assert!(server.receive().is_none());
        thread::sleep(Duration::from_millis(1));
    }
    let begin = Instant::now();
    let request = loop {
        upkeep.tend(&node);
        if let Some(request) = server.receive() {
            break request;
        }
        assert!(begin.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(5));
    };
    assert_eq!(request.answer(b"after all").unwrap(), Delivery::Sent);
    wait_for("after all");
    assert!(child.wait().unwrap().success());
}

#[test]
#[ignore = "is run by the test that answers it"]
fn asks_once() {
    let Ok(file) = std::env::var("ISOCHRONE_TEST_DOMAIN") else { return };
    let domain = isochrone_ipc::Domain::from_file(Path::new(&file)).unwrap();
    let node = Participant::<ipc::Service>::join("asker", &domain).unwrap();
    println!("\njoined");
    std::io::stdin().read_line(&mut String::new()).unwrap();
    let mut client = RequestClient::open(&node, SERVICE).unwrap().unwrap();
    client.send(b"hello?").unwrap();
    println!("asked");
    let begin = Instant::now();
    loop {
        if let Some(answer) = client.receive().unwrap() {
            println!("{}", String::from_utf8(answer).unwrap());
            return;
        }
        assert!(begin.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
}
