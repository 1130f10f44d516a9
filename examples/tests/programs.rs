//! The programs that need nobody else do what they say.

use std::process::Command;

/// Runs a program to its end and returns what it printed.
fn run(program: &str) -> String {
    let output = Command::new(program).output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {complaint}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_embedded_pipeline_computes_level_and_ramp_exactly() {
    let printed = run(env!("CARGO_BIN_EXE_embedded"));
    // Per step of 1 ms the ramp adds 10 m/s * 0.001 s; the sums are those of binary64.
    let ramp_after = |steps: usize| (0..steps).fold(0.0, |y, _| y + 10.0 * 0.001);
    let level = 1.7 / 27648.0 * 20736.0;
    let rows = [
        (1, 20736, level),
        (2, 20736, level),
        (50, 20736, level),
        (51, 30000, 1.7),
        (100, 30000, 1.7),
    ];
    for (step, raw, level) in rows {
        let row =
            [step.to_string(), raw.to_string(), level.to_string(), ramp_after(step).to_string()];
        let found = printed.lines().any(|line| line.split_whitespace().eq(row.iter()));
        assert!(found, "{row:?} in\n{printed}");
    }
}

#[test]
fn the_embedded_pipeline_runs_a_hundred_cycles_and_reports_their_jitter() {
    let printed = run(env!("CARGO_BIN_EXE_embedded"));
    assert!(printed.contains("\n100 cycles, "), "{printed}");
    let numbers = printed.split("\nrelease jitter in ns: p50 ").nth(1).unwrap();
    let numbers = numbers.trim_end().replace("p90 ", "").replace("max ", "");
    let ns: Vec<u64> = numbers.split(", ").map(|ns| ns.parse().unwrap()).collect();
    assert!(ns.len() == 3 && ns.is_sorted(), "{printed}");
}

#[test]
fn two_threads_exchange_every_frame_in_order() {
    assert_eq!(
        run(env!("CARGO_BIN_EXE_in_process")),
        "frame 0 of cycle 0: [0.0, 0.0]\n\
         frame 1 of cycle 1: [0.425, 25.0]\n\
         frame 2 of cycle 2: [0.85, 50.0]\n\
         frame 3 of cycle 3: [1.275, 75.0]\n\
         frame 4 of cycle 4: [1.7, 100.0]\n\
         received 5, errors 0\n"
    );
}

#[test]
fn a_custom_block_runs_beside_one_of_the_library() {
    // 100 ms / (100 ms + 300 ms): a quarter of the difference in each cycle.
    assert_eq!(
        run(env!("CARGO_BIN_EXE_custom_block")),
        "cycle  saw  smooth\n\
         0      100  25\n\
         1      100  43.75\n\
         2      100  57.8125\n\
         3      100  68.359375\n\
         4      200  101.26953125\n\
         5      200  125.9521484375\n\
         0 block errors\n"
    );
}
