//! Going back in a running node, and asking one that many ask or that is slow.

mod domain;
mod program;

use std::time::Instant;

use domain::{Domain, Ended, PATIENCE, tank};
use isochrone_runtime::control::{
    Client, ClientError, Code, DescribeParams, GetParams, JournalParams, SetParams,
};
use program::assert_says;

const TANK: &str = r#"
[node]
name = "tank"
control = "force"
[limits]
"ramp.value" = [0.0, 100.0]
[[task]]
name = "fast"
period = "5ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = 1.0, setChangeRate = 10.0 }
[[output]]
service = "tank/out"
signals = ["ramp.delayedValue"]
"#;

fn undo(domain: &Domain, arguments: &str) -> Ended {
    domain.run(&format!("undo tank {arguments}"))
}

#[test]
fn an_undo_under_a_force_prints_what_it_stores_and_not_what_the_force_holds() {
    let (domain, node) = tank(TANK);
    domain.stdout("force tank ramp.value=99 --hold");
    let set = domain.run("set tank ramp.value=20").expect_code(0);
    assert_says(&set.stderr, &["\"ramp.value\" is forced"]);
    let undone = undo(&domain, "").expect_code(0);
    assert_says(&undone.stdout, &["ramp.value  20  -> 1"]);
    let again = undo(&domain, "2").expect_code(1);
    assert_says(&again.stderr, &["transaction 2 is already undone, by transaction 3"]);
    node.stop().expect_code(0);
}

#[test]
fn an_apply_has_a_number_and_a_reason_and_is_not_taken_for_the_set_before_it() {
    let (domain, node) = tank(TANK);
    domain.stdout("set tank ramp.value=20");
    let narrower = TANK.replace("[0.0, 100.0]", "[0.0, 50.0]");
    domain.write("narrow.toml", &narrower);
    let tried = domain.stdout("apply tank narrow.toml --dry-run --allow-missed");
    assert_says(
        &tried,
        &["nothing was changed", "limits   ramp.value: 0.0 to 100.0 -> 0.0 to 50.0"],
    );
    let applied = domain.start_with(&[
        "apply",
        "tank",
        "narrow.toml",
        "--allow-missed",
        "--comment",
        "the pump is old",
    ]);
    assert_says(&applied.finish().expect_code(0).stdout, &["transaction 2, applied, from cycle"]);
    let journal = domain.stdout("journal tank");
    assert_says(
        &journal,
        &[
            "apply 2, cycle ",
            ": the pump is old\n",
            "narrow.toml, sha256 ",
            "0 added, 0 removed, 0 changed",
            "limits ramp.value: 0.0 to 100.0 -> 0.0 to 50.0",
        ],
    );
    let refused = undo(&domain, "").expect_code(1);
    assert_says(
        &refused.stderr,
        &["is apply 2, which cannot be undone", "apply the configuration"],
    );
    let refused = undo(&domain, "2").expect_code(1);
    assert_says(&refused.stderr, &["transaction 2 is an apply, which cannot be undone"]);
    assert_eq!(domain.stdout("get tank ramp.value"), "20\n", "nothing was taken back");
    undo(&domain, "1").expect_code(0);
    node.stop().expect_code(0);
}

#[test]
fn who_schedules_values_ahead_keeps_nobody_from_looking_and_all_see_them_coming() {
    let (domain, node) = tank(TANK);
    let participant = domain.join("operator");
    let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
    let mut pending = Vec::new();
    let since = Instant::now();
    let busy = loop {
        assert!(since.elapsed() < PATIENCE, "{} are to come", pending.len());
        let cycle = client.call(&DescribeParams {}).unwrap().tasks[0].cycle;
        let values = [("ramp.value", 5.0)].into_iter().collect();
        let at = Some(cycle + 1900);
        match client.call(&SetParams { values, at, ..SetParams::default() }) {
            Ok(done) => pending.push(done.transaction),
            Err(ClientError::Refused(failure)) => break failure,
            Err(error) => panic!("{error}"),
        }
    };
    assert_eq!(busy.code, Code::Busy, "{busy}");
    let names = vec!["ramp.*".to_owned()];
    client.call(&GetParams { names, ..GetParams::default() }).unwrap();
    let journal = client.call(&JournalParams::default()).unwrap();
    let known = journal.entries.iter().map(|entry| entry.transaction);
    let known: Vec<u64> = known.chain(journal.pending.iter().map(|one| one.transaction)).collect();
    assert_eq!(known, pending, "each has happened or is to come");
    assert!(journal.pending.iter().all(|one| one.names == ["ramp.value"]), "{journal:?}");
    drop((client, participant));
    node.stop().expect_code(0);
}

#[test]
fn the_ninth_client_is_told_who_asks_already() {
    let (domain, node) = tank(TANK);
    let participant = domain.join("operator");
    let connect = || Client::connect(&participant, "tank", PATIENCE);
    let mut clients: Vec<_> = (0..8).map(|_| connect().unwrap()).collect();
    let refused = domain.run("get tank ramp.value").expect_code(1);
    assert_says(
        &refused.stderr,
        &["node \"tank\" is asked by 8 clients already", "end one of them"],
    );
    assert!(!refused.stderr.contains("let a node of isochrone create"), "{}", refused.stderr);
    clients.pop();
    assert_eq!(domain.stdout("get tank ramp.value"), "1\n");
    drop((clients, participant));
    node.stop().expect_code(0);
}

#[test]
fn values_of_a_task_that_is_slower_than_the_patience_of_a_verb_are_waited_for() {
    let (domain, node) = tank(&TANK.replace("5ms", "7s"));
    assert_eq!(domain.stdout("get tank ramp.value"), "1\n");
    assert_eq!(domain.stdout("get tank ramp.value"), "1\n", "after a whole period");
    node.stop().expect_code(0);
}
