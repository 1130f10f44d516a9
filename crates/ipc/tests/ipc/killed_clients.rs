//! Clients that are killed, at any point, hold nothing.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::variants::{joined, kill};
use isochrone_ipc::{
    Delivery, MAX_CLIENTS, Participant, RequestClient, RequestServer, RequestUpkeep, ipc,
};
use isochrone_testing::{Domain, role, role_domain, volume, wait_for_ok, wait_until};

type Client = RequestClient<ipc::Service>;
type Server = RequestServer<ipc::Service>;
type Node = Participant<ipc::Service>;

const SERVICE: &str = "isochrone/plant/control";

#[test]
fn clients_that_are_killed_one_after_the_other_hold_nothing() {
    let domain = Domain::new();
    let node = Arc::new(domain.join_variant::<ipc::Service>("tester"));
    let served = Served::start(&node);
    ask(&node, b"warm up");
    let before = domain.files().len();
    for n in 0..volume(500) as u64 {
        let mut child = start_client(&domain);
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        if n % 5 == 0 {
            // Anywhere in its start, or between any two of its steps.
            thread::sleep(Duration::from_micros(n * 7919 % 40_000));
        } else {
            let point = ["joined", "opened", "asked", "answered"][n as usize % 5 - 1];
            lines.find(|line| line.as_ref().is_ok_and(|line| line == point)).unwrap().unwrap();
        }
        kill(child);
        if n % 50 == 0 {
            ask(&node, format!("after {n}").as_bytes());
        }
    }
    ask(&node, b"after all");
    // Nobody joins meanwhile: the upkeep alone clears the rest.
    wait_for_ok("no client is left", || match served.clients() {
        0 => Ok(()),
        left => Err(format!("{left} are")),
    });
    // Whoever was killed before he came to the service is for the next who joins.
    drop(domain.join_variant::<ipc::Service>("tester"));
    // The server lets go of a connection at its next look.
    wait_for_ok(&format!("no more than {before} files are left"), || {
        let left = domain.files();
        if left.len() <= before { Ok(()) } else { Err(format!("{} are: {left:?}", left.len())) }
    });
    served.stop();
}

#[test]
fn eight_that_are_killed_at_once_give_way_to_eight_others_while_the_server_goes_on() {
    let domain = Domain::new();
    let node = Arc::new(domain.join_variant::<ipc::Service>("tester"));
    let served = Served::start(&node);
    for point in ["opened", "asked", "answered"] {
        let mut children: Vec<_> = (0..MAX_CLIENTS).map(|_| start_client(&domain)).collect();
        for child in &mut children {
            wait_for(child, point);
        }
        children.into_iter().for_each(kill);
        let mut clients: Vec<_> = (0..MAX_CLIENTS).map(|_| open(&node)).collect();
        for client in &mut clients {
            assert_eq!(ask_with(client, b"next"), b"next!");
        }
    }
    served.stop();
}

#[test]
fn whoever_takes_the_place_of_a_client_that_died_between_request_and_answer_gets_his_own() {
    let (domain, node) = joined::<ipc::Service>();
    let mut server = Server::open(&node, SERVICE).unwrap();
    let mut upkeep = server.upkeep();
    for is_answered in [false, true] {
        let child = start_client(&domain);
        let mut kept = None;
        wait_until("the child asks", || {
            kept = server.receive();
            kept.is_some()
        });
        let kept = kept.unwrap();
        assert_eq!(kept.process(), Some(child.id()));
        kill(child);
        wait_until("it is cleared", || {
            upkeep.tend(&node);
            server.clients() == 0
        });
        // iceoryx2 numbers the requests of each client from zero.
        let mut next = open(&node);
        next.send(b"mine").unwrap();
        if is_answered {
            assert_eq!(kept.answer(b"for the dead").unwrap(), Delivery::GivenUp);
        } else {
            drop(kept);
        }
        let request = server.receive().unwrap();
        assert_eq!(request.bytes(), b"mine");
        request.answer(b"yours").unwrap();
        assert_eq!(next.receive().unwrap().unwrap(), b"yours");
        assert_eq!(next.receive().unwrap(), None);
    }
}

#[test]
fn a_server_that_was_killed_gives_way_to_the_next() {
    let (domain, node) = joined::<ipc::Service>();
    for _ in 0..3 {
        let mut child = start("killed_clients::serves_until_killed", &domain);
        wait_for(&mut child, "serving");
        assert_eq!(ask(&node, b"hello"), b"hello!");
        kill(child);
    }
}

/// A server in a thread of its own, and its upkeep in another.
struct Served {
    stop: Arc<AtomicBool>,
    clients: Arc<std::sync::atomic::AtomicUsize>,
    threads: Vec<thread::JoinHandle<()>>,
}

impl Served {
    fn start(node: &Arc<Node>) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let clients = Arc::new(std::sync::atomic::AtomicUsize::new(0));
        let (send, receive) = std::sync::mpsc::channel::<RequestUpkeep<ipc::Service>>();
        let serving = {
            let (node, stop, clients) = (node.clone(), stop.clone(), clients.clone());
            thread::spawn(move || {
                // Ports stay in the thread that opened them.
                let mut server = Server::open(&node, SERVICE).unwrap();
                send.send(server.upkeep()).unwrap();
                while !stop.load(Ordering::Relaxed) {
                    echo(&mut server);
                    server.tend(&node);
                    clients.store(server.clients(), Ordering::Relaxed);
                    thread::sleep(Duration::from_millis(2));
                }
            })
        };
        let mut upkeep = receive.recv().unwrap();
        let tending = {
            let (node, stop) = (node.clone(), stop.clone());
            thread::spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    upkeep.tend(&node);
                    thread::sleep(Duration::from_millis(20));
                }
            })
        };
        Self { stop, clients, threads: vec![serving, tending] }
    }

    fn clients(&self) -> usize {
        self.clients.load(Ordering::Relaxed)
    }

    fn stop(self) {
        self.stop.store(true, Ordering::Relaxed);
        for thread in self.threads {
            thread.join().unwrap();
        }
    }
}

fn echo(server: &mut Server) {
    while let Some(request) = server.receive() {
        let mut answer = request.bytes().to_vec();
        answer.push(b'!');
        let _ = request.answer(&answer).unwrap();
    }
}

fn open(node: &Node) -> Client {
    Client::open(node, SERVICE).unwrap().unwrap()
}

fn ask(node: &Node, request: &[u8]) -> Vec<u8> {
    ask_with(&mut open(node), request)
}

fn ask_with(client: &mut Client, request: &[u8]) -> Vec<u8> {
    client.send(request).unwrap();
    let mut answer = None;
    wait_until("the answer comes", || {
        answer = client.receive().unwrap();
        answer.is_some()
    });
    answer.unwrap()
}

/// Waits until a process says so.
fn wait_for(child: &mut Child, word: &str) {
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.find(|line| line.as_ref().is_ok_and(|line| line == word)).unwrap().unwrap();
}

fn start_client(domain: &Domain) -> Child {
    start("killed_clients::asks_until_killed", domain)
}

/// Runs this test binary again, as another process.
fn start(part: &str, domain: &Domain) -> Child {
    role(part, &domain.file())
        .stdout(Stdio::piped())
        // A process that is killed in its start may say what it met.
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

fn join() -> Option<Node> {
    Some(Participant::join("victim", &role_domain()?).unwrap())
}

#[test]
#[ignore = "is run by the tests that kill it"]
fn asks_until_killed() {
    let Some(node) = join() else { return };
    println!("\njoined");
    let mut client = open(&node);
    println!("opened");
    client.send(b"first").unwrap();
    println!("asked");
    loop {
        if client.receive().unwrap().is_some() {
            println!("answered");
            client.send(b"again").unwrap();
        }
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
#[ignore = "is run by the tests that kill it"]
fn serves_until_killed() {
    let Some(node) = join() else { return };
    let mut server = Server::open(&node, SERVICE).unwrap();
    println!("\nserving");
    loop {
        echo(&mut server);
        thread::sleep(Duration::from_millis(1));
    }
}
