//! Operating a running node from the command line.

use isochrone_testing::plants::{TANK, tank};
use isochrone_testing::{Domain, Ended, Process, assert_says, wait_until};
use serde_json::{Value, json};

/// The line of a signal in what `show` prints, cell by cell.
fn row_of<'t>(table: &'t str, signal: &str) -> Vec<&'t str> {
    let line = table.lines().find(|line| line.split_whitespace().next() == Some(signal));
    line.unwrap_or_else(|| panic!("{table}"))
        .split("  ")
        .map(str::trim)
        .filter(|c| !c.is_empty())
        .collect()
}

#[test]
fn show_tells_what_each_signal_is_and_get_prints_values_alone() {
    let (domain, _node) = tank(TANK);
    let table = domain.stdout("show tank");
    assert_eq!(row_of(&table, "ramp.setChangeRate")[..2], ["ramp.setChangeRate", "10"]);
    assert_says(&table, &["parameter", "wired", "output", "age"]);
    assert_eq!(row_of(&table, "level"), ["level", "0", "input", "LREAL", "not ok, SUBSTITUTE"]);
    assert_eq!(row_of(&table, "ramp.value"), ["ramp.value", "0", "wired", "LREAL", "SUBSTITUTE"]);
    assert_eq!(row_of(&table, "beat.timeRange")[1], "T#1s500ms");
    assert_says(row_of(&table, "ramp.status")[1], &["16#"]);
    let ramp = domain.stdout("show tank ramp.*");
    assert!(!ramp.contains("guard.") && ramp.contains("ramp.delayedValue"), "{ramp}");
    let parameters = domain.stdout("show tank ramp.* --parameters --names");
    assert!(parameters.lines().any(|name| name == "ramp.setChangeRate"), "{parameters}");
    assert!(!parameters.contains("ramp.value\n"), "{parameters}");

    assert_eq!(domain.stdout("get tank ramp.setChangeRate level.ok"), "10\nFALSE\n");
    let got = domain.answer("get tank beat.timeRange level.ok --json");
    assert_eq!(got["values"], json!({"beat.timeRange": 1500, "level.ok": false}));
    assert!(got["tasks"]["fast"]["cycle"].is_u64(), "{got}");
    let shown = domain.answer("show tank level --json");
    assert_eq!(shown["signals"][0]["role"], "input");
    assert_eq!(shown["signals"][0]["ok"], false);
}

#[test]
fn a_set_tells_its_cycle_and_the_values_before_and_is_undone() {
    let (domain, _node) = tank(TANK);
    let set =
        ["set", "tank", "ramp.setChangeRate=2.5", "beat.timeRange=T#2s", "--comment", "too fast"];
    let done = domain.start_with(&set).finish().expect_code(0);
    assert_says(&done.complaints(), &["\"beat.timeRange\" is read only in the block's first call"]);
    assert_says(&done.stdout, &["transaction 1, from cycle ", " of task \"fast\" on\n"]);
    assert_eq!(row_of(&done.stdout, "ramp.setChangeRate"), ["ramp.setChangeRate", "10", "-> 2.5"]);
    assert_eq!(row_of(&done.stdout, "beat.timeRange"), ["beat.timeRange", "T#1s500ms", "-> T#2s"]);
    let values = "get tank ramp.setChangeRate beat.timeRange";
    assert_eq!(domain.stdout(values), "2.5\nT#2s\n");
    let second = domain.answer("set tank ramp.setChangeRate=3 --json");
    assert_eq!(second["before"], json!({"ramp.setChangeRate": 2.5}));

    domain.expect("undo tank 1", 1, &["ramp.setChangeRate", "changed"]);
    let undone = domain.stdout("undo tank");
    let number = second["transaction"].as_u64().unwrap();
    assert_says(&undone, &[&format!("transaction {number} of "), " is taken back\n", "3  -> 2.5"]);
    domain.run("undo tank").expect_code(0).prints(&["transaction 1 of ", " is taken back\n"]);
    assert_eq!(domain.stdout(values), "10\nT#1s500ms\n");
    domain.expect("undo tank", 1, &["nothing was set"]);

    let journal = domain.stdout("journal tank");
    assert_says(
        &journal,
        &[
            "set 1, cycle ",
            ": too fast\n",
            "undo ",
            &format!("takes {number} back"),
            "10         -> 2.5",
            "T#1s500ms  -> T#2s",
        ],
    );
    let entries = domain.answer("journal tank --json");
    let actions = entries.as_array().unwrap().iter().map(|entry| entry["action"].as_str().unwrap());
    assert_eq!(actions.collect::<Vec<_>>(), ["set", "set", "undo", "undo"]);
}

#[test]
fn a_set_that_names_a_cycle_acts_from_that_cycle_on() {
    let (domain, _node) = tank(TANK);
    // A busy machine may be past the cycle by the time that the second verb asks.
    let (at, done) = (0..20)
        .find_map(|_| {
            let got = domain.answer("get tank ramp.setChangeRate --json");
            let at = got["tasks"]["fast"]["cycle"].as_u64().unwrap() + 800;
            let done = domain.run(&format!("set tank ramp.setChangeRate=2 --at {at}"));
            done.status.success().then_some((at, done.stdout))
        })
        .unwrap();
    let (_, told) = done.split_once(" cycle ").unwrap();
    let told: u64 = told.split(' ').next().unwrap().parse().unwrap();
    // The next one, if that cycle was missed.
    assert!(told >= at, "{at}: {done}");
    let mut set = Value::Null;
    wait_until("it has happened", || {
        set = domain.answer("journal tank --json")[0].clone();
        !set.is_null()
    });
    assert!(set["cycle"].as_u64() >= Some(at), "{set}");
    assert_eq!(domain.stdout("get tank ramp.setChangeRate"), "2\n");
    domain.expect("set tank ramp.setChangeRate=3 --at 1", 1, &["cycle 1"]);
}

#[test]
fn what_cannot_be_set_is_refused_whole_with_every_reason() {
    let (domain, _node) = tank(TANK);
    let set = "set tank ramp.setChangeRate=60 ramp.setChangRate=1 ramp.value=1 guard.x2=1 beat.numberSteps=1.5 ramp.delayedValue=0 guard.y1=NaN";
    let refused = domain.run(set).expect_code(1);
    assert_eq!(refused.stdout, "");
    assert_says(
        &refused.stderr,
        &[
            "nothing was changed",
            "50",
            "did you mean \"ramp.setChangeRate\"?",
            "\"ramp.value\"",
            "[[protect]]",
            "\"beat.numberSteps\"",
            "\"ramp.delayedValue\"",
        ],
    );
    assert!(refused.stderr.lines().count() >= 7, "{}", refused.stderr);
    assert_eq!(domain.stdout("get tank ramp.setChangeRate"), "10\n");
    domain.expect("set tank ramp.setChangeRate=NaN", 1, &["NaN"]);
    let says = ["ramp.setChangeRate: a value is true, false, a number"];
    domain.expect("set tank ramp.setChangeRate=fast", 2, &says);
    for usage in ["set tank ramp.setChangeRate", "set tank"] {
        domain.expect(usage, 2, &["NAME=VALUE"]);
    }
    domain.expect("force tank level=1", 2, &["--seconds", "--hold"]);
}

#[test]
fn who_asks_for_a_node_that_does_not_run_is_told_those_that_do() {
    let (domain, node) = tank(TANK);
    domain.expect("show tnak", 3, &["no node \"tnak\" runs here", "\"tank\"?", "There is: tank"]);
    assert_eq!(domain.stdout("list --nodes"), "tank\n");
    // A list asks each node for half a second, and a busy machine may need longer for an answer.
    let is_answered = |listed: &Value| listed["control_nodes"][0]["tasks"][0]["missed"].is_u64();
    (0..20).map(|_| domain.answer("list --json")).find(is_answered).unwrap();
    let is_answered = |listed: &String| listed.contains("control force");
    let listed = (0..20).map(|_| domain.run("list").stdout).find(is_answered).unwrap();
    assert_says(&listed, &["1 control node", "200 Hz", "missed"]);
    node.stop().expect_code(0);
    let absent = domain.run("show tank").expect_code(3);
    let here = format!("No node runs in this domain, {}", domain.join("reader").domain());
    assert_says(&absent.stderr, &[&here, "--iceoryx2-config or ICEORYX2_CONFIG names another"]);
}

#[test]
fn a_node_that_takes_no_requests_says_why() {
    let (domain, node) = tank(&TANK.replace("\"force\"", "\"off\""));
    domain.expect("get tank level", 3, &["takes no requests", "control = \"off\""]);
    node.stop().expect_code(0);
    let _node = domain.start_node("tank.toml", &TANK.replace("\"force\"", "\"read\""), "");
    domain.run("get tank level").expect_code(0);
    domain.expect("set tank ramp.setChangeRate=1", 1, &["control"]);
}

#[test]
fn what_was_done_is_said_also_where_its_result_cannot_be_written() {
    let (domain, _node) = tank(TANK);
    for (number, arguments) in [
        (1, "set tank ramp.setChangeRate=3"),
        (2, "set tank ramp.setChangeRate=4 --json"),
        (3, "undo tank"),
        (4, "force tank level=9 --hold"),
        (5, "release tank level"),
    ] {
        let full = std::fs::File::create("/dev/full").unwrap();
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let ran = Ended::from(domain.command(&arguments).stdout(full).output().unwrap());
        assert_eq!(ran.code(), 1);
        let says = format!("transaction {number} was made, but cannot write to stdout: No space");
        assert_says(&ran.stderr, &[says]);
    }
}

#[test]
fn a_force_holds_a_signal_until_it_is_released_or_its_time_is_up() {
    let (domain, node) = tank(TANK);
    let forced = domain.stdout("force tank level=50 ramp.delayedValue=7.5 --hold");
    let told = ["transaction 1", "-> 50\n", "-> 7.5\n", "release tank level ramp.delayedValue`\n"];
    assert_says(&forced, &told);
    let held = domain.run("get tank level ramp.delayedValue").expect_code(0);
    assert_eq!(held.stdout, "50\n7.5\n");
    assert_says(&held.complaints(), &["level is SUBSTITUTE FORCED"]);
    let table = domain.stdout("show tank");
    assert_eq!(row_of(&table, "level").last(), Some(&"forced, not ok, SUBSTITUTE"));
    assert_eq!(row_of(&table, "ramp.delayedValue").last(), Some(&"forced, SUBSTITUTE"));
    assert_eq!(domain.stdout("forces tank --names"), "level\nramp.delayedValue\n");
    assert_says(&domain.stdout("forces tank"), &["until cycle", "level ", "release"]);
    let released = domain.stdout("release tank level");
    assert_eq!(row_of(&released, "level"), ["level", "50", "-> 0"]);
    domain.stdout("release tank --all");
    domain.expect("forces tank", 0, &["nothing is forced"]);
    domain.expect("release tank --all", 0, &["nothing is forced"]);
    domain.expect("release tank level", 1, &["level"]);

    // A release calls off what is still to come.
    domain.stdout("force tank level=9 --hold --at +1500");
    let released = domain.stdout("release tank level");
    assert_eq!(row_of(&released, "level"), ["level", "0", "-> 0"]);
    assert!(!domain.stdout("journal tank").contains("still to come"));
    domain.expect("release tank level", 1, &["not forced"]);

    let mut journal = domain.start("journal tank --follow");
    let timed = domain.stdout("force tank level=1 --seconds 300ms");
    assert_says(&timed, &["until cycle "]);
    journal.wait_for("end of force");
    let free = domain.run("get tank level").expect_code(0);
    assert_eq!((&*free.stdout, &*free.complaints()), ("0\n", "warning: level is SUBSTITUTE"));
    journal.stop().expect_code(0);
    domain.stdout("force tank level=3 --hold");
    node.stop().expect_code(0).says(&["\"level\" was still forced to 3.0 when the node ended"]);
}

#[test]
fn running_values_are_saved_and_the_old_file_is_kept() {
    let (domain, _node) = tank(TANK);
    domain.stdout("set tank ramp.setChangeRate=2.5");
    let expected = TANK.replace("setChangeRate = 10.0 ", "setChangeRate = 2.5  ");
    assert_eq!(domain.stdout("save tank"), expected);
    assert_eq!(domain.read("tank.toml"), TANK, "nothing was written");
    domain.expect("save tank --in-place", 0, &["saved to ", "tank.toml.bak"]);
    let files = || (domain.read("tank.toml"), domain.read("tank.toml.bak"));
    assert_eq!(files(), (expected.clone(), TANK.into()));
    // A second time there is nothing to save, and what was kept stays.
    domain.expect("save tank --in-place", 0, &["nothing was written"]);
    assert_eq!(domain.read("tank.toml.bak"), TANK);
    domain.run("simulate tank.toml --cycles 1").expect_code(0);
    domain.write("tank.toml", "# mine\n");
    let says = ["was changed since the node started", "tank.toml.bak"];
    domain.expect("save tank --in-place", 0, &says);
    assert_eq!(files(), (expected.clone(), "# mine\n".into()));
    domain.run("save tank -o other.toml").expect_code(0);
    assert_eq!(domain.read("other.toml"), expected);
    for place in ["/dev/full", "missing/tank.toml", "/proc/tank.toml"] {
        domain.expect(&format!("save tank -o {place}"), 1, &["cannot write", place]);
    }
    domain.expect("save tank -o missing/t.toml", 1, &["no folder"]);
}

#[test]
fn a_save_over_the_file_that_the_node_was_started_with_is_no_news_after_an_apply() {
    let (domain, _node) = tank(TANK);
    let other = TANK.replace("setChangeRate = 10.0", "setChangeRate = 20.0");
    domain.write("other.toml", &other);
    domain.stdout("apply tank other.toml --allow-missed");
    domain.stdout("set tank ramp.setChangeRate=2.5");
    let saved = domain.expect("save tank --in-place", 0, &["saved to ", "tank.toml.bak"]);
    assert!(!saved.stderr.contains("was changed"), "nobody changed it: {}", saved.stderr);
    assert_eq!(domain.read("tank.toml.bak"), TANK);
    domain.stdout("set tank ramp.setChangeRate=3");
    let says = ["was changed since the node started, by hand or by a save"];
    domain.expect("save tank --in-place", 0, &says);
}

#[test]
fn verbs_ask_for_nothing_beside_what_they_do_or_show() {
    let (domain, _node) = tank(TANK);
    let asked = |arguments: &str| {
        let mut command = domain.command(&arguments.split(' ').collect::<Vec<_>>());
        command.env("RUST_LOG", "isochrone_control=trace");
        let ended = Process::start(command).finish().expect_code(0);
        let requests =
            ended.stderr.lines().filter_map(|line| line.split_once("asks node \"tank\": "));
        requests.map(|(_, method)| method.to_owned()).collect::<Vec<_>>()
    };
    for (arguments, requests) in [
        ("set tank ramp.setChangeRate=5", &["set"][..]),
        ("set tank beat.timeRange=T#2s ramp.setChangeRate=16#A", &["set"]),
        ("set tank ramp.callOB=fast --at +50", &["set"]),
        ("force tank ramp.delayedValue=1 beat.timeRange=1s --hold", &["force"]),
        ("get tank beat.timeRange ramp.*", &["get"]),
        ("watch tank beat.timeRange ramp.* --count 1", &["get"]),
        ("forces tank", &["forces"]),
        ("release tank ramp.delayedValue", &["release"]),
        ("undo tank --json", &["journal", "undo"]),
        ("journal tank", &["journal"]),
        ("apply tank tank.toml --allow-missed", &["apply"]),
    ] {
        assert_eq!(asked(arguments), requests, "{arguments}");
    }
}

#[test]
fn show_takes_blocks_and_tells_what_is_protected_and_limited() {
    let (domain, _node) = tank(TANK);
    let block = domain.stdout("show tank guard level");
    assert_eq!(row_of(&block, "guard.x2").last(), Some(&"protected"));
    assert_eq!(row_of(&block, "level")[2], "input");
    assert!(!block.contains("beat."), "{block}");
    let ramp = domain.stdout("show tank ramp");
    assert_eq!(row_of(&ramp, "ramp.setChangeRate").last(), Some(&"0 to 50"));
    assert_says(row_of(&ramp, "ramp.callOB")[1], &["calling task"]);
    let shown = domain.answer("show tank ramp.setChangeRate guard.x2 --json");
    assert_eq!(shown["signals"][0]["limits"], json!([0.0, 50.0]));
    assert_eq!(shown["signals"][1]["protected"], true);
    domain.expect("get tank guard", 1, &["it is a block", "guard.x,", "\"guard.*\""]);
    domain.expect("get tank GUARD.Y", 1, &["mean \"guard.y\"?"]);
}

#[test]
fn a_journal_file_is_printed_run_after_run() {
    let domain = Domain::new();
    for rate in [3, 4] {
        let _node = domain.start_node("tank.toml", TANK, "--journal tank.jsonl");
        let set = format!("set tank ramp.setChangeRate={rate} beat.timeRange={rate}s");
        domain.run(&set).expect_code(0);
    }
    let told = domain.stdout("journal tank.jsonl");
    assert_says(&told, &["run 1 of node \"tank\"", "10         -> 3\n", "T#1s500ms  -> T#3s\n"]);
    assert_says(&told, &["run 2 of node \"tank\"", "10         -> 4\n", "T#1s500ms  -> T#4s\n"]);
    let runs = domain.answer("journal tank.jsonl --json");
    assert_eq!(runs[1]["entries"][0]["action"], "set", "{runs}");
    assert_eq!(runs[1]["run"]["run"], 2);
    // What comes before a line that is broken is printed all the same.
    let text = domain.read("tank.jsonl");
    let (first, second) = text.split_once("\"run\":2").unwrap();
    domain.write("broken.jsonl", format!("{first}\"run\":2{}", second.replace("entry", "enrty")));
    for arguments in ["journal broken.jsonl", "journal broken.jsonl --json"] {
        domain
            .run(arguments)
            .expect_code(2)
            .prints(&["ramp.setChangeRate"])
            .says(&["no line of a journal: unknown variant `enrty`"]);
    }
    domain.write("empty.jsonl", "");
    domain.expect("journal empty.jsonl --json", 2, &["has no runs"]);
    domain.expect("journal tank.jsonl --follow", 2, &["is a file"]);
    domain.expect("journal absent.jsonl", 2, &["absent.jsonl"]);
}
