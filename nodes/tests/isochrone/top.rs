//! `top` as a user has it: on a terminal, which tmux is.

use std::path::PathBuf;
use std::process::Command;

use crate::tmux::Tmux;
use isochrone_testing::plants::TANK;
use isochrone_testing::{Domain, Process, wait_until};

/// The tank, with so many blocks that most of its signals are not on the screen.
fn large() -> String {
    TANK.replace("name = \"beat\"", "name = \"saw\"\ncount = 2000")
}

fn node(domain: &Domain) -> Process {
    domain.start_node("tank.toml", &large(), "")
}

/// The node, and `top` on a terminal; `None` where there is no terminal.
fn top(screen: &str) -> Option<(Domain, Process, Tmux)> {
    let domain = Domain::new();
    let node = node(&domain);
    let tmux = Tmux::start(&domain, "NO_COLOR=1", "top tank")?;
    tmux.wait_for(screen);
    Some((domain, node, tmux))
}

fn value(domain: &Domain, name: &str) -> String {
    domain.run(&format!("get tank {name}")).expect_code(0).stdout.trim().to_owned()
}

#[test]
fn a_parameter_is_set_on_the_screen_within_its_limits_and_set_back() {
    let Some((domain, _node, tmux)) = top("14022 of 14022 listed") else { return };
    tmux.press(&["/", "setChangeRate", "Enter"]);
    tmux.wait_for("1 of 14022 listed");
    tmux.wait_for("parameter             10 1/s");
    tmux.press(&["Enter", "60", "Enter"]);
    tmux.wait_for("60 is outside of the limits: 0 to 50");
    tmux.press(&["C-u", "7.5", "Enter", "y"]);
    tmux.wait_for("set ramp.setChangeRate to 7.5 1/s (was 10)");
    tmux.wait_for("parameter            7.5 1/s");
    assert_eq!(value(&domain, "ramp.setChangeRate"), "7.5");
    tmux.press(&["u"]);
    tmux.wait_for("set ramp.setChangeRate 10 -> 7.5, by ");
    tmux.press(&["Enter", "Enter"]);
    tmux.wait_for("undo transaction");
    tmux.wait_for("parameter             10 1/s");
    assert_eq!(value(&domain, "ramp.setChangeRate"), "10");
    tmux.press(&["q"]);
    tmux.expect_given_back(&domain, 0, "1 Signals");
}

#[test]
fn a_force_is_marked_listed_and_released_and_a_dead_sensor_is_an_alarm() {
    // The input has had no sample.
    let Some((domain, _node, tmux)) = top("! level") else { return };
    tmux.wait_for("3 Alarms (1)");
    let publisher = domain.start("publish tank/in --value 1.5 --rate 100");
    tmux.wait_until("an input that is ok", |shown| !shown.contains("! level"));
    publisher.stop().expect_code(0);
    tmux.wait_for("! level");
    tmux.press(&["f", "42", "Enter", "hold", "Enter", "Enter"]);
    tmux.wait_for("F! level");
    tmux.wait_for("4 Forces (1)");
    assert_eq!(value(&domain, "level"), "42");
    tmux.press(&["4", "r", "Enter"]);
    tmux.wait_for("nothing is forced");
    assert_eq!(value(&domain, "level"), "1.5");
    tmux.press(&["3"]);
    tmux.wait_for("since cycle");
    tmux.press(&["2"]);
    tmux.wait_until("the percentiles of a second and of a minute", |shown| {
        let mut rows = shown.lines().filter(|line| line.starts_with("fast"));
        rows.nth(1).is_some_and(|row| row.split_whitespace().all(|word| word != "-"))
    });
    tmux.press(&["C-c"]);
    tmux.expect_given_back(&domain, 0, "1 Signals");
}

#[test]
fn the_last_of_thousands_of_signals_has_its_value_also_after_a_resize() {
    let Some((_domain, _node, tmux)) = top("14022 of 14022 listed") else { return };
    tmux.press(&["End"]);
    let has_value = |shown: &str| {
        let row = shown.lines().find(|line| line.contains("guard.y "));
        // A mark may come before the name, and the role comes behind it.
        let value =
            row.and_then(|row| row.split_whitespace().skip_while(|it| *it != "guard.y").nth(2));
        value.is_some_and(|value| value != "-")
    };
    tmux.wait_until("the value of the last signal", has_value);
    tmux.run(&["resize-window", "-x", "140", "-y", "40"]);
    tmux.wait_for("1 min of shown cycles");
    tmux.wait_until("the value of the last signal", has_value);
    tmux.run(&["resize-window", "-x", "80", "-y", "12"]);
    tmux.wait_until("the smallest screen", |shown| shown.lines().count() == 12 && has_value(shown));
    tmux.run(&["resize-window", "-x", "40", "-y", "10"]);
    tmux.wait_for("top needs 80x12 characters");
}

#[test]
fn a_node_that_is_killed_is_said_to_be_gone_and_comes_back() {
    let Some((domain, first, tmux)) = top("14022 of 14022 listed") else { return };
    first.kill();
    tmux.wait_for("looking for the node");
    // Its values are no news.
    tmux.wait_until("no values", |shown| {
        let row = shown.lines().find(|line| line.contains("ramp.setChangeRate"));
        row.is_some_and(|row| row.trim_end().ends_with("- 1/s"))
    });
    let second = node(&domain);
    tmux.wait_for("node \"tank\" answers again");
    tmux.wait_for("parameter             10 1/s");
    second.stop().expect_code(0);
    tmux.wait_for("looking for the node");
    Command::new("kill").arg(tmux.program()).status().unwrap();
    tmux.expect_given_back(&domain, 0, "1 Signals");
}

#[test]
fn a_task_that_has_not_run_yet_holds_up_neither_the_values_nor_the_changes_of_the_others() {
    let domain = Domain::new();
    let slow = "[[task]]\nname = \"slow\"\nperiod = \"1h\"\nphase = \"50min\"\n";
    let late = "[[block]]\nname = \"late\"\ntask = \"slow\"\ntype = \"LimRateOfChangeCI\"\n";
    let text = large().replace("type = ", "task = \"fast\"\ntype = ");
    let text = text.replace("service = ", "task = \"fast\"\nservice = ");
    let _node = domain.start_node("tank.toml", &(text + slow + late), "");
    let Some(tmux) = Tmux::start(&domain, "NO_COLOR=1", "top tank") else { return };
    tmux.wait_for("14031 of 14031 listed");
    tmux.press(&["/", "setChangeRate", "Enter"]);
    tmux.wait_for("2 of ");
    tmux.wait_for("parameter             10 1/s");
    tmux.wait_for("parameter              - 1/s");
    tmux.press(&["Enter", "7.5", "Enter", "Enter"]);
    tmux.wait_for("set ramp.setChangeRate to 7.5 1/s (was 10)");
    tmux.wait_for("parameter            7.5 1/s");
}

#[test]
fn top_ends_with_its_terminal() {
    let Some((_domain, _node, tmux)) = top("1 Signals") else { return };
    let program = PathBuf::from(format!("/proc/{}", tmux.program()));
    assert!(program.exists());
    drop(tmux);
    wait_until("it has ended", || !program.exists());
}

#[test]
fn top_without_a_node_or_without_a_terminal_says_what_there_is() {
    let domain = Domain::new();
    let _node = node(&domain);
    domain.expect("top tank", 2, &["isochrone show", "isochrone watch"]);
    let Some(tmux) = Tmux::start(&domain, "NO_COLOR=1", "top tnak") else { return };
    tmux.wait_for("did you mean \"tank\"?");
    tmux.expect_given_back(&domain, 3, "1 Signals");
}
