//! `scope`: what it captures is what the node sent, whatever happens to either of them.

use std::collections::BTreeMap;

use crate::tmux::Tmux;
use isochrone_testing::plants::{LEVEL, tank};
use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::Signal;

fn node() -> (Domain, Process) {
    let (domain, node) = tank(LEVEL);
    (domain, node)
}

/// Starts a scope that waits for `lim.highLim` to rise.
fn armed(domain: &Domain, arguments: &[&str]) -> Process {
    let fixed = ["scope", "level", "--trigger", "rising lim.highLim"];
    let mut scope = domain.start_with(&[&fixed, arguments].concat());
    scope.wait_for("armed: waiting for rising lim.highLim");
    scope
}

#[track_caller]
fn set(domain: &Domain, assignment: &str) {
    domain.run(&format!("set level {assignment}")).expect_code(0);
}

/// Rows of a CSV file by their cycles, without their times.
fn by_cycle(text: &str) -> BTreeMap<u64, String> {
    // The last one may be being written.
    let whole = text.rsplit_once('\n').unwrap().0;
    // A shot of a task that missed cycles has them behind the signals.
    let tells_missed = whole.lines().next().unwrap().ends_with(",missed_cycles");
    let rows = whole.lines().skip(1).map(|row| {
        let row = if tells_missed { row.rsplit_once(',').unwrap().0 } else { row };
        let (_, row) = row.split_once(',').unwrap();
        let (cycle, values) = row.split_once(',').unwrap();
        (cycle.parse().unwrap(), values.to_owned())
    });
    rows.collect()
}

/// The cycle whose row has the time 0.
fn zero(text: &str) -> u64 {
    let row = text.lines().find(|row| row.starts_with("0.0,")).unwrap();
    row.split(',').nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_shot_has_the_cycles_around_the_first_in_which_the_condition_is_true_to_the_bit() {
    let (domain, _node) = node();
    let subscriber = domain.start_until("subscribe level/out --csv sent.csv", "subscribed to");
    let shown = ["saw.value", "ramp.delayedValue", "lim.highLim"];
    let window = ["--pre", "200ms", "--post", "600ms", "-o", "shot.csv"];
    let scope = armed(&domain, &[&shown[..], &window[..]].concat());
    // The history is whole by then.
    let before = domain.read("sent.csv").lines().count();
    domain.wait_for_rows("sent.csv", before + 300);
    set(&domain, "lim.autoValue=500");
    let ended = scope.finish().expect_code(0);
    let shot = domain.read("shot.csv");
    let trigger = zero(&shot);
    // A busy task misses cycles, so that one may be none.
    wait_until("the subscriber has all of it", || {
        let last = by_cycle(&domain.read("sent.csv")).into_keys().next_back();
        last.is_some_and(|last| last > trigger + 310)
    });
    subscriber.stop().expect_code(0);
    let (sent, shot) = (by_cycle(&domain.read("sent.csv")), by_cycle(&shot));
    let expected: BTreeMap<u64, String> = sent
        .range(trigger - 100..trigger + 300)
        .map(|(cycle, values)| (*cycle, values.clone()))
        .collect();
    assert_eq!(shot, expected, "{}", ended.stderr);
    let highest = |cycle: u64| sent.range(..cycle).next_back().unwrap().1.ends_with(",1.0");
    assert!(sent[&trigger].ends_with(",1.0") && !highest(trigger), "{}", sent[&trigger]);
    let last = ended.stderr.lines().last().unwrap();
    assert!(last.starts_with("shot.csv: ") && last.contains(&format!("cycle {trigger}")), "{last}");
}

#[test]
fn signals_of_two_tasks_lie_on_one_axis_and_a_file_of_them_is_shown_again() {
    let (domain, node) = node();
    // That of the trigger is not shown.
    let shown = ["ramp.delayedValue", "late.*", "--post", "300ms"];
    let scope = armed(&domain, &[&shown[..], &["-o", "shot.mcap"]].concat());
    set(&domain, "lim.autoValue=500");
    scope.finish().expect_code(0);
    node.stop().expect_code(0);

    let run = |arguments: &str| domain.run(arguments).expect_code(0);
    let chart = run("scope shot.mcap ramp.delayedValue late.delayedValue").stdout;
    for part in ["level: rising lim.highLim in cycle", "fast every 2 ms", "slow every"] {
        assert!(chart.contains(part), "{part}\n{chart}");
    }
    assert!(chart.contains("ramp.delayedValue │") && chart.contains('▲'), "{chart}");
    assert!(!chart.contains('\u{1b}') && chart.lines().all(|line| line.chars().count() <= 80));
    domain.expect("scope shot.mcap -o both.csv", 2, &["of fast and slow"]);
    run("scope shot.mcap ramp.delayedValue -o fast.csv");
    run("scope shot.mcap -o shot.svg");
    run("scope shot.mcap -o again.mcap");
    run("scope again.mcap -o again.svg");
    assert_eq!(domain.read("shot.svg"), domain.read("again.svg"));
    assert!(domain.read("shot.svg").contains("late.delayedValue"));
    run("export again.mcap --service level/fast -o exported.csv");
    let (fast, exported) = (domain.read("fast.csv"), domain.read("exported.csv"));
    assert_eq!(by_cycle(&fast), by_cycle(&exported));
    // Times count from the trigger, so a CSV file says which cycle it was.
    let again = run("scope fast.csv").stdout;
    assert!(again.contains(&format!("trigger in cycle {}", zero(&fast))), "{again}");
    // A trigger finds its instant in a file as well.
    let (cycle, value) = by_cycle(&fast).into_iter().nth(40).unwrap();
    let value: f64 = value.parse().unwrap();
    let arguments = ["scope", "fast.csv", "--pre", "20ms", "--post", "40ms", "-o", "part.csv"];
    let trigger = format!("ramp.delayedValue == {value:?}");
    let part = domain.start_with(&[&arguments[..], &["--trigger", &trigger]].concat());
    part.finish().expect_code(0);
    assert!(zero(&domain.read("part.csv")) <= cycle);
}

#[test]
fn a_number_that_rises_without_a_level_crosses_half_of_what_is_seen_of_it() {
    let (domain, _node) = node();
    domain.write("saw.csv", "time_s,saw\n0.0,0.0\n0.1,1.0\n0.2,5.0\n0.3,20.0\n0.4,0.0\n");
    let found = domain.start_with(&["scope", "saw.csv", "-t", "rising saw"]).finish();
    assert!(found.stderr.contains("names no level; it is 10.0"), "{}", found.stderr);
    assert!(found.stdout.contains("rising saw 10.0"), "{}", found.stdout);
    let arguments = ["scope", "level", "-t", "falling saw.value", "-o", "shot.csv"];
    let shot = domain.start_with(&[&arguments[..], &["--pre", "0", "--post", "10ms"]].concat());
    shot.finish().expect_code(0).says(&["armed: waiting for falling saw.value"]);
}

#[test]
fn what_cannot_be_shown_is_refused_with_the_way_out() {
    let (domain, _node) = node();
    domain.write("no.mcap", "nothing");
    domain.write("no_time.csv", "cycle,x\n1,2\n");
    for (arguments, code, says) in [
        (&["level", "ramp.delayedVale"][..], 1, "did you mean \"ramp.delayedValue\"?"),
        (
            &["level", "ramp.status", "-t", "rising rmap.status 1"],
            1,
            "did you mean \"ramp.status\"?",
        ),
        (&["level"], 2, "name the signals to show"),
        (&["lvel", "ramp.status"], 3, "did you mean \"level\"?"),
        (&["level", "-t", "ramp.status"], 2, "does not say what to wait for"),
        (&["level", "-t", "ramp.status = 1"], 2, "= is no comparison; write =="),
        (
            &["level", "-t", "rising ramp.setChangeRate"],
            2,
            "write the one to cross, such as 'rising",
        ),
        (&["level", "-t", "ramp.* > 1"], 2, "stands for several signals; name one"),
        (&["level", "-t", "ramp.status > high"], 2, "a value is true, false, a number"),
        (&["level", "ramp.status", "-o", "shot.png"], 2, "end the name with .mcap, .csv or .svg"),
        (&["level", "ramp.status", "late.status", "-o", "-"], 2, "of fast and slow"),
        (&["level", "ramp.*", "--pre", "1s"], 2, "--trigger"),
        (&["level", "ramp.*", "--post", "100h"], 2, "shorten --pre and --post"),
        (&["no.mcap"], 2, "it is no MCAP file"),
        (&["none.mcap"], 2, "cannot read none.mcap"),
        (&["no_time.csv"], 2, "no column \"time_s\""),
        (&["no_time.csv", "--timeout", "1", "-t", "x > 1"], 2, "for a running node"),
    ] {
        let ended = domain.start_with(&[&["scope"], arguments].concat()).finish();
        assert_eq!(ended.status.code(), Some(code), "{arguments:?}: {}", ended.stderr);
        let said = ended.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.contains(says), "{arguments:?}: {said}");
        assert_eq!(ended.stdout, "", "{arguments:?}");
    }
}

#[test]
fn a_trigger_that_does_not_come_is_given_up_and_leaves_no_file() {
    let (domain, _node) = node();
    let late = "scope level ramp.delayedValue --trigger ramp.delayedValue>=1e6 -o shot.svg";
    let ended = domain.run(&format!("{late} --timeout 300ms")).expect_code(4);
    let said = ended.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        said.contains("the trigger did not come within 0.3 s: ramp.delayedValue was"),
        "{said}"
    );
    let scope = domain.start_until(late, "armed");
    scope.signal(Signal::INT);
    scope.finish().expect_code(4).says(&["ended before the trigger came"]);
    assert!(!domain.path("shot.svg").exists());
}

#[test]
fn a_node_that_ends_ends_the_scope_with_what_there_is() {
    let (domain, node) = node();
    let waiting = armed(&domain, &["ramp.delayedValue", "-o", "none.csv"]);
    let post = ["--post", "60s", "-o", "part.csv"];
    let trigger = ["--trigger", "changed saw.value"];
    let arguments = [&["scope", "level", "ramp.delayedValue"], &trigger[..], &post].concat();
    let mut triggered = domain.start_with(&arguments);
    triggered.wait_for("armed");
    let subscriber = domain.start_until("subscribe level/out --csv sent.csv", "subscribed to");
    domain.wait_for_rows("sent.csv", 400);
    node.stop().expect_code(0);
    waiting.finish().expect_code(3).says(&["node \"level\" ended before the trigger"]);
    assert!(!domain.path("none.csv").exists());
    triggered.finish().expect_code(1).says(&["instead of 60 s after the trigger"]);
    assert!(domain.read("part.csv").lines().count() > 100);
    drop(subscriber);
}

#[test]
fn on_a_terminal_each_shot_takes_the_place_of_the_one_before_until_q() {
    let (domain, _node) = node();
    let arguments =
        "scope level saw.value ramp.delayedValue -t 'falling saw.value 800' --repeat --post 50ms";
    let Some(terminal) = Tmux::start(&domain, "LANG=C.UTF-8", arguments) else { return };
    terminal.wait_for("2 shots   armed: waiting for falling saw.value 800");
    terminal.wait_for("level: falling saw.value 800 in cycle");
    for sign in ["▲", "saw.value │", "q quits"] {
        terminal.wait_for(sign);
    }
    terminal.press(&["q"]);
    // The last chart stays.
    terminal.expect_given_back(&domain, 0, "q quits");
    assert!(terminal.shown().contains("▲"), "{}", terminal.shown());

    let arguments = "scope level ramp.delayedValue --auto --post 200ms";
    let Some(terminal) = Tmux::start(&domain, "NO_COLOR=1", arguments) else { return };
    terminal.wait_for("level: 200 ms");
    terminal.press(&["C-c"]);
    terminal.expect_given_back(&domain, 0, "q quits");
}

#[test]
fn scopes_that_are_killed_leave_nothing_armed() {
    let (domain, _node) = node();
    // As many as a task takes.
    let scopes: Vec<Process> = (0..4).map(|_| armed(&domain, &["ramp.delayedValue"])).collect();
    let fifth = "scope level ramp.delayedValue -t ramp.delayedValue>1e9 --timeout 100ms";
    domain.expect(fifth, 1, &["traced 4 times"]);
    scopes.into_iter().for_each(Process::kill);
    wait_until("there is room for another one", || domain.run(fifth).status.code() == Some(4));
}
