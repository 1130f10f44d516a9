//! The program, run against real shared memory.

use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use isochrone::ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, IsolatedDomain, Participant, SignalSpec,
    Stamp,
};
use isochrone_testing::{PATIENCE, afresh};

const VERSION: &str = env!("CARGO_PKG_VERSION");
const STEP: Duration = Duration::from_millis(5);

struct Program {
    domain: IsolatedDomain,
}

impl Program {
    fn start(&self, line: &str) -> Child {
        let file = self.domain.file();
        let domain = ["run ", "list"].iter().any(|verb| line.starts_with(verb));
        afresh(&mut Command::new(env!("CARGO_BIN_EXE_own_blocks")))
            .args(line.split_whitespace())
            .args(domain.then_some("--iceoryx2-config"))
            .args(domain.then_some(file))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn run(&self, line: &str) -> String {
        printed(line, self.start(line).wait_with_output().unwrap())
    }
}

fn printed(line: &str, output: Output) -> String {
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {}: {complaint}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn a_program_with_a_block_of_its_own_has_every_verb() {
    let program = Program { domain: IsolatedDomain::new("own").unwrap() };

    let pins = program.run("blocks Pid");
    assert!(pins.contains("integralTime") && pins.contains("STATUS_LIMITED_HIGH"), "{pins}");
    assert!(program.run("check pid.toml").contains("2 blocks"));

    // The set-point has come to 0.3 m, 0.05 m above the level: 40 * (0.05 + 0.05 * 0.01 s / 2 s).
    let simulated = program.run("simulate pid.toml --cycles 6");
    let last: Vec<&str> = simulated.lines().last().unwrap().split(',').collect();
    let simulated_y: f64 = last[1].parse().unwrap();
    assert!((simulated_y - 2.01).abs() < 1e-12 && last[2] == "0.0", "{simulated}");

    let tester = Participant::join("tester", &program.domain).unwrap();
    let mut valve = FrameSubscriber::open(&tester, "plant/valve", 2, Depth::Newest).unwrap();
    let level = FrameLayout { signals: vec![SignalSpec::new("level", "LREAL")], period_ns: None };
    let mut sensor = FramePublisher::open(&tester, "plant/level", &level).unwrap().plain();
    let report = program.domain.folder().join("report.json");
    let line = format!("run pid.toml --seconds 2 --report {}", report.display());
    let mut node = program.start(&line);
    let started = Instant::now();
    let mut opened = 0.0;
    while node.try_wait().unwrap().is_none() {
        assert!(started.elapsed() < PATIENCE, "the node does not end");
        // Half a metre below where the set-point ends.
        sensor.prepare();
        sensor.values_mut().unwrap()[0] = 0.5;
        sensor.send(Stamp::default(), || 0);
        if let Some(frame) = valve.newest(0) {
            opened = frame.values()[0];
        }
        std::thread::sleep(STEP);
    }
    printed(&line, node.wait_with_output().unwrap());
    assert!(opened > 20.0 && opened < 60.0, "gain 40 at 0.5 m, and an integral: {opened}");
    let report = std::fs::read_to_string(report).unwrap();
    assert!(report.contains("\"block_errors\": 0"), "{report}");
    assert!(report.contains("\"allocations\": 0"), "{report}");
    let written_by = format!("\"name\": \"own_blocks\",\n    \"version\": \"{VERSION}\"");
    assert!(report.contains(&written_by), "{report}");
}

#[test]
fn a_program_has_a_version_and_verbs_of_its_own() {
    let program = Program { domain: IsolatedDomain::new("verbs").unwrap() };
    assert_eq!(program.run("--version"), format!("own_blocks {VERSION} (isochrone {VERSION})\n"));
    let help = program.run("--help");
    let has = |verb: &str| help.lines().any(|line| line.trim_start().starts_with(verb));
    assert!(has("settle ") && has("simulate "), "{help}");
    assert!(program.run("settle --help").contains("--gain <GAIN>"));

    let quick: f64 = program.run("settle").trim_end_matches(" s\n").parse().unwrap();
    let slow: f64 = program.run("settle --gain 10").trim_end_matches(" s\n").parse().unwrap();
    assert!(0.0 < quick && quick < slow, "{quick} s, {slow} s");
    let failed = program.start("settle --gain=-1").wait_with_output().unwrap();
    assert_eq!(failed.status.code(), Some(1));
    let complaint = String::from_utf8(failed.stderr).unwrap();
    assert!(complaint.contains("try another gain"), "{complaint}");
    let wrong = program.start("settle --gain much").wait_with_output().unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(program.run("completions bash").contains("settle"));
}

#[test]
fn an_array_in_a_state_is_recorded_and_repeated_bit_for_bit() {
    let program = Program { domain: IsolatedDomain::new("average").unwrap() };
    let simulated = program.run("simulate moving_average.toml --cycles 20");
    // The signal rises by 16 a cycle: its mean over 16 cycles is 7.5 steps behind.
    let last: Vec<&str> = simulated.lines().last().unwrap().split(',').collect();
    assert_eq!(last[1..], ["304.0", "184.0", "0.0"], "{simulated}");

    let file = program.domain.folder().join("average.mcap");
    program.run(&format!("run moving_average.toml --cycles 300 --record {}", file.display()));
    program.run(&format!("replay {}", file.display()));
}
