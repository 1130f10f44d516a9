//! A program with a block that panics, and one that hangs: what its verbs say, and what they still
//! write.

use std::process::{Command, ExitCode};

use isochrone_blocks::{Block, BlockType, Cycle};
use isochrone_testing::{Domain, Ended, Process};
use rustix::process::Signal;

isochrone_blocks::block! {
    /// Panics in its 50th cycle, or never ends it.
    Faulty {
        inputs {
            /// What it passes on.
            "x" => x: f64 = 0.0,
            /// Whether it hangs instead.
            "hangs" => hangs: bool = false,
        }
        outputs {
            /// The same.
            "y" => y: f64,
        }
        state { unused: f64 }
        status {}
    }
}

impl Block for Faulty {
    fn step(_: &mut State, inputs: &Inputs, cycle: &Cycle<'_>) -> Outputs {
        if inputs.hangs && cycle.index() >= 50 {
            eprintln!("it hangs");
            std::thread::sleep(std::time::Duration::MAX);
        }
        assert!(cycle.index() < 50, "fifty is too much");
        Outputs { y: inputs.x }
    }
}

const NODE: &str = r#"
[node]
name = "faulty"
[[task]]
name = "good"
period = "1ms"
[[task]]
name = "bad"
period = "2ms"
[[block]]
name = "saw"
type = "SawTooth"
task = "good"
in = { incrementRange = 1, numberSteps = 30000 }
[[block]]
name = "level"
type = "Faulty"
task = "bad"
[[output]]
task = "bad"
service = "faulty/out"
signals = ["level.y"]
"#;

/// Says that this program is to be the command line with the block.
const AS_PROGRAM: &str = "ISOCHRONE_TEST_PROGRAM";

/// This file has no test harness: the program whose verbs are tested must be this one, as only it has
/// the block.
fn main() -> ExitCode {
    if std::env::var_os(AS_PROGRAM).is_some() {
        return isochrone_cli::main(&[BlockType::of::<Faulty>()]);
    }
    let tests: [(&str, fn()); 4] = [
        (
            "a_run_whose_block_panics_reports_what_was_measured_and_names_the_block",
            a_run_whose_block_panics_reports_what_was_measured_and_names_the_block,
        ),
        (
            "a_simulation_whose_block_panics_names_it_and_keeps_the_cycles_before",
            a_simulation_whose_block_panics_names_it_and_keeps_the_cycles_before,
        ),
        (
            "a_bench_whose_block_panics_names_the_arm_and_the_place",
            a_bench_whose_block_panics_names_the_arm_and_the_place,
        ),
        (
            "a_node_whose_block_hangs_says_which_task_it_waits_for_and_ends_on_another_signal",
            a_node_whose_block_hangs_says_which_task_it_waits_for_and_ends_on_another_signal,
        ),
    ];
    for (name, test) in tests {
        test();
        println!("test {name} ... ok");
    }
    ExitCode::SUCCESS
}

fn command(domain: &Domain, arguments: &str) -> Command {
    domain.write("node.toml", NODE);
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(arguments.split_whitespace()).current_dir(domain.path(""));
    command.env(AS_PROGRAM, "1").env("ICEORYX2_CONFIG", domain.config_file());
    command
}

fn run(domain: &Domain, arguments: &str) -> Ended {
    Process::start(command(domain, arguments)).finish()
}

const SENTENCE: &str = "task \"bad\" panicked in block \"level\" (Faulty) at ";

#[track_caller]
fn assert_names_the_block_once(stderr: &str) {
    assert_eq!(stderr.matches(SENTENCE).count(), 1, "{stderr}");
    assert!(stderr.contains("fifty is too much") && stderr.contains("panics.rs:"), "{stderr}");
    assert!(!stderr.contains("thread '"), "{stderr}");
}

fn a_run_whose_block_panics_reports_what_was_measured_and_names_the_block() {
    let domain = Domain::new();
    domain.write("old.json", "{}");
    let ended = run(&domain, "run node.toml --report old.json --json").expect_code(1);
    assert_names_the_block_once(&ended.stderr);
    let report = domain.json("old.json");
    assert_eq!(ended.json(), report);
    let warning = &report["warnings"].as_array().unwrap().last().unwrap();
    assert_eq!(warning["code"], "panicked", "{report}");
    assert!(warning["message"].as_str().unwrap().starts_with(SENTENCE), "{report}");
    let [good, bad] = report["tasks"].as_array().unwrap().as_slice() else { panic!("{report}") };
    assert_eq!((&good["name"], &bad["name"]), (&"good".into(), &"bad".into()));
    assert!(good["cycles"].as_u64() > Some(0), "{report}");
    // It panicked in the cycle of index 50, or in the next one that was not missed.
    assert!((1..=50).contains(&bad["cycles"].as_u64().unwrap()), "{report}");
    assert!(bad["allocations"].is_null(), "a panic allocates: {report}");
    assert!(report["links"][0]["frames"].as_u64() > Some(0), "{report}");
}

fn a_simulation_whose_block_panics_names_it_and_keeps_the_cycles_before() {
    let domain = Domain::new();
    let ended = run(&domain, "simulate node.toml --cycles 200 --output out.csv").expect_code(1);
    assert_names_the_block_once(&ended.stderr);
    // Cycle 50 of the task of 2 ms is due with cycle 100 of the rows' task, which runs before it.
    assert_eq!(domain.read("out.csv").lines().count(), 1 + 101);
}

fn a_bench_whose_block_panics_names_the_arm_and_the_place() {
    let domain = Domain::new();
    let ended = run(&domain, "bench engine --arms Faulty --instances 1 --seconds 0.1");
    let ended =
        ended.expect_code(1).says(&["panics.rs:", "fifty is too much", "leave the arm out"]);
    let says = "arm \"Faulty\": a block panicked at ";
    assert_eq!(ended.stderr.matches(says).count(), 1, "{}", ended.stderr);
    assert!(!ended.stderr.contains("thread '"), "{}", ended.stderr);
}

fn a_node_whose_block_hangs_says_which_task_it_waits_for_and_ends_on_another_signal() {
    let domain = Domain::new();
    let command = command(&domain, "run node.toml");
    domain.write(
        "node.toml",
        NODE.replace("type = \"Faulty\"", "type = \"Faulty\"\nin = { hangs = true }"),
    );
    let mut node = Process::start(command);
    node.wait_for("it hangs");
    node.signal(Signal::TERM);
    node.wait_for("node \"faulty\" waits for task \"bad\" to end its cycle");
    node.signal(Signal::INT);
    let ended = node.finish().expect_code(1);
    assert!(ended.stderr.contains("Another signal (Ctrl-C) ends the program"), "{}", ended.stderr);
    assert!(ended.stderr.contains("ended at once by another signal"), "{}", ended.stderr);
}
