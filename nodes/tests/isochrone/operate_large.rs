//! Requests with as many and as long names as a command line or a message has room for.

use std::fmt::Write as _;

use isochrone_testing::plants::tank;
use isochrone_testing::{Plant, assert_says};

/// More parameters than one request may name.
const RAMPS: usize = 10_000;
/// Names of one request.
const MAX_NAMES: usize = 4_096;

fn node() -> Plant {
    Plant::new("tank")
        .with("control = \"force\"")
        .task("t", "50ms")
        .ramp("ramp", "value = 1.0, setChangeRate = 10.0")
        .with(&format!("count = {RAMPS}"))
}

/// What stands on the command line for each of so many ramps.
fn for_each(ramps: usize, one: impl Fn(usize) -> String) -> Vec<String> {
    (0..ramps).map(one).collect()
}

#[test]
fn ten_thousand_values_are_read_in_pieces_and_set_in_no_single_transaction() {
    let (domain, _node) = tank(&node());
    let run = |verb: &[&str], names: &[String]| {
        let names = names.iter().map(String::as_str);
        domain.start_with(&verb.iter().copied().chain(names).collect::<Vec<_>>()).finish()
    };
    let names = for_each(RAMPS, |ramp| format!("ramp.{ramp}.value"));
    let read = run(&["get", "tank"], &names).expect_code(0).stdout;
    assert_eq!(read, "1\n".repeat(RAMPS));
    assert_eq!(domain.stdout("get tank ramp.*.value"), read, "by a glob as well");

    let values = for_each(RAMPS, |ramp| format!("ramp.{ramp}.value={ramp}"));
    for verb in [&["set", "tank"][..], &["force", "tank", "--hold"]] {
        let refused = run(verb, &values).expect_code(1);
        assert_says(&refused.stderr, &["nothing was changed", "at most 4096"]);
    }
    assert_eq!(domain.stdout("get tank ramp.*.value"), read);
    domain.expect("journal tank", 0, &["nothing was changed"]);
    run(&["set", "tank"], &values[..MAX_NAMES]).expect_code(0);
    let mut set = String::new();
    (0..MAX_NAMES).for_each(|ramp| writeln!(set, "{ramp}").unwrap());
    let (first, rest) = (domain.stdout("get tank ramp.*.value"), "1\n".repeat(RAMPS - MAX_NAMES));
    assert_eq!(first, set + &rest);
}

#[test]
fn as_many_names_as_a_request_may_have_that_do_not_exist_are_refused_in_an_answer_that_has_room() {
    let (domain, _node) = tank(&node());
    let long = "x".repeat(20);
    let unknown = for_each(MAX_NAMES, |ramp| format!("{long}.{ramp}.value=1"));
    let unknown = unknown.iter().map(String::as_str);
    let refused =
        domain.start_with(&["set", "tank"].into_iter().chain(unknown).collect::<Vec<_>>());
    let refused = refused.finish().expect_code(1);
    assert_says(&refused.stderr, &["nothing was changed", &format!("\"{long}.0.value\"")]);
    assert!(refused.stderr.len() < 2 * isochrone_ipc::MAX_MESSAGE_BYTES);
    domain.expect("journal tank", 0, &["nothing was changed"]);
}

#[test]
fn values_that_no_message_has_room_for_are_refused_before_they_are_sent() {
    let (domain, _node) = tank(&node());
    let long = "x".repeat(100);
    let values = for_each(MAX_NAMES, |ramp| format!("{long}.{ramp}.value=1"));
    let values = values.iter().map(String::as_str);
    let refused = domain.start_with(&["set", "tank"].into_iter().chain(values).collect::<Vec<_>>());
    let refused = refused.finish().expect_code(1);
    assert_says(&refused.stderr, &["nothing was changed", "at most 262144", "divide it"]);
    domain.expect("journal tank", 0, &["nothing was changed"]);
}
