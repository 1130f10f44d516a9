//! `doctor`: this machine is examined, whatever it is and whoever asks, and stays as it is.

use std::io::{ErrorKind, Write};
use std::os::unix::process::CommandExt;

use isochrone_testing::{Domain, Ended, assert_says};
use serde_json::Value;

/// A user and a group without rights.
const NOBODY: u32 = 65_534;

fn parsed(ran: &Ended) -> Value {
    serde_json::from_str(&ran.stdout).unwrap()
}

fn severities(document: &Value) -> Vec<&str> {
    let findings = document["findings"].as_array().unwrap();
    findings.iter().map(|finding| finding["severity"].as_str().unwrap()).collect()
}

/// The exit status is that of the worst finding, which stderr counts.
#[track_caller]
fn assert_consistent(ran: &Ended) {
    let document = parsed(ran);
    let severities = severities(&document);
    let is_bad = severities.iter().any(|severity| ["warning", "problem"].contains(severity));
    assert_eq!(ran.code(), i32::from(is_bad), "{}\n{}", ran.stdout, ran.stderr);
    for bad in ["problem", "warning"] {
        let count = severities.iter().filter(|severity| **severity == bad).count();
        assert_eq!(ran.stderr.contains(&format!("{count} {bad}")), count > 0, "{}", ran.stderr);
    }
    assert_eq!(ran.stderr.is_empty(), !is_bad);
}

fn examine_as_nobody() -> Option<Ended> {
    let mut command = Domain::new().command(&["doctor", "--json"]);
    command.current_dir("/").uid(NOBODY).gid(NOBODY);
    match command.output() {
        Ok(output) => Some(Ended::from(output)),
        // Not root, or the program stands where only root may look.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => None,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn this_machine_is_examined_and_the_exit_status_is_that_of_the_worst_finding() {
    let ran = Domain::new().run("doctor --json");
    assert_consistent(&ran);
    let document = parsed(&ran);
    assert!(severities(&document).len() > 20);
    // A clock of coarse ticks may show no time between two readings; this one has fine ones.
    if cfg!(target_arch = "x86_64") {
        assert!(document["environment"]["clock_read_ns"].as_u64() > Some(0), "{document}");
    }
}

#[test]
fn an_ordinary_user_is_told_of_the_rights_that_are_missing() {
    let Some(ran) = examine_as_nobody() else {
        // Past the test harness, which keeps what tests that pass print to itself.
        let _ = writeln!(std::io::stderr(), "NOT TESTED: an ordinary user's rights: not root");
        return;
    };
    assert_consistent(&ran);
    let document = parsed(&ran);
    let mut findings = document["findings"].as_array().unwrap().iter();
    let rights = findings.find(|finding| finding["code"] == "real_time_priority").unwrap();
    assert!(!rights["value"].as_str().unwrap().starts_with("CAP_SYS_NICE"), "{rights}");
}

#[test]
fn the_text_has_the_findings_of_the_document_the_worst_first() {
    let folder = Domain::new();
    let severities = |document: &Value| {
        let findings = document["findings"].as_array().unwrap().iter();
        findings.map(|finding| finding["severity"].clone()).collect::<Vec<_>>()
    };
    // Where the findings of a document stand in a text, the worst first.
    let places = |text: &str, document: &Value| {
        let findings = document["findings"].as_array().unwrap();
        let of = |severity| findings.iter().filter(move |finding| finding["severity"] == severity);
        let worst_first = ["problem", "warning", "note", "ok"].into_iter().flat_map(of);
        let codes =
            worst_first.map(|finding| format!("\n  {} ", finding["code"].as_str().unwrap()));
        codes.map(|code| text.find(&code).unwrap()).collect::<Vec<_>>()
    };
    // A busy machine may be judged differently a moment later, and another CPU be the quiet one: the text is between
    // two documents that agree, of their CPU, and in their order.
    let mut before = parsed(&folder.run("doctor --json"));
    let text = std::iter::repeat_with(|| {
        let (text, after) = (folder.run("doctor").stdout, parsed(&folder.run("doctor --json")));
        let header = format!("CPU {} of {}", after["cpu"], after["online_cpus"].as_str().unwrap());
        let agree = severities(&before) == severities(&after)
            && text.lines().next().unwrap().contains(&header)
            && places(&text, &after).is_sorted();
        before = after;
        agree.then_some(text)
    })
    .take(20)
    .find_map(|found| found)
    .expect("no text of twenty has the findings in order");
    assert_says(text.lines().next().unwrap(), &["doctor"]);
    assert_says(&text, &["Nothing was changed"]);
}

#[test]
fn the_cpu_that_auto_would_choose_is_examined_unless_another_is_named() {
    let folder = Domain::new();
    assert_eq!(parsed(&folder.run("doctor --json --cpu 0"))["cpu"], 0);
    let examined = parsed(&folder.run("doctor --json"));
    let findings = examined["findings"].as_array().unwrap();
    let quiet = findings.iter().find(|finding| finding["code"] == "quiet_cpu").unwrap();
    assert_eq!(quiet["severity"], "ok", "{quiet}");
    let value = quiet["value"].as_str().unwrap();
    assert!(value.starts_with(&format!("CPU {}: ", examined["cpu"])), "{value}");
}

#[test]
fn a_cpu_that_does_not_exist_is_a_usage_error_that_names_those_that_do() {
    for args in ["doctor --cpu 9999", "doctor --cpu 9999 --json"] {
        assert_says(&Domain::new().run(args).refused(2), &["CPU 9999 does not exist", "has 0"]);
    }
    assert_says(
        &Domain::new().run("doctor --cpu last").refused(2),
        &["'last'", "--cpu", "the number of a CPU"],
    );
}

#[test]
fn the_help_says_what_is_read_and_what_the_exit_status_means() {
    let help = Domain::new().run("doctor --help").silently();
    assert_says(&help, &["Changes nothing", "--cpu", "--json", "Exit status: 0", "Examples:"]);
}
