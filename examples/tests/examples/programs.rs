//! The programs that need nobody else do what they say.

use std::process::Command;

/// Runs a program to its end and returns what it printed.
fn run(program: &str) -> String {
    let output = Command::new(program).output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {complaint}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// The lines that a program prints beside notes on what the machine refused, which indent.
fn lines(printed: &str) -> Vec<&str> {
    printed.lines().filter(|line| !line.starts_with("note: ") && !line.starts_with(' ')).collect()
}

#[test]
fn the_embedded_node_computes_level_and_ramp_and_reports_its_jitter() {
    let printed = run(env!("CARGO_BIN_EXE_embedded"));
    let lines = lines(&printed);
    let [raw, level, ramp, cycles, jitter] = lines[..] else { panic!("{printed}") };
    let level_m = 1.7 / 27648.0 * 20736.0;
    assert_eq!(raw, "level_raw = 20736.0");
    assert_eq!(level, format!("level.y = {level_m:?}"));
    // 500 cycles of 10 mm are more than the ramp needs.
    assert_eq!(ramp, format!("ramp.delayedValue = {level_m:?}"));
    assert!(cycles.starts_with("500 cycles, "), "{printed}");
    let numbers = jitter.strip_prefix("release jitter in ns: p50 ").unwrap();
    let numbers = numbers.replace("p90 ", "").replace("max ", "");
    let ns: Vec<u64> = numbers.split(", ").map(|ns| ns.parse().unwrap()).collect();
    assert!(ns.len() == 3 && ns.is_sorted(), "{printed}");
}

#[test]
fn a_node_and_its_application_talk_inside_one_process() {
    let printed = run(env!("CARGO_BIN_EXE_in_process"));
    assert_eq!(printed, format!("level {} m, node Asked\n", 1.7 / 27648.0 * 20736.0));
}
