//! Several nodes on one machine: which tasks share a CPU and meet on the grid.

use isochrone_testing::{Domain, Ended};
use rustix::process::Signal;
use serde_json::Value;

/// The first CPU that this process may use.
fn allowed_cpu() -> u32 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
    list.trim().split([',', '-']).next().unwrap().parse().unwrap()
}

/// A node that watches the clock for 100 us before each of its releases.
fn node(name: &str, phase: &str, cpu: u32) -> String {
    format!(
        "[node]\nname = \"{name}\"\n[[task]]\nname = \"t\"\nperiod = \"10ms\"\nphase = \"{phase}\"\n\
         cpu = {cpu}\nwake = \"hybrid\"\nmargin = \"100us\"\n"
    )
}

/// Starts a node for a cycle until it has been told of the one that runs, which may take long to answer on
/// a busy machine.
fn run_beside(domain: &Domain, file: &str, is_told: impl Fn(&Ended) -> bool) -> Ended {
    let mut ended = (0..20).map(|_| domain.run(&format!("run {file} --cycles 1")));
    ended.find(is_told).unwrap()
}

fn meetings(domain: &Domain) -> Vec<Value> {
    let listed = domain.answer("list --json");
    listed["meetings"].as_array().unwrap().clone()
}

#[test]
fn whoever_starts_a_node_that_meets_another_on_its_cpu_is_warned_with_the_remedy() {
    let domain = Domain::new();
    let cpu = allowed_cpu();
    domain.write("b.toml", node("b", "0ms", cpu));
    domain.write("clear.toml", node("clear", "5ms", cpu));
    let _first = domain.start_node("a.toml", &node("a", "0ms", cpu), "");

    let said = format!("warning: b.t and a.t share CPU {cpu} and meet at each release of b.t");
    let _ended = run_beside(&domain, "b.toml", |ended| ended.stderr.contains(&said))
        .expect_code(0)
        .says(&["remedy: give b.t phase = \"auto\""]);
    let clear = domain.run("run clear.toml --cycles 1").expect_code(0);
    assert!(!clear.stderr.contains("share CPU"), "{}", clear.stderr);
    let report = run_beside(&domain, "b.toml --json", |ended| ended.stdout.contains("shared_cpu"));
    let report = report.json();
    assert_eq!(report["warnings"].as_array().unwrap().last().unwrap()["code"], "shared_cpu");
    assert!(
        run_beside(&domain, "b.toml --strict", |ended| !ended.status.success())
            .stderr
            .contains("share CPU")
    );
}

#[test]
fn an_automatic_phase_keeps_clear_of_the_node_that_runs_and_says_so() {
    let domain = Domain::new();
    let cpu = allowed_cpu();
    domain.write("auto.toml", node("auto", "auto", cpu));
    let _first = domain.start_node("a.toml", &node("a", "0ms", cpu), "");

    let said = format!("clear of a.t on CPU {cpu} and of the kernel's ticks");
    let is_told = |ended: &Ended| ended.stderr.contains(&said);
    let ended = run_beside(&domain, "auto.toml --json", is_told).expect_code(0);
    assert!(!ended.stderr.contains("share CPU"), "{}", ended.stderr);
    let report = ended.json();
    let task = &report["tasks"][0];
    assert!(task["phase_reason"].as_str().unwrap().contains(&said), "{task}");
    assert!((1..10_000_000).contains(&task["phase_ns"].as_u64().unwrap()), "{task}");

    // One that is not answered in time keeps the phase between the ticks: then start it again.
    let mut is_listed = false;
    for _ in 0..20 {
        let second = domain.start_until("run auto.toml", "is running");
        is_listed = (0..5).any(|_| domain.run("list").stdout.contains(&said));
        second.stop().expect_code(0);
        if is_listed {
            break;
        }
    }
    assert!(is_listed);
}

#[test]
fn the_list_has_the_tasks_that_meet_and_no_others() {
    let domain = Domain::new();
    let cpu = allowed_cpu();
    // All at once: each joins while the others do.
    let mut nodes = [("a", "0ms"), ("b", "0ms"), ("c", "5ms")].map(|(name, phase)| {
        domain.write(&format!("{name}.toml"), node(name, phase, cpu));
        domain.start(&format!("run {name}.toml"))
    });
    nodes.iter_mut().for_each(|node| node.wait_for("is running"));

    let found = (0..20).map(|_| meetings(&domain)).find(|found| !found.is_empty()).unwrap();
    let [meeting] = &found[..] else { panic!("{found:?}") };
    assert_eq!(meeting["cpu"], cpu);
    assert_eq!(meeting["first"], serde_json::json!({"node": "a", "task": "t"}));
    assert_eq!(meeting["second"], serde_json::json!({"node": "b", "task": "t"}));
    assert_eq!(meeting["apart_ns"], 0);
    assert!(meeting["overlap_ns"].as_u64() >= Some(100_000), "{meeting}");
    let is_whole = |text: &String| text.contains("share CPU");
    let text = (0..20).map(|_| domain.run("list").stdout).find(is_whole).unwrap();
    assert!(
        text.contains(&format!("a.t and b.t share CPU {cpu} and meet at each release")),
        "{text}"
    );
    assert!(text.contains("phase 5 ms"), "{text}");
}

#[test]
fn whoever_starts_a_task_that_would_keep_its_source_from_sending_is_warned() {
    let domain = Domain::new();
    let cpu = allowed_cpu();
    let block = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\nin = { incrementRange = 1 }\n\
                 [[output]]\nservice = \"plant/saw\"\nsignals = [\"saw.value\"]\n";
    let follow = "priority = 5\nfollow = { service = \"plant/saw\", within = \"1ms\" }\n\
                  [[input]]\nname = \"saw\"\ntype = \"INT\"\nservice = \"plant/saw\"\nsignal = \"saw.value\"\n\
                  [[output]]\nservice = \"plant/after\"\nsignals = [\"saw\"]\n";
    domain.write("follower.toml", &(node("follower", "0ms", cpu) + follow));
    let _source = domain.start_node("source.toml", &(node("source", "5ms", cpu) + block), "");

    let said = format!(
        "warning: follower.t (fifo:5) follows \"plant/saw\" of source.t (other) on the same CPU {cpu}"
    );
    let ended = run_beside(&domain, "follower.toml", |ended| ended.stderr.contains(&said));
    let remedy = "remedy: give source.t a higher priority than follower.t has, or another cpu";
    assert!(ended.expect_code(0).stderr.contains(remedy));
}

#[test]
fn a_node_starts_beside_nodes_that_are_stopped_and_names_each() {
    let domain = Domain::new();
    let cpu = allowed_cpu();
    let names = ["a", "b", "c"];
    let nodes =
        names.map(|name| domain.start_node(&format!("{name}.toml"), &node(name, "0ms", cpu), ""));
    domain.write("next.toml", node("next", "0ms", cpu));
    // Once they answer, they have started: none is stopped while it holds up the domain.
    let is_answered = |listed: &Ended| listed.stdout.matches("  cycle ").count() == names.len();
    assert!((0..20).any(|_| is_answered(&domain.run("list"))));
    nodes.iter().for_each(|node| node.signal(Signal::STOP));

    let ended = domain.run("run next.toml --cycles 1").expect_code(0);
    let listed = domain.run("list").expect_code(0);
    let document = domain.run("list --json").expect_code(0);
    nodes.iter().for_each(|node| node.signal(Signal::CONT));
    let document = document.json();
    for (place, (name, node)) in names.into_iter().zip(&nodes).enumerate() {
        let pid = node.id();
        let why = format!("its process {pid} is stopped: continue it (kill -CONT {pid}) or end it");
        assert!(listed.stderr.contains(&why), "{}", listed.stderr);
        let line = format!("  {name}  pid {pid}  does not answer: stopped (kill -CONT {pid})\n");
        assert!(listed.stdout.contains(&line), "{}", listed.stdout);
        assert_eq!(document["control_nodes"][place]["state"], "stopped", "{document}");
        let silent = format!("node \"{name}\" does not say which CPUs its tasks need");
        assert!(ended.stderr.contains(&silent), "{}", ended.stderr);
        let unknown = format!("what node \"{name}\" does is not known: ");
        assert!(listed.stderr.contains(&unknown), "{}", listed.stderr);
    }
}
