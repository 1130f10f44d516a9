//! The node as a service: what it tells a service manager, which here is the test, and the unit.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use isochrone_testing::plants::SAW;
use isochrone_testing::{Domain, PATIENCE, Process, not_tested, wait_until};
use rustix::process::Signal;

/// A task beside that of the saw.
fn with_task(period: &str, phase: &str) -> String {
    format!("{SAW}\n[[task]]\nname = \"slow\"\nperiod = \"{period}\"\nphase = \"{phase}\"\n")
}

/// The watchdog is fed every 50 ms.
const WATCHDOG_US: &str = "100000";

/// The service manager.
struct Manager {
    socket: UnixDatagram,
    name: String,
}

impl Manager {
    fn new(domain: &Domain) -> Self {
        let path = domain.path("notify");
        Self { socket: UnixDatagram::bind(&path).unwrap(), name: path.display().to_string() }
    }

    /// The program with this manager and its watchdog.
    fn command(&self, domain: &Domain, arguments: &str) -> Command {
        let mut command = command(domain, arguments);
        command.env("NOTIFY_SOCKET", &self.name).env("WATCHDOG_USEC", WATCHDOG_US);
        command
    }

    fn start(&self, domain: &Domain) -> Process {
        Process::start(self.command(domain, "run node.toml")).ends_in_order()
    }

    /// The next message, if one comes in time.
    fn next(&self, time: Duration) -> Option<String> {
        let mut buffer = [0; 4096];
        self.socket.set_read_timeout(Some(time)).unwrap();
        let length = self.socket.recv(&mut buffer).ok()?;
        Some(String::from_utf8(buffer[..length].to_vec()).unwrap())
    }

    /// All messages up to the first with this line.
    #[track_caller]
    fn wait_for(&self, line: &str) -> Vec<String> {
        let mut messages: Vec<String> = Vec::new();
        while messages.last().is_none_or(|message| !says(message, line)) {
            let message = self.next(PATIENCE);
            assert!(message.is_some(), "waited for {line} after {messages:?}");
            messages.extend(message);
        }
        messages
    }

    /// What has arrived by now.
    fn arrived(&self) -> Vec<String> {
        std::iter::from_fn(|| self.next(Duration::from_millis(1))).collect()
    }
}

/// The program in this domain, with no service manager.
fn command(domain: &Domain, arguments: &str) -> Command {
    let mut command = domain.command(&arguments.split_whitespace().collect::<Vec<_>>());
    for variable in ["NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"] {
        command.env_remove(variable);
    }
    command
}

fn says(message: &str, line: &str) -> bool {
    message.lines().any(|said| said == line)
}

fn domain(node: &str) -> Domain {
    Domain::with(&[("node.toml", node)])
}

/// A node with a manager.
fn managed(node: &str) -> (Domain, Manager, Process) {
    let domain = domain(node);
    let manager = Manager::new(&domain);
    let node = manager.start(&domain);
    (domain, manager, node)
}

#[test]
fn a_node_tells_that_it_is_ready_how_it_fares_and_that_it_stops() {
    let (_domain, manager, node) = managed(SAW);
    let ready = manager.wait_for("READY=1").pop().unwrap();
    let status = ready.lines().find(|line| line.starts_with("STATUS=")).unwrap();
    assert!(status.contains(" cycle") && status.ends_with(" missed"), "{status}");
    manager.wait_for("WATCHDOG=1");
    node.stop().expect_code(0);
    let messages = manager.wait_for("STOPPING=1");
    assert!(!messages.iter().any(|message| says(message, "READY=1")), "only once: {messages:?}");
    assert_eq!(manager.arrived(), Vec::<String>::new(), "nothing after the end");
}

#[test]
fn a_node_that_ends_by_itself_was_ready_and_tells_that_it_stops() {
    let domain = domain(SAW);
    let manager = Manager::new(&domain);
    Process::start(manager.command(&domain, "run node.toml --cycles 1")).finish().expect_code(0);
    manager.wait_for("READY=1");
    manager.wait_for("STOPPING=1");
}

#[test]
fn readiness_waits_for_the_first_cycle_of_the_last_task_and_asks_for_the_time() {
    let since = Instant::now();
    let (_domain, manager, _node) = managed(&with_task("4s", "3s"));
    let messages = manager.wait_for("READY=1");
    assert!(since.elapsed() >= Duration::from_secs(3), "ready after {:?}", since.elapsed());
    // A node asks for no time while a task of it hangs, as it may on a busy machine.
    let asks = |message: &String| says(message, "EXTEND_TIMEOUT_USEC=10000000");
    assert!(messages.iter().any(asks), "{messages:?}");
    assert!(messages[0].contains("first cycles to come: "), "{messages:?}");
}

#[test]
fn a_node_that_does_not_come_to_run_is_never_ready() {
    let refused = SAW.replacen("period", "cpu = 1000\nperiod", 1);
    let domain = domain(&refused);
    let manager = Manager::new(&domain);
    Process::start(manager.command(&domain, "run node.toml --strict")).finish().expect_code(1);
    assert_eq!(manager.arrived(), Vec::<String>::new());
}

#[test]
fn the_watchdog_starves_while_the_process_is_halted_and_is_fed_when_it_goes_on() {
    let (_domain, manager, node) = managed(SAW);
    manager.wait_for("READY=1");
    manager.wait_for("WATCHDOG=1");
    node.signal(Signal::STOP);
    let stat = PathBuf::from(format!("/proc/{}/stat", node.id()));
    wait_until("it is halted", || std::fs::read_to_string(&stat).unwrap().contains(") T "));
    manager.arrived();
    assert_eq!(manager.next(Duration::from_millis(500)), None);
    node.signal(Signal::CONT);
    manager.wait_for("WATCHDOG=1");
    manager.wait_for("WATCHDOG=1");
}

#[test]
fn a_task_with_a_period_of_an_hour_does_not_starve_the_watchdog() {
    let (_domain, manager, _node) = managed(&with_task("1h", "0s"));
    manager.wait_for("READY=1");
    for _ in 0..10 {
        manager.wait_for("WATCHDOG=1");
    }
}

#[test]
fn the_watchdog_is_only_fed_by_the_process_that_it_is_for() {
    let domain = domain(SAW);
    let manager = Manager::new(&domain);
    // The shell's process becomes the node's.
    for (script, is_fed) in [
        ("export WATCHDOG_PID=$$; exec \"$0\" \"$@\"", true),
        ("export WATCHDOG_PID=1; exec \"$0\" \"$@\"", false),
        ("unset WATCHDOG_USEC; exec \"$0\" \"$@\"", false),
    ] {
        // One that is fed is so for as long as it runs; the others have a second.
        let cycles: &[_] = if is_fed { &[] } else { &["--cycles", "500"] };
        let run = [&["run", "node.toml"], cycles].concat();
        let mut shell = domain.command_by(&["sh", "-c", script], &run);
        shell.env("WATCHDOG_USEC", WATCHDOG_US).env("NOTIFY_SOCKET", &manager.name);
        let node = Process::start(shell);
        if is_fed {
            manager.wait_for("WATCHDOG=1");
            node.stop().expect_code(0);
            manager.wait_for("STOPPING=1");
            continue;
        }
        let messages = manager.wait_for("STOPPING=1");
        node.finish().expect_code(0);
        let is_fed = messages.iter().any(|message| says(message, "WATCHDOG=1"));
        assert!(!is_fed, "{script}: {messages:?}");
    }
}

#[test]
fn a_manager_may_listen_in_the_abstract_namespace() {
    let domain = domain(SAW);
    let name = format!("isochrone-test-{}", std::process::id());
    let address = SocketAddr::from_abstract_name(&name).unwrap();
    let socket = UnixDatagram::bind_addr(&address).unwrap();
    let manager = Manager { socket, name: format!("@{name}") };
    let _node = manager.start(&domain);
    manager.wait_for("READY=1");
}

#[test]
fn a_manager_that_does_not_listen_holds_nothing_up() {
    let domain = domain(SAW);
    let manager = Manager::new(&domain);
    let mut command = manager.command(&domain, "run node.toml --cycles 1000");
    // Fed at every look: the socket is soon full.
    command.env("WATCHDOG_USEC", "1000");
    let ended = Process::start(command).finish().expect_code(0);
    assert!(!ended.stderr.contains("warning"), "{}", ended.stderr);
    let messages = manager.arrived();
    assert!(messages.iter().any(|message| says(message, "READY=1")), "{messages:?}");
    assert!(messages.len() < 100, "the socket was full");
}

#[test]
fn without_a_manager_a_node_runs_and_says_nothing_of_it() {
    let domain = domain(SAW);
    for socket in [None, Some("")] {
        let mut command = command(&domain, "run node.toml --cycles 50");
        command.envs(socket.map(|name| ("NOTIFY_SOCKET", name)));
        let ended = Process::start(command).finish().expect_code(0);
        assert!(!ended.stderr.contains("warning"), "{}", ended.stderr);
    }
}

#[test]
fn a_manager_that_is_not_there_is_one_warning_and_no_failure() {
    let domain = domain(SAW);
    for socket in ["/no/where/notify", "vsock:2:1", "relative"] {
        let mut command = command(&domain, "run node.toml --strict --cycles 150");
        command.env("NOTIFY_SOCKET", socket).env("WATCHDOG_USEC", WATCHDOG_US);
        let said = [socket, "service manager", "remedy"];
        let ended = Process::start(command).finish().expect_code(0).says(&said);
        assert_eq!(ended.stderr.matches("warning").count(), 1, "{}", ended.stderr);
    }
}

fn packaged(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging").join(name);
    std::fs::read_to_string(path).unwrap()
}

const UNIT: &str = "isochrone@.service";
const PROGRAM: &str = "/usr/bin/isochrone";

/// The value of a key of the unit.
fn unit_value(key: &str) -> String {
    let unit = packaged(UNIT);
    let value = unit.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='));
    value.expect(key).to_owned()
}

#[test]
fn the_command_of_the_unit_runs_a_node_that_becomes_ready() {
    let domain = domain(SAW);
    let manager = Manager::new(&domain);
    let line = unit_value("ExecStart")
        .replace(PROGRAM, env!("CARGO_BIN_EXE_isochrone"))
        .replace("/etc/isochrone/iceoryx2.toml", &domain.config_file().display().to_string())
        .replace("%S/isochrone/%i/%i.jsonl", &domain.path("node.jsonl").display().to_string())
        .replace("/etc/isochrone/%i.toml", &domain.path("node.toml").display().to_string());
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut command = Command::new(words[0]);
    command.args(&words[1..]).current_dir("/").env("NOTIFY_SOCKET", &manager.name);
    let _node = Process::start(command).ends_in_order();
    manager.wait_for("READY=1");
    assert!(domain.read("node.jsonl").contains("\"run\""));
}

#[test]
fn the_folder_of_the_journal_is_the_state_directory_of_the_unit() {
    let folder = format!("%S/{}/", unit_value("StateDirectory"));
    assert!(unit_value("ExecStart").contains(&folder), "{folder}");
}

#[test]
fn the_packaged_domain_lives_in_the_runtime_directory_of_the_unit() {
    let domain = Domain::new();
    let file = domain.write("packaged.toml", packaged("iceoryx2.toml"));
    let packaged = isochrone_ipc::Domain::from_file(&file).unwrap();
    // iceoryx2 ignores keys that it does not know, so what it read is looked at.
    let root = format!("/run/{}/iceoryx2", unit_value("RuntimeDirectory"));
    assert_eq!(packaged.root_path(), Path::new(&root));
    assert_eq!(packaged.prefix(), "isochrone_");
}

#[test]
fn systemd_finds_nothing_wrong_with_the_unit() {
    let domain = Domain::new();
    let unit = packaged(UNIT).replace(PROGRAM, env!("CARGO_BIN_EXE_isochrone"));
    let file = domain.write(UNIT, &unit);
    let verified = Command::new("systemd-analyze").args(["verify", "--man=no"]).arg(file).output();
    let Ok(verified) = verified else {
        return not_tested("the unit", "systemd-analyze is not installed");
    };
    let said = String::from_utf8(verified.stderr).unwrap();
    let is_newer =
        |line: &&str| line.contains("'RestartSteps'") || line.contains("'RestartMaxDelaySec'");
    let wrong: Vec<&str> = said.lines().filter(|line| !is_newer(line)).collect();
    assert_eq!(wrong, Vec::<&str>::new());
    assert!(verified.status.success(), "{said}");
}
