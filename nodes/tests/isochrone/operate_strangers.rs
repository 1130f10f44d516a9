//! Another process that serves a node's service and answers anything.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use isochrone_ipc::RequestServer;
use isochrone_testing::plants::{RAMP, tank};
use isochrone_testing::{Domain, assert_says};
use rustix::process::Signal;
use serde_json::{Value, json};

/// Serves the node's service while `work` runs, and lies to whoever asks.
fn beside_a_liar(domain: &Domain, work: impl FnOnce()) {
    let stop = AtomicBool::new(false);
    let (opened, is_open) = std::sync::mpsc::channel();
    thread::scope(|scope| {
        let stop = &stop;
        scope.spawn(move || {
            let participant = domain.join("liar");
            let mut liar = RequestServer::open(&participant, "isochrone/tank/control").unwrap();
            opened.send(()).unwrap();
            while !stop.load(Ordering::Relaxed) {
                while let Some(request) = liar.receive() {
                    let asked: Value = serde_json::from_slice(request.bytes()).unwrap();
                    let told = json!({"jsonrpc": "2.0", "id": asked["id"], "result": {
                        "total": 1, "tasks": {}, "values": {"ramp.setChangeRate": 666.0},
                        "transaction": 666, "before": {}, "warnings": []}});
                    let _ = request.answer(told.to_string().as_bytes());
                }
                liar.tend(&participant);
                thread::sleep(Duration::from_micros(200));
            }
        });
        is_open.recv().unwrap();
        let _end = End(stop);
        work();
    });
}

/// Ends the liar, also where a test fails.
struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[test]
fn answers_of_another_process_are_not_taken_for_the_nodes_and_it_is_named() {
    let (domain, mut node) = tank(RAMP);
    let liar = format!("pid {}", std::process::id());
    beside_a_liar(&domain, || {
        node.wait_for("has a second server: node \"liar\"");
        for n in 1..=5 {
            let got = domain.run("get tank ramp.setChangeRate").expect_code(0);
            assert_ne!(got.stdout, "666\n");
            assert_says(
                &got.stderr,
                &["warning", "node \"liar\"", &liar, "tank/control", "end that"],
            );
            domain
                .run(&format!("set tank ramp.setChangeRate={n}"))
                .expect_code(0)
                .prints(&[&format!("transaction {n}, from cycle")]);
            assert_eq!(domain.run("get tank ramp.setChangeRate").stdout, format!("{n}\n"));
        }
        // For the milliseconds in which it repairs a client's connection, the node has the domain's lock.
        let asked = (0..10).find_map(|_| {
            node.signal(Signal::STOP);
            let mut asked = domain.start("get tank ramp.setChangeRate");
            asked.wait_until("silence or the lock", |_, said| {
                said.contains("did not answer") || said.contains("waiting for process")
            });
            node.signal(Signal::CONT);
            let asked = asked.finish();
            (!asked.stderr.contains("waiting for process")).then_some(asked)
        });
        asked.expect("a stopped node that has no lock").expect_code(1).says(&[
            "did not answer",
            "is stopped",
            "node \"liar\"",
            &liar,
        ]);
    });
}

#[test]
fn a_node_that_takes_no_requests_is_not_answered_for_by_another_process() {
    let (domain, _node) = tank(&RAMP.replace("\"force\"", "\"off\""));
    beside_a_liar(&domain, || {
        for verb in ["get tank ramp.setChangeRate", "set tank ramp.setChangeRate=1"] {
            domain.expect(verb, 3, &["takes no requests", "node \"liar\"", "end that"]);
        }
    });
}
