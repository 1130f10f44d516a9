//! A turn of each test that `torture` does for minutes, with a few faults; with `ISOCHRONE_TEST_VOLUME=full`, 500 faults
//! of each.

use std::process::Command;

use isochrone_benches::{Profile, find};
use isochrone_testing::{PATIENCE, Process, is_full_volume};

/// Peers that are started again are given time, as on a machine that is busy with other tests.
const FEW: &str = "--turns 1 --faults 4 --within 120 --seed 1";
const ALL: &str = "--turns 25 --faults 20 --within 120 --seed 1";

#[test]
fn no_turn_of_a_test_fails_and_a_stranger_reads_what_was_done() {
    let (turns, patiences) = if is_full_volume() { (ALL, 60) } else { (FEW, 5) };
    let mut command = Command::new(env!("CARGO_BIN_EXE_torture"));
    command.arg("--program").arg(find(Profile::own()).unwrap()).args(turns.split(' '));
    let mut process = Process::start(command);
    let ended = (0..patiences).find_map(|_| process.ended_within(PATIENCE));
    let ended = ended.unwrap_or_else(|| panic!("{}", process.printed())).expect_code(0);
    let tests = ["takeover", "stop", "kills", "state", "exhaustion"];
    ended.prints(&tests).prints(&["what must hold", "done: kills of the holder (kill -9)"]);
}

#[test]
fn a_test_or_a_scarcity_that_is_not_there_is_refused() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_torture"));
    let ended = Process::start(command.args(["--only", "nothing"])).finish().expect_code(2);
    ended.says(&["takeover, stop, kills, state, exhaustion"]);
}
