//! A connection that failed comes about after all.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;
use std::thread;
use std::time::Duration;

use isochrone_ipc::{Delivery, Participant, RequestClient, RequestServer, ipc};
use isochrone_testing::{Domain, in_own_process, role, role_domain, wait_for_some};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

const SERVICE: &str = "isochrone/plant/control";

#[test]
fn a_client_that_came_while_the_server_had_no_file_descriptors_is_answered_afterwards() {
    // It changes the limits of its process.
    in_own_process(|| {
        let domain = Domain::new();
        let node = domain.join_variant::<ipc::Service>("tester");
        let mut server = RequestServer::open(&node, SERVICE).unwrap();
        let mut upkeep = server.upkeep();
        let mut child = role("repaired_requests::asks_once", &domain.file())
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
        let request = wait_for_some("it comes about", || {
            upkeep.tend(&node);
            server.receive()
        });
        assert_eq!(request.answer(b"after all").unwrap(), Delivery::Sent);
        wait_for("after all");
        assert!(child.wait().unwrap().success());
    });
}

#[test]
#[ignore = "is run by the test that answers it"]
fn asks_once() {
    let Some(domain) = role_domain() else { return };
    let node = Participant::<ipc::Service>::join("asker", &domain).unwrap();
    println!("\njoined");
    std::io::stdin().read_line(&mut String::new()).unwrap();
    let mut client = RequestClient::open(&node, SERVICE).unwrap().unwrap();
    client.send(b"hello?").unwrap();
    println!("asked");
    let answer = wait_for_some("it is answered", || client.receive().unwrap());
    println!("{}", String::from_utf8(answer).unwrap());
}
