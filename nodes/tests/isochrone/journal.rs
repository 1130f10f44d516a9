//! A run is repeated from its journal: nodes, sensors and operators as processes.

use std::collections::HashMap;
use std::process::Command;
use std::time::Duration;

use isochrone_runtime::control::{Client, ClientError, Code, JournalParams, SetParams, SetResult};
use isochrone_runtime::journal::JournalFile;
use isochrone_testing::{Domain, Ended, PATIENCE, Process, wait_for_some, wait_until};
use rustix::process::{Pid, Resource, Rlimit, getrlimit, prlimit};

/// A node that shows its inputs as it read them, and two tasks, one of which reads the other.
const TANK: &str = r#"
[node]
name = "tank"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[task]]
name = "late"
period = "10ms"
[[input]]
name = "level"
service = "tank/level"
task = "fast"
max_age = "100ms"
on_stale = "default"
default = -1.0
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "level", setChangeRate = 10.0 }
[[block]]
name = "scale"
type = "ScaleLinear"
task = "fast"
in = { x = "ramp.delayedValue", x1 = 0.0, y1 = 0.0, x2 = 10.0, y2 = 1.0, yMin = -5.0, yMax = 5.0 }
[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "late"
in = { value = "scale.y", setChangeRate = 1.0 }
[[output]]
service = "tank/inputs"
task = "fast"
signals = ["level", "level.ok", "level.age"]
[[output]]
service = "tank/out"
task = "fast"
signals = ["ramp.delayedValue", "scale.y"]
"#;

/// A ramp that is put between the ramp and the scale.
const MORE: &str = r#"[[block]]
name = "more"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "ramp.delayedValue", setChangeRate = 100.0 }
"#;

/// The configuration with another block, another wire and another constant.
fn changed() -> String {
    let scale = "[[block]]\nname = \"scale\"";
    TANK.replace(scale, &format!("{MORE}{scale}"))
        .replace("x = \"ramp.delayedValue\"", "x = \"more.delayedValue\"")
        .replace("y2 = 1.0", "y2 = 3.0")
}

/// A subscriber that writes down every frame.
fn record(domain: &Domain, service: &str, file: &str) -> Process {
    let mut subscriber = domain.start(&format!("subscribe {service} --csv {file}"));
    subscriber.wait_for("waiting for service");
    subscriber
}

fn operate(domain: &Domain, arguments: &str) {
    domain.run(arguments).expect_code(0);
}

/// Values by cycle and column.
type Rows = HashMap<u64, HashMap<String, String>>;

fn rows(text: &str) -> Rows {
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = line.split(',').map(str::to_owned);
        let mut row: HashMap<_, _> =
            header.iter().map(|name| (*name).to_owned()).zip(cells).collect();
        row.remove("time_s");
        (row.remove("cycle").unwrap().parse().unwrap(), row)
    };
    text.lines().skip(1).map(row).collect()
}

/// The first value that was recorded and not simulated in its cycle; `None`: all were.
fn difference(recorded: &Rows, simulated: &Rows) -> Option<String> {
    recorded.iter().find_map(|(cycle, row)| {
        row.iter().find_map(|(name, value)| {
            let found = simulated.get(cycle).and_then(|row| row.get(name));
            (found != Some(value)).then(|| format!("cycle {cycle}: {name} {value}, not {found:?}"))
        })
    })
}

fn simulate(domain: &Domain, more: &str) -> Ended {
    let files = "--inputs inputs.csv --journal tank.jsonl --output simulated.csv";
    domain.run(&format!("simulate tank.toml {files} {more}"))
}

/// A run that is operated and recorded, and its simulation; `None` if the machine was so busy that a
/// recorder lost a frame, which is a row that holds.
fn operated() -> Option<(Domain, Ended)> {
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    // A run before it, whose transactions and forces are not this one's.
    domain.run("run tank.toml --cycles 3 --journal tank.jsonl").expect_code(0);

    let recorders =
        [record(&domain, "tank/inputs", "inputs.csv"), record(&domain, "tank/out", "out.csv")];
    let node = domain.start_node("tank.toml", TANK, "--journal tank.jsonl");
    let sensor = "publish tank/level --wave sine --amplitude 20 --frequency 1.7 --rate 200";
    let mut publisher = domain.start(sensor);
    publisher.wait_for("publishing");
    operate(&domain, "set tank ramp.setChangeRate=35.5 scale.yMax=2.5 --comment faster");
    operate(&domain, "force tank level=7.25 --seconds 0.2");
    operate(&domain, "force tank level.ok=false scale.x=3.125 --seconds 0.1");
    operate(&domain, "set tank ramp.setChangeRate=12 after.setChangeRate=0.1");
    domain.write("changed.toml", &changed());
    // A busy machine leaves no slack that a change would have to fit into.
    operate(&domain, "apply tank changed.toml --allow-missed");
    operate(&domain, "set tank more.setChangeRate=4.5");
    operate(&domain, "force tank ramp.delayedValue=-4 --hold");
    // The input goes to its default meanwhile.
    publisher.kill();
    operate(&domain, "undo tank");
    std::thread::sleep(Duration::from_millis(250));
    operate(&domain, "release tank ramp.delayedValue");
    operate(&domain, "force tank scale.yMax=1.0 --hold");
    std::thread::sleep(Duration::from_millis(50));
    node.stop().expect_code(0);
    for recorder in recorders {
        recorder.stop().expect_code(0);
    }
    let simulated = simulate(&domain, "").expect_code(0);
    (!simulated.stderr.contains("have no row")).then_some((domain, simulated))
}

#[test]
fn a_run_with_sets_forces_undos_and_an_online_change_is_simulated_bit_for_bit() {
    let (domain, simulated) =
        (0..10).find_map(|_| operated()).expect("one of ten runs of which no frame was lost");
    let note = &simulated.stderr;
    assert!(note.contains("run 2 of tank.jsonl: "), "{note}");
    let exact = "with the inputs of the run, exact for: fast; not for: late (values of other";
    assert!(note.contains(exact), "{note}");
    assert!(!note.contains("differed") && !note.contains("outside of the simulated"), "{note}");
    let (recorded, simulated) =
        (rows(&domain.read("out.csv")), rows(&domain.read("simulated.csv")));
    assert_eq!(difference(&recorded, &simulated), None);
    assert!(recorded.len() > 100, "{}", recorded.len());

    // It was the journal that made it so: the run before did nothing of this.
    let other = simulate(&domain, "--run 1").expect_code(0);
    assert!(other.stderr.contains("run 1 of tank.jsonl: 0 changes"), "{}", other.stderr);
    assert!(difference(&recorded, &rows(&domain.read("simulated.csv"))).is_some());
}

#[test]
fn a_node_that_is_killed_loses_nothing_that_it_acknowledged() {
    let domain = Domain::new();
    let mut numbers = Vec::new();
    for run in 1..=2 {
        let node = domain.start_node("tank.toml", TANK, "--journal tank.jsonl");
        let participant = domain.join("operator");
        let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
        for rate in 1..=20 {
            let values = [("ramp.setChangeRate", f64::from(rate))].into_iter().collect();
            let set = client.call(&SetParams { values, ..SetParams::default() }).unwrap();
            numbers.push((run, set.transaction));
        }
        node.kill();
    }
    assert!(numbers.is_sorted_by(|a, b| a.1 < b.1), "{numbers:?}");
    let file = JournalFile::read(&domain.path("tank.jsonl")).unwrap();
    let of_run = |run: &isochrone_runtime::journal::JournaledRun| {
        let number = run.header.content.run;
        run.entries.iter().map(move |entry| (number, entry.content.transaction)).collect::<Vec<_>>()
    };
    assert_eq!(file.runs.iter().flat_map(of_run).collect::<Vec<_>>(), numbers);
}

#[test]
fn a_journal_that_was_renamed_is_repeated_from_both_files_and_one_that_was_truncated_from_none() {
    let domain = Domain::new();
    let mut node = domain.start_node("tank.toml", TANK, "--journal tank.jsonl");
    let participant = domain.join("operator");
    let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
    let mut set = |rate: f64| {
        let values = [("ramp.setChangeRate", rate)].into_iter().collect();
        client.call(&SetParams { values, ..SetParams::default() }).unwrap();
    };
    set(1.0);
    std::fs::rename(domain.path("tank.jsonl"), domain.path("old.jsonl")).unwrap();
    node.wait_for("was renamed or removed; another file of this name goes on");
    set(2.0);
    let entries = |file: &str| {
        let file = JournalFile::read_run(&domain.path(file), Some(1)).unwrap();
        file.runs[0].entries.len()
    };
    assert_eq!((entries("old.jsonl"), entries("tank.jsonl")), (1, 2), "all that is acknowledged");
    for (file, changes) in [("old.jsonl", "1 change,"), ("tank.jsonl", "2 changes,")] {
        let repeated = domain.run(&format!("simulate tank.toml --cycles 9 --journal {file}"));
        let repeated = repeated.expect_code(0).stderr;
        assert!(repeated.contains(&format!("run 1 of {file}: {changes}")), "{repeated}");
    }
    let journal = std::fs::OpenOptions::new().write(true).open(domain.path("tank.jsonl")).unwrap();
    journal.set_len(0).unwrap();
    node.wait_for("was truncated while the node ran");
    let alarms = domain.run("alarms tank").expect_code(0).stdout;
    assert!(alarms.contains("was truncated while the node ran"), "{alarms}");
    set(3.0);
    assert_eq!(node.stop().expect_code(0).stderr.matches("was truncated").count(), 1);
    let refused = domain.run("simulate tank.toml --cycles 9 --journal tank.jsonl").expect_code(2);
    let told = "tank.jsonl:1: what was done first in run 1 is lost";
    assert!(refused.stderr.contains(told), "{}", refused.stderr);
    let printed = domain.stdout("journal tank.jsonl");
    assert!(printed.contains("what was done first is lost: the file was truncated"), "{printed}");
}

/// Lets a process make files of so many bytes; `None`: as long as this one may.
fn limit_files(process: &Process, bytes: Option<u64>) {
    let own = getrlimit(Resource::Fsize);
    let limit = Rlimit { current: bytes.or(own.maximum), maximum: own.maximum };
    prlimit(Pid::from_raw(process.id() as i32), Resource::Fsize, limit).unwrap();
}

/// Starts a node with a journal. A file that becomes too long is an error for it, and no signal.
fn start_limited(domain: &Domain, more: &str) -> Process {
    let mut shell = Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_isochrone")]);
    shell.args(["run", "tank.toml", "--journal", "tank.jsonl", "--iceoryx2-config"]);
    shell.arg(domain.config_file()).args(more.split_whitespace());
    shell.current_dir(domain.folder());
    let mut node = Process::start(shell);
    node.wait_for("is running");
    node
}

#[test]
fn a_journal_whose_end_cannot_be_written_is_said_to_be_incomplete_and_repeated_as_far_as_it_goes() {
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    let node = start_limited(&domain, "--json");
    operate(&domain, "set tank ramp.setChangeRate=2");
    let length = std::fs::metadata(domain.path("tank.jsonl")).unwrap().len();
    limit_files(&node, Some(length));
    // Those that find out have happened, and are not in the file.
    wait_until("it is refused", || !domain.run("set tank ramp.setChangeRate=3").status.success());
    let ended = node.stop().expect_code(1);
    let told = "the journal tank.jsonl is incomplete: its end could not be written (File too large";
    assert!(ended.stderr.contains(told), "{}", ended.stderr);
    let report: serde_json::Value = serde_json::from_str(&ended.stdout).unwrap();
    let codes = report["warnings"].as_array().unwrap().iter().map(|warning| &warning["code"]);
    assert_eq!(codes.filter(|code| *code == "journal_incomplete").count(), 1, "{report}");
    let file = JournalFile::read(&domain.path("tank.jsonl")).unwrap();
    assert!(file.runs[0].end.is_none());
    assert_eq!(file.runs[0].entries.len(), 1);
    let cycle = file.runs[0].entries[0].content.cycle;
    let line = file.runs[0].last_line();
    let repeated = domain.run("simulate tank.toml --cycles 9 --journal tank.jsonl").expect_code(0);
    let told = format!(
        "tank.jsonl:{line}: run 1 has no end: the node was killed, could not write more, \
                        or still runs; its last change is that of cycle {cycle} of task \"fast\""
    );
    assert!(repeated.stderr.contains(&told), "{}", repeated.stderr);
}

#[test]
fn while_the_journal_cannot_be_written_changes_are_refused_and_the_node_goes_on() {
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    let mut node = start_limited(&domain, "");
    let participant = domain.join("operator");
    let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
    let mut rate = 1.0;
    let mut set = || {
        rate += 1.0;
        let values = [("ramp.setChangeRate", rate)].into_iter().collect();
        client.call(&SetParams { values, ..SetParams::default() })
    };
    set().unwrap();
    // It is as long already, and what the node writes meanwhile makes it no longer afterwards.
    limit_files(&node, Some(1));
    let length = std::fs::metadata(domain.path("tank.jsonl")).unwrap().len();
    // The change that finds out has happened.
    let refused = wait_for_some("it is refused", || match set() {
        Err(ClientError::Refused(failure)) => Some(failure),
        Ok(_) => None,
        Err(error) => panic!("{error}"),
    });
    assert_eq!(refused.code, Code::Forbidden);
    assert!(refused.message.contains("tank.jsonl cannot be written (File too large"), "{refused}");
    node.wait_for("changes are refused until it can be");
    let alarms = domain.run("alarms tank").expect_code(0).stdout;
    let told = "tank.jsonl cannot be written (File too large";
    let line = alarms.lines().find(|line| line.starts_with("journal "));
    assert!(line.is_some_and(|line| line.contains(told)), "{alarms}");
    assert_eq!(std::fs::metadata(domain.path("tank.jsonl")).unwrap().len(), length);

    limit_files(&node, None);
    wait_until("it is written again", || set().is_ok());
    assert!(!domain.run("alarms tank").expect_code(0).stdout.contains("journal "));
    let done = client.call(&JournalParams::default()).unwrap().entries;
    assert_eq!(node.stop().expect_code(0).stderr.matches("cannot be written").count(), 1);
    let file = JournalFile::read(&domain.path("tank.jsonl")).unwrap();
    assert!(file.runs[0].end.is_some());
    let written: Vec<_> = file.runs[0].entries.iter().map(|entry| entry.content.clone()).collect();
    assert_eq!(written, done, "what waited is written, in order");
}

#[test]
fn what_the_journal_cannot_have_yet_is_answered_with_a_warning_and_a_force_can_always_be_released()
{
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    let node = start_limited(&domain, "");
    operate(&domain, "force tank level=7.25 --hold");
    limit_files(&node, Some(1));
    let participant = domain.join("operator");
    let mut client = Client::connect(&participant, "tank", PATIENCE).unwrap();
    let (mut rate, mut done) = (1.0, Vec::new());
    wait_until("it is refused", || {
        rate += 1.0;
        let values = [("ramp.setChangeRate", rate)].into_iter().collect();
        match client.call(&SetParams { values, ..SetParams::default() }) {
            Ok(set) => done.push(set),
            Err(ClientError::Refused(_)) => return true,
            Err(error) => panic!("{error}"),
        }
        false
    });
    let text = domain.read("tank.jsonl");
    let told = |result: &SetResult| result.warnings.iter().any(|it| it.name == "journal");
    for result in &done {
        let is_written = text.contains(&format!("\"transaction\":{},", result.transaction));
        assert_eq!(told(result), !is_written, "{result:?}");
    }
    let released = domain.run("release tank --all").expect_code(0);
    let warning =
        "is not in the journal yet: the journal tank.jsonl cannot be written (File too large";
    let lines = released.stderr.lines();
    let told = lines.filter(|line| line.starts_with("warning: this was made at cycle "));
    assert_eq!(told.filter(|line| line.contains(warning)).count(), 1, "{}", released.stderr);
    let forces = domain.run("forces tank").expect_code(0).stderr;
    assert!(forces.contains("nothing is forced"), "{forces}");

    limit_files(&node, None);
    wait_until("the release is written", || {
        domain.read("tank.jsonl").contains("\"action\":\"release\"")
    });
    node.stop().expect_code(0);
    let file = JournalFile::read(&domain.path("tank.jsonl")).unwrap();
    let entries = &file.runs[0].entries;
    assert!(entries.iter().is_sorted_by_key(|entry| entry.content.sequence), "{entries:?}");
    let is_there =
        |set: &SetResult| entries.iter().any(|entry| entry.content.transaction == set.transaction);
    assert!(done.iter().all(is_there), "{done:?}\n{entries:?}");
}

#[test]
fn a_journal_that_cannot_be_written_or_repeated_is_refused_with_the_way_out() {
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    let refused = |arguments: &str, told: &str| {
        let ended = domain.run(arguments).expect_code(2);
        assert!(ended.stderr.contains(told), "{arguments}: {}", ended.stderr);
    };
    refused(
        "run tank.toml --journal /dev/full",
        "cannot write the journal /dev/full: No space left",
    );
    refused("run tank.toml --journal no/where.jsonl", "No such file or directory");
    refused("run tank.toml --journal tank.toml", "would overwrite what is read");
    domain.write("notes.txt", "dear diary\n");
    refused("run tank.toml --journal notes.txt", "notes.txt:1: no line of a journal");
    assert_eq!(domain.read("notes.txt"), "dear diary\n");
    domain.run("run tank.toml --cycles 2 --journal tank.jsonl").expect_code(0);
    let simulate = "simulate tank.toml --cycles 9 --journal";
    refused(&format!("{simulate} none.jsonl"), "cannot read the journal none.jsonl");
    refused(&format!("{simulate} tank.jsonl --run 2"), "has no run 2; its runs are 1 to 1");
    refused("simulate tank.toml --cycles 9 --run 1", "--journal");
    domain.write("tank.toml", &TANK.replace("35.5", "36").replace("10.0", "11.0"));
    refused(&format!("{simulate} tank.jsonl"), "tank.jsonl:1: run 1 is of another configuration");
    let recorded = domain.run(&format!("{simulate} tank.jsonl --recorded")).expect_code(0);
    domain.write("tank.toml", TANK);
    let again = domain.run(&format!("{simulate} tank.jsonl")).expect_code(0);
    assert_eq!(recorded.stdout, again.stdout, "the journal keeps what the node was started with");
    let without = domain.read("tank.jsonl").replace("configuration", "note");
    domain.write("old.jsonl", &without);
    refused(
        &format!("{simulate} old.jsonl --recorded"),
        "does not keep the configuration of run 1",
    );
}

#[test]
fn missed_cycles_are_skipped_and_rows_of_inputs_are_for_the_cycles_that_they_name() {
    let domain = Domain::new();
    domain.write("tank.toml", TANK);
    domain.run("run tank.toml --cycles 2 --journal tank.jsonl").expect_code(0);
    let header = domain.read("tank.jsonl").lines().next().unwrap().to_owned();
    let missed = r#"{"missed":{"task":"fast","first":2,"last":3}}"#;
    domain.write("tank.jsonl", &format!("{header}\n{missed}\n"));
    domain.write("inputs.csv", "cycle,level\n0,1.0\n1,2.0\n4,5.0\n6,7.0\n");
    let simulated = simulate(&domain, "").expect_code(0);
    let note = &simulated.stderr;
    assert!(note.contains("0 changes, 2 missed cycles"), "{note}");
    assert!(
        note.contains("have no row for 1 cycle, which read the row before; the first: 5"),
        "{note}"
    );
    let simulated = rows(&domain.read("simulated.csv"));
    let mut cycles: Vec<_> = simulated.keys().copied().collect();
    cycles.sort_unstable();
    assert_eq!(cycles, [0, 1, 4, 5, 6]);
    let levels = [0, 1, 4, 5, 6].map(|cycle| simulated[&cycle]["level"].as_str());
    assert_eq!(levels, ["1.0", "2.0", "5.0", "5.0", "7.0"]);
    domain.write("inputs.csv", "cycle,level\n1,1.0\n0,2.0\n");
    let refused = simulate(&domain, "").expect_code(2).stderr;
    assert!(refused.contains("inputs.csv:3: column \"cycle\""), "{refused}");
}
