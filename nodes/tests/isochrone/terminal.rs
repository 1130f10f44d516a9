//! What a terminal shows: `script` gives the program one.

use std::process::{Command, Stdio};

use isochrone_testing::{Domain, not_tested};

/// What the program writes to a terminal of 80 columns.
fn on_a_terminal(arguments: &str) -> Option<String> {
    let command =
        format!("stty cols 80 rows 24; '{}' {arguments}", env!("CARGO_BIN_EXE_isochrone"));
    let mut script = Command::new("script");
    script.args(["-qec", &command, "/dev/null"]).stdin(Stdio::null());
    let Ok(written) = script.output() else {
        not_tested("live values on a terminal", "there is no `script`");
        return None;
    };
    let text = String::from_utf8(written.stdout).unwrap();
    assert!(written.status.success(), "{text}");
    Some(text)
}

#[test]
fn a_terminal_shows_one_table_with_a_header_that_is_drawn_again_in_its_place() {
    let domain = Domain::new();
    let signals = "--signals level,a.very.long.name.that.no.terminal.of.eighty.columns.has.room.for.beside.a.value";
    let mut publisher =
        domain.start(&format!("publish plant/level --value 0.8499999999999999,true {signals}"));
    publisher.wait_for("publishing");
    let config = domain.config_file().display().to_string();
    let Some(shown) =
        on_a_terminal(&format!("subscribe plant/level --count 500 --iceoryx2-config {config}"))
    else {
        return;
    };
    let rows: Vec<&str> = shown.split("\r\n").map(|row| row.trim_end_matches("\u{1b}[K")).collect();
    let after = |row: &str| row.rsplit_once('A').map_or(row, |(_, rest)| rest).to_owned();
    let is_header =
        |row: &&str| row.starts_with("signal ") && row.contains("type") && row.ends_with("value");
    assert!(rows.iter().filter(|row| is_header(row)).count() > 1, "{shown}");
    assert!(shown.contains("\u{1b}[4A"), "the cursor goes back over four lines: {shown:?}");
    assert!(rows.iter().any(|row| row.starts_with("level ") && row.ends_with(" 0.85")), "{shown}");
    assert!(rows.iter().any(|row| row.contains("…") && row.ends_with(" TRUE")), "{shown}");
    let table = rows.iter().filter(|row| !row.contains("subscribed"));
    assert!(table.clone().all(|row| after(row).chars().count() <= 80), "{shown}");
}

#[test]
fn the_demo_shows_its_values_live_and_then_the_summary() {
    // On a busy machine most of the time may be over before its processes run.
    let shown = (0..10).find_map(|_| {
        let shown = on_a_terminal("demo --seconds 3");
        let live = |shown: &String| shown.matches("heartbeat.value").count() > 1;
        if shown.as_ref().is_none_or(live) { Some(shown) } else { None }
    });
    let Some(shown) = shown.unwrap() else { return };
    let (live, summary) = shown.split_once("isochrone 0").unwrap();
    assert!(live.contains("\u{1b}[6A") && !live.contains("level.y="), "{shown}");
    for part in ["release jitter", "link plant/level", "end to end"] {
        assert!(summary.contains(part), "{part}: {shown}");
    }
}
