//! Going back in a running node, and asking one that many ask or that is slow.

use isochrone_control::{
    Client, ClientError, Code, DescribeParams, GetParams, JournalParams, SetParams,
};
use isochrone_testing::plants::{RAMP, tank};
use isochrone_testing::{Domain, Ended, PATIENCE, Process, assert_says, wait_for_ok};
use serde_json::json;

fn undo(domain: &Domain, arguments: &str) -> Ended {
    domain.run(&format!("undo tank {arguments}"))
}

/// Runs the program as somebody.
fn run_as(domain: &Domain, user: &str, arguments: &[&str]) -> Ended {
    let mut command = domain.command(arguments);
    command.env("USER", user);
    Process::start(command).finish().expect_code(0)
}

#[test]
fn an_undo_under_a_force_prints_what_it_stores_and_not_what_the_force_holds() {
    let (domain, _node) = tank(RAMP);
    domain.stdout("force tank ramp.value=99 --hold");
    domain.expect("set tank ramp.value=20", 0, &["\"ramp.value\" is forced"]);
    undo(&domain, "").expect_code(0).prints(&["ramp.value  20  -> 25"]);
    undo(&domain, "2").expect_code(1).says(&["transaction 2 is already undone, by transaction 3"]);
}

#[test]
fn an_undo_says_whose_transaction_it_takes_back() {
    let (domain, _node) = tank(RAMP);
    for (number, value) in [(1, 20), (2, 30)] {
        run_as(&domain, "anna", &["set", "tank", &format!("ramp.value={value}")]);
        let named: &[&str] = if number == 1 { &["undo", "tank", "1"] } else { &["undo", "tank"] };
        let done = run_as(&domain, "bob", named).stdout;
        assert_says(&done, &[&format!("transaction {} of anna is taken back", 2 * number - 1)]);
    }
    let again = undo(&domain, "4 --json").expect_code(0).json();
    assert_eq!((&again["undone"], &again["undone_client"]), (&json!(4), &json!("bob")), "{again}");
    assert_eq!((&again["transaction"], &again["after"]["ramp.value"]), (&json!(5), &json!(30.0)));
}

#[test]
fn a_transaction_of_an_earlier_run_is_told_from_one_that_never_was() {
    let domain = Domain::new();
    for _ in 0..2 {
        let _node = domain.start_node("tank.toml", RAMP, "--journal tank.jsonl");
        domain.stdout("set tank ramp.value=20");
        undo(&domain, "99").expect_code(1).says(&["there is no transaction 99"]);
        if domain.read("tank.jsonl").contains("\"run\":2") {
            undo(&domain, "1")
                .expect_code(1)
                .says(&["transaction 1 is of an earlier run", "journal FILE.jsonl"]);
        }
    }
    assert_says(&domain.read("tank.jsonl"), &["\"run\":2"]);
}

#[test]
fn an_error_is_a_sentence_with_json_too_and_leaves_stdout_empty() {
    let (domain, _node) = tank(RAMP);
    for (verb, code) in [
        ("get tank nope --json", 1),
        ("set tank ramp.value=1000 --json", 1),
        ("undo tank 7 --json", 1),
        ("show knat --json", 3),
        ("apply tank nope.toml --json", 2),
    ] {
        let refused = domain.run(verb).refused(code);
        assert!(!refused.contains('{'), "{verb}: {refused}");
    }
}

#[test]
fn what_a_star_leaves_out_is_counted() {
    let many = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\ncount = 5\n[[input]]\nname = \"level\"\nservice = \"tank/in\"\n";
    let (domain, _node) = tank(&RAMP.replace("[[output]]", &format!("{many}[[output]]")));
    let shown = domain.run("show tank *").expect_code(0).prints(&["level"]);
    let pins = domain.stdout("show tank *.* --names").lines().count();
    let all = domain.stdout("show tank --names").lines().count();
    let rest = all - pins - 1;
    assert_says(&shown.stderr, &[&format!("{pins} more match '*.*', {rest} more match '*.*.*'")]);
    for complete in ["show tank", "show tank * *.* *.*.*", "show tank ramp.*", "show tank saw.*"] {
        let shown = domain.run(complete).expect_code(0);
        assert!(!shown.stderr.contains("more match"), "{complete}: {}", shown.stderr);
    }
    assert_eq!(domain.run("show tank * --names").expect_code(0).stderr, "");
}

#[test]
fn an_apply_has_a_number_and_a_reason_and_is_not_taken_for_the_set_before_it() {
    let (domain, _node) = tank(RAMP);
    domain.stdout("set tank ramp.value=20");
    let narrower = RAMP.replace("[0.0, 100.0]", "[0.0, 50.0]");
    domain.write("narrow.toml", &narrower);
    let tried = domain.stdout("apply tank narrow.toml --dry-run --allow-missed");
    assert_says(
        &tried,
        &["nothing was changed", "limits   ramp.value: 0.0 to 100.0 -> 0.0 to 50.0"],
    );
    let apply = ["apply", "tank", "narrow.toml", "--allow-missed", "--comment", "the pump is old"];
    domain.run_with(&apply).expect_code(0).prints(&["transaction 2, applied, from cycle"]);
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
    undo(&domain, "")
        .expect_code(1)
        .says(&["is apply 2, which cannot be undone", "apply the configuration"]);
    undo(&domain, "2").expect_code(1).says(&["transaction 2 is an apply, which cannot be undone"]);
    assert_eq!(domain.stdout("get tank ramp.value"), "20\n", "nothing was taken back");
    undo(&domain, "1").expect_code(0);
}

#[test]
fn who_schedules_values_ahead_keeps_nobody_from_looking_and_all_see_them_coming() {
    let (domain, _node) = tank(RAMP);
    let participant = domain.join("operator");
    let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
    let mut pending = Vec::new();
    let busy = wait_for_ok("no more may be to come", || {
        let cycle = client.call(&DescribeParams {}).unwrap().tasks[0].cycle;
        let values = [("ramp.value", 5.0)].into_iter().collect();
        let at = Some((cycle + 1900).into());
        match client.call(&SetParams { values, at, ..SetParams::default() }) {
            Ok(done) => {
                pending.push(done.transaction);
                Err(format!("{} are to come", pending.len()))
            }
            Err(ClientError::Refused(failure)) => Ok(failure),
            Err(error) => panic!("{error}"),
        }
    });
    assert_eq!(busy.code, Code::Busy, "{busy}");
    let names = vec!["ramp.*".to_owned()];
    client.call(&GetParams { names, ..GetParams::default() }).unwrap();
    let journal = client.call(&JournalParams::default()).unwrap();
    let known = journal.entries.iter().map(|entry| entry.transaction);
    let known: Vec<u64> = known.chain(journal.pending.iter().map(|one| one.transaction)).collect();
    assert_eq!(known, pending, "each has happened or is to come");
    assert!(journal.pending.iter().all(|one| one.names == ["ramp.value"]), "{journal:?}");
    drop((client, participant));
}

#[test]
fn the_ninth_client_that_looks_is_told_who_asks_already_and_one_that_acts_finds_a_place() {
    let (domain, _node) = tank(RAMP);
    let participant = domain.join("operator");
    let connect = || Client::connect(&participant, "tank", PATIENCE);
    let mut clients: Vec<_> = (0..8).map(|_| connect().unwrap()).collect();
    let refused = domain.expect(
        "get tank ramp.value",
        1,
        &["node \"tank\" is asked by 8 clients already", "end one of them"],
    );
    assert!(!refused.stderr.contains("let a node of isochrone create"), "{}", refused.stderr);
    domain.stdout("set tank ramp.value=26");
    clients.pop();
    assert_eq!(domain.stdout("get tank ramp.value"), "26\n");
    let act = || Client::connect_to_act(&participant, "tank", PATIENCE);
    clients.extend((0..5).map(|_| act().unwrap()));
    domain.expect("set tank ramp.value=27", 1, &["is asked by 12 clients already"]);
    drop((clients, participant));
}
