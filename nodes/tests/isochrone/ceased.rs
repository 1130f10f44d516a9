//! Frames that cease: what a subscriber says of it, to people and to scripts.

use std::fs::File;
use std::process::{Command, Stdio};

use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Process, not_tested, wait_until};
use serde_json::Value;

const PUBLISH: &str = "publish plant/level --value 0.5,true --signals level,full";

/// A subscriber on a terminal of 80 columns, which writes what it shows to the file `screen`.
fn subscribe_on_a_terminal(domain: &Domain, service: &str) -> Option<Process> {
    let program = env!("CARGO_BIN_EXE_isochrone");
    let config = domain.config_file().display().to_string();
    let command = format!(
        "stty cols 80 rows 24; exec '{program}' subscribe {service} --iceoryx2-config {config}"
    );
    if Command::new("script").arg("--version").stdout(Stdio::null()).status().is_err() {
        not_tested("frames that cease, on a terminal", "there is no `script`");
        return None;
    }
    File::create(domain.path("screen")).unwrap();
    let mut script = Command::new("script");
    script.args(["-qefc", &command]).arg(domain.path("screen"));
    Some(Process::start(script))
}

/// Waits for a header of the table, the newest on the screen.
fn wait_for_header(domain: &Domain, what: &str, is_it: impl Fn(&str) -> bool) -> String {
    let newest = || {
        let shown = domain.read("screen");
        // Whole lines, each with the command before it that moves the cursor.
        let ended = shown.split("\r\n").filter_map(|line| line.strip_suffix("\u{1b}[K"));
        let headers = ended.filter_map(|line| {
            line.find("\"relay/").or(line.find("\"plant/")).map(|at| &line[at..])
        });
        headers.last().unwrap_or_default().to_owned()
    };
    let mut found = String::new();
    wait_until(what, || {
        found = newest();
        is_it(&found)
    });
    found
}

#[test]
fn in_a_pipe_a_subscriber_says_that_frames_cease_and_that_they_come_again() {
    let domain = Domain::new();
    let publisher = domain.start_until(PUBLISH, "publishing");
    let mut subscriber = domain.start_until("subscribe plant/level --every 100", "level=0.5");
    publisher.kill();
    subscriber.wait_for("\"plant/level\" is silent: nobody publishes it; ");
    let publisher = domain.start(PUBLISH);
    subscriber.wait_for("\"plant/level\" sends again, after ");
    publisher.stop().expect_code(0);
    let ended = subscriber.stop().expect_code(0);
    assert!(!ended.stdout.contains("silent"), "{}", ended.stdout);
}

#[test]
fn the_end_of_a_node_is_said_without_waiting() {
    let (domain, node) = isochrone_testing::plants::tank(RELAY);
    let mut subscriber = domain.start_until("subscribe relay/out --every 100", "x=");
    node.stop().expect_code(0);
    subscriber.wait_for("\"relay/out\" is silent: its publisher has ended; ");
}

#[test]
fn a_service_that_sends_nothing_at_all_is_silent_too() {
    let (domain, _node) = isochrone_testing::plants::tank(RELAY);
    let subscriber = domain.start_until(
        "subscribe relay/in",
        "\"relay/in\" is silent: nobody publishes it; no frame has come yet",
    );
    subscriber.stop().expect_code(3);
}

#[test]
fn on_a_terminal_the_header_counts_the_seconds_without_a_frame() {
    let domain = Domain::new();
    let publisher = domain.start_until(PUBLISH, "publishing");
    let Some(subscriber) = subscribe_on_a_terminal(&domain, "plant/level") else { return };
    wait_for_header(&domain, "it shows an age", |header| header.contains(", age "));
    publisher.kill();
    let is_silent =
        |header: &str| header.contains(", no frame for ") && header.ends_with(" s (no publisher)");
    let header = wait_for_header(&domain, "it says so", is_silent);
    assert!(header.chars().count() <= 80, "{header:?}");
    wait_for_header(&domain, "it counts", |later| is_silent(later) && later != header);
    let publisher = domain.start(PUBLISH);
    wait_for_header(&domain, "it shows an age again", |header| header.contains(", age "));
    publisher.stop().expect_code(0);
    subscriber.stop();
}

#[test]
fn on_a_terminal_of_eighty_columns_no_flag_of_the_header_is_cut_off() {
    let (domain, node) = isochrone_testing::plants::tank(RELAY);
    let Some(subscriber) = subscribe_on_a_terminal(&domain, "relay/out") else { return };
    wait_for_header(&domain, "it shows a flag", |header| header.ends_with("[SUBSTITUTE]"));
    node.stop().expect_code(0);
    let is_whole = |header: &str| header.ends_with("[SUBSTITUTE STOPPED]");
    let header = wait_for_header(&domain, "it shows all flags", is_whole);
    assert!(header.chars().count() <= 80, "{header:?}");
    subscriber.stop();
}

#[test]
fn a_script_reads_each_frame_as_an_object_with_its_flags() {
    let (domain, node) = isochrone_testing::plants::tank(RELAY);
    let mut subscriber = domain.start_until("subscribe relay/out --json", "}}");
    node.stop().expect_code(0);
    subscriber.wait_for("STOPPED");
    let ended = subscriber.stop().expect_code(0);
    let frames: Vec<Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for frame in &frames {
        assert_eq!(frame["values"]["x"], 0.0, "{frame}");
        assert_eq!(frame["flags"][0], "SUBSTITUTE", "{frame}");
        assert!(frame["age_ns"].is_u64() && frame["publish_ns"].is_u64(), "{frame}");
    }
    let sequences: Vec<u64> =
        frames.iter().map(|frame| frame["sequence"].as_u64().unwrap()).collect();
    assert!(sequences.windows(2).all(|pair| pair[0] < pair[1]), "{sequences:?}");
    let last = &frames[frames.len() - 1];
    assert_eq!(last["flags"], serde_json::json!(["SUBSTITUTE", "STOPPED"]));
}

#[test]
fn a_recording_has_the_columns_that_are_asked_for() {
    let (domain, _node) = isochrone_testing::plants::tank(RELAY);
    let columns = "--columns flags,sequence,age_ns,publish_ns";
    let ended = domain.run(&format!("subscribe relay/out --csv - {columns} --count 3"));
    let stdout = ended.expect_code(0).stdout;
    let rows: Vec<&str> = stdout.lines().collect();
    assert_eq!(rows[0], "time_s,cycle,flags,sequence,age_ns,publish_ns,x");
    assert_eq!(rows.len(), 4, "{stdout}");
    for row in &rows[1..] {
        let fields: Vec<&str> = row.split(',').collect();
        assert_eq!((fields[2], fields[6]), ("SUBSTITUTE", "0.0"), "{row}");
        assert!(fields[3..6].iter().all(|field| field.parse::<u64>().is_ok()), "{row}");
    }
}

#[test]
fn a_count_is_one_of_the_frames_that_are_shown() {
    let domain = Domain::new();
    let _publisher = domain.start(PUBLISH);
    let ended = domain.run("subscribe plant/level --every 50 --count 3").expect_code(0);
    assert_eq!(ended.stdout.lines().count(), 3, "{}", ended.stdout);
    assert!(ended.stderr.contains("101 frames, "), "{}", ended.stderr);
}
