//! `link`: the verb around the link's program, which a script stands for here.

use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use isochrone_testing::{Domain, Ended, Process};
use rustix::process::Signal;
use serde_json::Value;

/// Keeps its arguments and what it could read, each start in a line of its own, and runs until it is ended.
const RUNS: &str = r#"
echo "$@" >> ../../arguments
cat config/iceoryx2.toml > ../../domain.read
for last; do :; done
cp "$last" ../../zenoh.read
echo $$ >> ../../pids
while :; do sleep 0.05; done
"#;

struct Script {
    domain: Domain,
    path: PathBuf,
}

impl Script {
    fn new(text: &str) -> Self {
        let domain = Domain::new();
        let path = domain.write("the-link", format!("#!/bin/sh\n{text}"));
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
        Self { domain, path }
    }

    fn start(&self, arguments: &str) -> Process {
        self.domain.start(&format!("link --link {} {arguments}", self.path.display()))
    }

    /// The processes that the script was, in their order.
    fn pids(&self) -> Vec<u32> {
        let pids = std::fs::read_to_string(self.domain.path("pids")).unwrap_or_default();
        pids.lines().filter_map(|pid| pid.parse().ok()).collect()
    }

    /// Waits until the script has been started so often.
    #[track_caller]
    fn wait_for_start(&self, verb: &mut Process, number: usize) -> u32 {
        verb.wait_until_it("has started the script", |_| self.pids().len() >= number);
        self.pids()[number - 1]
    }
}

fn runs(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

/// A port that nobody has.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[test]
fn the_link_is_started_in_this_domain_with_the_services_and_their_layouts() {
    let script = Script::new(RUNS);
    let port = free_port();
    let mut verb = script.start(&format!("--listen 127.0.0.1:{port} plant/a plant/b plant/a"));
    script.wait_for_start(&mut verb, 1);
    assert_eq!(
        script.domain.read("arguments").replace(&format!("{}", verb.id()), "PID").trim(),
        format!(
            "--reactive --poll 1 --allow plant/a --allow isochrone/layout/plant/a --allow plant/b --allow \
             isochrone/layout/plant/b --zenoh-config {}/{}isochrone.link.PID/zenoh.json5",
            script.domain.root_path().display(),
            script.domain.prefix()
        )
    );
    let read = script.domain.read("domain.read");
    for part in [script.domain.prefix(), script.domain.root_path().display().to_string()] {
        assert!(read.contains(&format!("{part:?}")), "{read}");
    }
    // Whatever is left in the domain is removed under its lock, which the script does not know.
    let cleans = |when: &str| read.contains(&format!("cleanup-dead-nodes-on-{when} = false"));
    assert!(["creation", "destruction", "open"].into_iter().all(cleans), "{read}");
    let zenoh = script.domain.json("zenoh.read");
    assert_eq!(zenoh["mode"], "peer");
    assert_eq!(zenoh["listen"]["endpoints"], serde_json::json!([format!("tcp/127.0.0.1:{port}")]));
    assert_eq!(zenoh["connect"]["endpoints"], Value::Array(Vec::new()));
    for scouting in ["multicast", "gossip"] {
        assert_eq!(zenoh["scouting"][scouting]["enabled"], false);
    }
    // The services are there, with the room of ours, for whoever reads or writes them later.
    let names = script.domain.run("list --names").expect_code(0).stdout;
    assert_eq!(names, "plant/a\nplant/b\n");
    verb.stop().expect_code(0).says(&["listens on 127.0.0.1:", "2 services (plant/a, plant/b)"]);
    assert_eq!(script.domain.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn who_connects_listens_nowhere_and_says_once_that_nobody_answers() {
    let script = Script::new(RUNS);
    let port = free_port();
    let mut verb = script.start(&format!("--connect 127.0.0.1:{port} plant/a"));
    verb.wait_for("does not answer; the link keeps trying");
    let zenoh = script.domain.json("zenoh.read");
    assert_eq!(zenoh["listen"]["endpoints"], Value::Array(Vec::new()));
    assert_eq!(zenoh["connect"]["endpoints"], serde_json::json!([format!("tcp/127.0.0.1:{port}")]));
    let ended = verb.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("does not answer").count(), 1, "{}", ended.stderr);
    assert!(ended.stderr.contains("isochrone link --listen"), "{}", ended.stderr);
}

#[test]
fn a_host_that_nobody_knows_is_told_from_one_that_does_not_answer() {
    let script = Script::new(RUNS);
    // A name that never exists, by the standards of names.
    let mut verb = script.start("--connect plant-b.invalid plant/a");
    verb.wait_for("plant-b.invalid:7447 cannot be found");
    verb.stop().expect_code(0);
}

#[test]
fn a_link_that_dies_is_started_again() {
    let script = Script::new(RUNS);
    let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
    let first = script.wait_for_start(&mut verb, 1);
    // It has run for long enough to be one that works.
    verb.wait_for("does not answer");
    kill(first);
    let second = script.wait_for_start(&mut verb, 2);
    verb.wait_for("SIGKILL");
    verb.wait_for("it is started again");
    // Also when it dies at once, from now on.
    kill(second);
    let third = script.wait_for_start(&mut verb, 3);
    let ended = verb.stop().expect_code(0);
    assert!(!runs(third), "{}", ended.stderr);
}

#[test]
fn a_service_has_one_link() {
    let script = Script::new(RUNS);
    let mut first = script.start("--connect 127.0.0.1:1 plant/a plant/b");
    script.wait_for_start(&mut first, 1);
    let ended = script.start("--connect 127.0.0.1:2 plant/c plant/b").finish().expect_code(1);
    let said = format!("process {}, carries service \"plant/b\" already", first.id());
    assert!(ended.stderr.contains(&said), "{}", ended.stderr);
    let mut other = script.start("--connect 127.0.0.1:2 plant/c");
    script.wait_for_start(&mut other, 2);
    // What one link has left, another may take.
    first.stop().expect_code(0);
    let mut next = script.start("--connect 127.0.0.1:1 plant/b");
    script.wait_for_start(&mut next, 3);
    next.stop().expect_code(0);
    other.stop().expect_code(0);
    assert_eq!(script.domain.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn a_link_that_listens_on_every_address_is_warned_of() {
    let script = Script::new(RUNS);
    for (address, is_every) in [("127.0.0.1", false), ("0.0.0.0", true), ("[::]", true)] {
        let mut verb = script.start(&format!("--listen {address}:{} plant/a", free_port()));
        verb.wait_for("Press Ctrl-C");
        let ended = verb.stop().expect_code(0);
        let is_warned = ended.stderr.contains("is every address of this machine");
        assert_eq!(is_warned, is_every, "{}", ended.stderr);
    }
}

#[test]
fn a_link_after_a_file_says_whether_it_is_connected() {
    let script = Script::new(RUNS);
    script.domain.write("tls.json5", "{}");
    let mut verb = script.start("--zenoh tls.json5 plant/a");
    verb.wait_for("no TCP connection yet");
    verb.stop().expect_code(0).says(&["tls.json5 says of addresses"]);
}

fn kill(pid: u32) {
    let pid = rustix::process::Pid::from_raw(pid.cast_signed()).unwrap();
    rustix::process::kill_process(pid, Signal::KILL).unwrap();
}

#[test]
fn a_link_ends_with_its_verb_also_when_that_is_killed_and_the_next_removes_what_it_left() {
    let script = Script::new(RUNS);
    let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
    let pid = script.wait_for_start(&mut verb, 1);
    verb.kill();
    let mut next = script.start("--connect 127.0.0.1:1 plant/a");
    script.wait_for_start(&mut next, 2);
    next.wait_until_it("outlives the first script", |_| !runs(pid));
    next.stop().expect_code(0);
    assert_eq!(script.domain.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn a_link_that_ends_at_once_is_no_link_and_its_words_are_shown() {
    let script = Script::new("echo 'no room for a session'; exit 3");
    let ended = given_up(&script);
    for part in [
        "ended as soon as it was started (exit status: 3)",
        "link over zenoh 0.10.0; it said:\n",
        "no room for a session",
    ] {
        assert!(ended.stderr.contains(part), "{}", ended.stderr);
    }
    let broken = Script::new("");
    std::fs::write(&broken.path, "#!/no/such/shell\n").unwrap();
    assert!(given_up(&broken).stderr.contains("cannot run"));
}

/// A verb that gives its program up. On a busy machine a start may take so long that the program seems to work;
/// then it is started for ever.
fn given_up(script: &Script) -> Ended {
    let try_once = |_| {
        let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
        verb.wait_until("that it gives up or starts a fifth time", |_, stderr| {
            stderr.contains("4 times in a row") || stderr.matches("it is started again").count() > 3
        });
        let is_given_up = verb.ended_within(Duration::from_secs(1));
        is_given_up.filter(|ended| ended.status.code() == Some(1))
    };
    (0..10).find_map(try_once).unwrap()
}

#[test]
fn a_link_that_fails_at_first_is_tried_again() {
    let script = Script::new(&format!(
        "echo x >> ../../tries\n[ $(wc -l < ../../tries) -gt 2 ] || exit 1\n{RUNS}"
    ));
    let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
    script.wait_for_start(&mut verb, 1);
    let ended = verb.stop().expect_code(0);
    assert_eq!(ended.stderr.matches("it is started again").count(), 2, "{}", ended.stderr);
}

#[test]
fn a_link_whose_own_file_was_removed_starts_its_program_again() {
    let script = Script::new(RUNS);
    let own = script.domain.copy_program();
    let mut command = Command::new(&own);
    command.args(["link", "--connect", "127.0.0.1:1", "plant/a", "--link"]).arg(&script.path);
    command.env("ICEORYX2_CONFIG", script.domain.config_file());
    let mut verb = Process::start(command);
    let first = script.wait_for_start(&mut verb, 1);
    std::fs::remove_file(&own).unwrap();
    kill(first);
    script.wait_for_start(&mut verb, 2);
}

#[test]
fn a_link_that_cannot_be_started_for_a_while_is_started_later() {
    let script = Script::new(RUNS);
    let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
    let first = script.wait_for_start(&mut verb, 1);
    verb.wait_for("does not answer");
    let folder = format!("{}isochrone.link.{}", script.domain.prefix(), verb.id());
    let config = script.domain.root_path().join(folder).join("config");
    std::fs::remove_dir_all(&config).unwrap();
    std::fs::write(&config, "").unwrap();
    kill(first);
    verb.wait_for("cannot write to");
    std::fs::remove_file(&config).unwrap();
    script.wait_for_start(&mut verb, 2);
}

#[test]
fn a_folder_that_another_user_may_have_laid_for_the_link_is_refused() {
    let script = Script::new(RUNS);
    let elsewhere = script.domain.path("elsewhere");
    std::fs::create_dir(&elsewhere).unwrap();
    let stem = format!("{}isochrone.link.", script.domain.prefix());
    let stem = script.domain.root_path().join(stem);
    let lays = "mkdir -p \"${1%/*}\"; ln -s \"$0\" \"$1$$\"; shift; exec \"$@\"";
    let paths = [&elsewhere, &stem].map(|path| path.to_str().unwrap());
    let link = format!("link --connect 127.0.0.1:1 plant/a --link {}", script.path.display());
    let link = script.domain.start_by(&[&["sh", "-c", lays], &paths[..]].concat(), &link);
    link.finish().expect_code(1).says(&["is not a folder of this user"]);
    assert_eq!(std::fs::read_dir(&elsewhere).unwrap().count(), 0);
    assert_eq!(script.pids(), Vec::<u32>::new());
}

#[test]
fn frames_that_the_link_drops_are_counted() {
    let dropped = r#"for i in 1 2 3; do
        echo "$i [W] \"inbox::Inbox::push\""
        echo "| An arrival was dropped, the inbox is full"
    done
    echo "| The tunnel has a cold"
    while :; do sleep 0.05; done"#;
    let script = Script::new(dropped);
    let mut verb = script.start("--connect 127.0.0.1:1 plant/a");
    verb.wait_for("the link says: The tunnel has a cold");
    let ended = verb.stop().expect_code(0);
    // On a busy machine it may look before all three are there.
    let told = ended.stderr.split("the link dropped ").skip(1);
    let dropped = told.map(|told| told.split(' ').next().unwrap().parse::<u64>().unwrap());
    assert_eq!(dropped.sum::<u64>(), 3, "{}", ended.stderr);
    assert_eq!(ended.stderr.matches("inbox").count(), 0, "{}", ended.stderr);
}

#[test]
fn a_link_that_is_not_installed_says_how_to_install_it() {
    let domain = Domain::new();
    let mut command = domain.command(&["link", "--connect", "plant-b", "plant/a"]);
    Process::start(command.env("PATH", "/no/such/folder")).finish().expect_code(2).says(&[
        "iox2-link-tunnel-zenoh, is not installed",
        "cargo install iceoryx2-integrations-zenoh-link-tunnel-cli@0.10.0 --locked",
        "--link",
    ]);
    domain.expect(
        "link --link no-such-program --connect plant-b plant/a",
        2,
        &["no-such-program is no program"],
    );
}

#[test]
fn what_cannot_be_meant_is_refused_with_the_way_out() {
    let script = Script::new(RUNS);
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = format!("--listen {} plant/a", taken.local_addr().unwrap());
    for (arguments, part) in [
        ("--connect plant-b", "<SERVICE>"),
        ("plant/a", "--listen"),
        ("--listen 10.0.0.1 --connect plant-b plant/a", "cannot be used with"),
        ("--connect plant-b plant/*", "has a wildcard"),
        ("--connect plant-b isochrone/layout/plant/a", "isochrone/layout/"),
        ("--connect plant-b isochrone/tank/control", "ssh HOST isochrone top tank"),
        ("--connect tcp/10.0.0.1 plant/a", "name a host"),
        ("--connect plant-b:99999 plant/a", "ports are 1 to 65535"),
        ("--connect 0.0.0.0 plant/a", "name the one to connect to"),
        ("--listen plant-a plant/a", "an IP address of this machine"),
        ("--listen 203.0.113.7 plant/a", "no such address"),
        (&taken, "another program listens there"),
        ("--zenoh no-such-file plant/a", "cannot read no-such-file"),
        ("--connect plant-b --poll 0 plant/a", "1..=100"),
    ] {
        script.start(arguments).finish().expect_code(2).says(&[part]);
    }
    assert_eq!(script.pids(), Vec::<u32>::new());
}
