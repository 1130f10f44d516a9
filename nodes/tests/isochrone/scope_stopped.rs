//! `scope` of a node that stands still for longer than it keeps a trace.

use std::thread;
use std::time::Duration;

use isochrone_testing::plants::{LEVEL, tank};
use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::Signal;

/// How long a node keeps a trace that nobody renews.
const LEASE: Duration = Duration::from_secs(5);

/// Starts a scope that waits for `lim.highLim`.
fn armed(domain: &Domain, more: &[&str]) -> Process {
    let fixed = ["scope", "level", "saw.value", "lim.highLim", "-t", "rising lim.highLim"];
    let mut scope = domain.start_with(&[&fixed, more].concat());
    scope.wait_for("armed: waiting for rising lim.highLim");
    // Cycles run that it looks at.
    let value = || domain.run("get level saw.value").expect_code(0).stdout;
    let first = value();
    wait_until("another cycle has run", || value() != first);
    scope
}

/// Has the trigger come, and reads what the scope wrote: the cycles, and what it said.
#[track_caller]
fn captured(domain: &Domain, scope: Process) -> (Vec<u64>, String) {
    domain.run("set level lim.autoValue=500").expect_code(0);
    let ended = scope.finish().expect_code(0);
    let text = domain.read("shot.csv");
    let cycle = |row: &str| row.split(',').nth(1).unwrap().parse().unwrap();
    (text.lines().skip(1).map(cycle).collect(), ended.stderr)
}

/// What is missing between the rows, in cycles.
fn largest_gap(cycles: &[u64]) -> u64 {
    cycles.windows(2).map(|two| two[1] - two[0]).max().unwrap()
}

#[test]
fn a_node_that_stood_still_is_looked_at_again_when_it_answers_and_the_gap_is_marked() {
    let (domain, node) = tank(LEVEL);
    let mut scope = armed(&domain, &["--pre", "60s", "--post", "700ms", "-o", "shot.csv"]);
    node.signal(Signal::STOP);
    scope.wait_for("node \"level\" does not answer; waiting for it");
    thread::sleep(LEASE);
    node.signal(Signal::CONT);
    scope.wait_for("cycles come again");
    let (cycles, said) = captured(&domain, scope);
    assert!(largest_gap(&cycles) > 2_500, "{}", largest_gap(&cycles));
    for says in ["fast missed ", "triggered in cycle", "capturing 700 ms from there"] {
        assert!(said.contains(says), "{says}: {said}");
    }
}

#[test]
fn a_scope_that_stood_still_itself_goes_on_and_counts_what_it_lost() {
    let (domain, _node) = tank(LEVEL);
    let scope = armed(&domain, &["--pre", "60s", "--post", "100ms", "-o", "shot.csv"]);
    scope.signal(Signal::STOP);
    thread::sleep(LEASE + Duration::from_secs(1));
    scope.signal(Signal::CONT);
    let (cycles, said) = captured(&domain, scope);
    assert!(largest_gap(&cycles) > 500, "{}", largest_gap(&cycles));
    assert!(said.contains("of fast did not arrive"), "{said}");
}
