//! The journal of a node in a file: nodes that are killed, disks that are full, files that others rename.

use isochrone_control::{Client, ClientError, Code, JournalParams, SetParams, SetResult};
use isochrone_ipc::{Participant, ipc};
use isochrone_testing::{Domain, PATIENCE, Plant, Process, wait_for_some, wait_until};
use rustix::process::Resource;
use serde_json::Value;

fn tank() -> Plant {
    Plant::new("tank")
        .with("control = \"force\"")
        .task("fast", "5ms")
        .input("level", "tank/level", "default = -1.0")
        .ramp("ramp", "value = \"level\", setChangeRate = 10.0")
}

fn operate(domain: &Domain, arguments: &str) {
    domain.run(arguments).expect_code(0);
}

/// Sets another rate each time.
struct Operator {
    client: Client<ipc::Service>,
    _participant: Participant<ipc::Service>,
    rate: f64,
}

impl Operator {
    fn of(domain: &Domain) -> Self {
        let participant = domain.join("operator");
        let client = Client::connect(&participant, "tank", PATIENCE).unwrap();
        Self { client, _participant: participant, rate: 0.0 }
    }

    fn set(&mut self) -> Result<SetResult, ClientError> {
        self.rate += 1.0;
        let values = [("ramp.setChangeRate", self.rate)].into_iter().collect();
        self.client.call(&SetParams { values, ..SetParams::default() })
    }
}

/// The runs in a file, as `journal` prints them.
fn runs(domain: &Domain, file: &str) -> Vec<Value> {
    let printed = domain.stdout(&format!("journal {file} --json"));
    serde_json::from_str(&printed).unwrap()
}

/// The transactions of a run.
fn transactions(run: &Value) -> Vec<u64> {
    let entries = run["entries"].as_array().unwrap().iter();
    entries.map(|entry| entry["transaction"].as_u64().unwrap()).collect()
}

#[test]
fn a_node_that_is_killed_loses_nothing_that_it_acknowledged() {
    let domain = Domain::new();
    let mut numbers = Vec::new();
    for run in 1..=2 {
        let node = domain.start_node("tank.toml", &tank(), "--journal tank.jsonl");
        let mut operator = Operator::of(&domain);
        for _ in 0..20 {
            numbers.push((run, operator.set().unwrap().transaction));
        }
        node.kill();
    }
    assert!(numbers.is_sorted_by(|a, b| a.1 < b.1), "{numbers:?}");
    let runs = runs(&domain, "tank.jsonl");
    let of_run = |run: &Value| {
        let number = run["run"]["run"].as_u64().unwrap();
        transactions(run).into_iter().map(move |transaction| (number, transaction))
    };
    assert_eq!(runs.iter().flat_map(of_run).collect::<Vec<_>>(), numbers);
}

#[test]
fn a_full_file_is_kept_beside_the_next_one_and_one_that_was_renamed_is_followed_by_another() {
    let domain = Domain::with(&[("tank.toml", &tank())]);
    domain.run("run tank.toml --cycles 2 --journal tank.jsonl").expect_code(0);
    let old = domain.read("tank.jsonl");
    // What a year of changes leaves.
    let entry = r#"{"entry":{"sequence":1,"transaction":77,"action":"set","task":"fast","cycle":1,"unix_ns":1,"changes":[]}}"#;
    let many = format!("{entry}\n").repeat((16 << 20) / entry.len());
    domain.write("tank.jsonl", format!("{old}{many}"));
    domain.write("tank.jsonl.1", "what was kept before");
    let mut node = domain.start_node("tank.toml", &tank(), "--journal tank.jsonl");
    operate(&domain, "set tank ramp.setChangeRate=2");
    assert!(domain.read("tank.jsonl.1").starts_with(&old));
    assert_eq!(domain.read("tank.jsonl.2"), "what was kept before");
    let [run] = &runs(&domain, "tank.jsonl")[..] else { panic!() };
    assert_eq!((&run["run"]["run"], transactions(run)), (&2.into(), vec![78]));
    let printed = domain.stdout("journal tank.jsonl.1");
    assert!(printed.starts_with("run 1 of node \"tank\""), "{:.200}", printed);

    std::fs::rename(domain.path("tank.jsonl"), domain.path("old.jsonl")).unwrap();
    operate(&domain, "set tank ramp.setChangeRate=3");
    node.wait_for("the journal tank.jsonl was renamed, removed or truncated");
    assert_eq!(transactions(&runs(&domain, "old.jsonl")[0]), [78]);
    assert_eq!(transactions(&runs(&domain, "tank.jsonl")[0]), [79]);
    node.stop().expect_code(0);
    assert!(domain.read("tank.jsonl").contains("{\"end\""));
}

#[test]
fn a_full_disk_costs_no_entry_and_no_older_file_while_the_file_is_followed_by_another() {
    let domain = Domain::with(&[("tank.toml", &tank())]);
    let mut node = start_limited(&domain, "");
    let mut operator = Operator::of(&domain);
    let mut set = || operator.set();
    let mut done = Vec::new();
    done.push(set().unwrap().transaction);
    // It was renamed, and the next one cannot be begun.
    std::fs::rename(domain.path("tank.jsonl"), domain.path("tank.jsonl.1")).unwrap();
    let first = domain.read("tank.jsonl.1");
    node.limit(Resource::Fsize, Some(1));
    wait_until("it is refused", || set().map(|set| done.push(set.transaction)).is_err());
    node.wait_for("cannot be written (File too large");
    assert_eq!(domain.read("tank.jsonl"), "");
    node.limit(Resource::Fsize, None);
    wait_until("it is written", || set().map(|set| done.push(set.transaction)).is_ok());
    assert_eq!(domain.read("tank.jsonl.1"), first);
    let written = || {
        let files = ["tank.jsonl.1", "tank.jsonl"];
        let runs = files.map(|file| transactions(&runs(&domain, file)[0]));
        runs.concat()
    };
    wait_until("all is written", || written() == done);

    // It is full, and the next one cannot be begun either.
    node.stop().expect_code(0);
    let text = domain.read("tank.jsonl");
    let long = format!("\"comment\":\"{}\",\"action\"", "x".repeat((16 << 20) - 2500));
    domain.write("tank.jsonl", text.replacen("\"action\"", &long, 1));
    let mut node = start_limited(&domain, "");
    let mut operator = Operator::of(&domain);
    let mut set = || operator.set();
    let length = || std::fs::metadata(domain.path("tank.jsonl")).unwrap().len();
    let header = text.lines().next().unwrap().len() as u64;
    wait_until("it is full", || set().is_ok() && length() >= (16 << 20) + header);
    let full = length();
    node.limit(Resource::Fsize, Some(1));
    wait_until("it is refused", || set().is_err());
    node.wait_for("no other can take its place (File too large");
    assert_eq!((length(), domain.read("tank.jsonl.1")), (full, first.clone()));
    assert!(!domain.path("tank.jsonl.new").exists() && !domain.path("tank.jsonl.2").exists());
    node.limit(Resource::Fsize, None);
    wait_until("it is written", || set().is_ok());
    assert!(length() > full, "it grows on");
    node.stop().expect_code(0);
    assert_eq!(domain.read("tank.jsonl.1"), first);
}

/// Starts a node with a journal. A file that becomes too long is an error for it, and no signal.
fn start_limited(domain: &Domain, more: &str) -> Process {
    let ignoring = ["sh", "-c", "trap '' XFSZ; exec \"$0\" \"$@\""];
    let mut node =
        domain.start_by(&ignoring, &format!("run tank.toml --journal tank.jsonl {more}"));
    node.wait_for("is running");
    node
}

#[test]
fn a_journal_whose_end_cannot_be_written_is_said_to_be_incomplete() {
    let domain = Domain::with(&[("tank.toml", &tank())]);
    let node = start_limited(&domain, "--json");
    operate(&domain, "set tank ramp.setChangeRate=2");
    let length = std::fs::metadata(domain.path("tank.jsonl")).unwrap().len();
    node.limit(Resource::Fsize, Some(length));
    // Those that find out have happened, and are not in the file.
    wait_until("it is refused", || !domain.run("set tank ramp.setChangeRate=3").status.success());
    let ended = node.stop().expect_code(1);
    let told = "the journal tank.jsonl is incomplete: its end could not be written (File too large";
    assert!(ended.stderr.contains(told), "{}", ended.stderr);
    let report = ended.json();
    let codes = report["warnings"].as_array().unwrap().iter().map(|warning| &warning["code"]);
    assert_eq!(codes.filter(|code| *code == "journal_incomplete").count(), 1, "{report}");
    assert!(!domain.read("tank.jsonl").contains("{\"end\""));
    assert_eq!(transactions(&runs(&domain, "tank.jsonl")[0]).len(), 1);
}

#[test]
fn while_the_journal_cannot_be_written_changes_are_refused_and_the_node_goes_on() {
    let domain = Domain::with(&[("tank.toml", &tank())]);
    let mut node = start_limited(&domain, "");
    let mut operator = Operator::of(&domain);
    let mut set = || operator.set();
    set().unwrap();
    // It is as long already, and what the node writes meanwhile makes it no longer afterwards.
    node.limit(Resource::Fsize, Some(1));
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

    node.limit(Resource::Fsize, None);
    wait_until("it is written again", || set().is_ok());
    assert!(!domain.run("alarms tank").expect_code(0).stdout.contains("journal "));
    let done = operator.client.call(&JournalParams::default()).unwrap().entries;
    assert_eq!(node.stop().expect_code(0).stderr.matches("cannot be written").count(), 1);
    assert!(domain.read("tank.jsonl").contains("{\"end\""));
    let written = &runs(&domain, "tank.jsonl")[0]["entries"];
    assert_eq!(*written, serde_json::to_value(done).unwrap(), "what waited is written, in order");
}

#[test]
fn what_the_journal_cannot_have_yet_is_answered_with_a_warning_and_a_force_can_always_be_released()
{
    let domain = Domain::with(&[("tank.toml", &tank())]);
    let node = start_limited(&domain, "");
    operate(&domain, "force tank level=7.25 --hold");
    node.limit(Resource::Fsize, Some(1));
    let mut operator = Operator::of(&domain);
    let mut done = Vec::new();
    wait_until("it is refused", || {
        match operator.set() {
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
    domain.expect("forces tank", 0, &["nothing is forced"]);

    node.limit(Resource::Fsize, None);
    wait_until("the release is written", || {
        domain.read("tank.jsonl").contains("\"action\":\"release\"")
    });
    node.stop().expect_code(0);
    let written = transactions(&runs(&domain, "tank.jsonl")[0]);
    assert!(written.is_sorted(), "{written:?}");
    assert!(done.iter().all(|set| written.contains(&set.transaction)), "{done:?}\n{written:?}");
}

#[test]
fn a_journal_that_cannot_be_written_is_refused_with_the_way_out() {
    let domain = Domain::with(&[("tank.toml", &tank())]);
    let refused = |arguments: &str, told: &str| drop(domain.expect(arguments, 2, &[told]));
    refused(
        "run tank.toml --journal /dev/full",
        "cannot write the journal /dev/full: No space left",
    );
    refused("run tank.toml --journal no/where.jsonl", "No such file or directory");
    refused("run tank.toml --journal tank.toml", "would overwrite what is read");
    domain.write("notes.txt", "dear diary\n");
    refused("run tank.toml --journal notes.txt", "notes.txt:1: no line of a journal");
    assert_eq!(domain.read("notes.txt"), "dear diary\n");
    refused("journal none.jsonl", "cannot read the journal none.jsonl");
}
