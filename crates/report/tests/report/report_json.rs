//! The JSON document, against the sample `run.json`.

use isochrone_report::Report;
use isochrone_timing::{Summary, TaskReport};
use serde_json::Value;

const SAMPLE: &str = r#"{
  "isochrone": "0.1.0",
  "command": ["run", "level.toml", "--cycles", "60000"],
  "started": "2026-11-20T12:00:00Z",
  "environment": { "kernel": "6.18", "preempt": "full", "cpus": 2, "hypervisor": "kvm", "clocksource": "tsc", "clock_read_ns": 42, "governor": null, "isolated_cpus": "", "rt_throttling": "950000/1000000" },
  "warnings": [ { "code": "rt_denied", "message": "no", "remedy": "do" } ],
  "tasks": [ {
    "name": "fast", "period_ns": 1000000, "wake": "hybrid", "scheduler": "fifo:80", "cpu": 1,
    "cycles": 60000, "missed": 0, "overruns": 0,
    "release_jitter_ns": { "count": 60000, "min": 41, "mean": 105.2, "p50": 98, "p90": 150, "p99": 260, "p99_9": 2100, "p99_99": 52000, "max": 231000 },
    "execution_ns": { }, "response_ns": { }, "period_error_ns": { },
    "cpu_fraction": 0.06, "allocations": 0, "minor_faults": 0, "voluntary_switches": 60000, "involuntary_switches": 0,
    "block_errors": 0, "input_rejects": 0, "connects": 2
  } ],
  "links": [ { "service": "plant/level", "frames": 60000, "lost": 0, "one_way_ns": { }, "end_to_end_ns": { } } ]
}"#;

/// A whole document, as `run` writes it: tasks and links with all of their keys, and with as few as they have.
const RUN: &str = include_str!("run.json");

/// Every key and value of `part` stands in `whole`; `whole` may have more keys.
fn assert_contains(whole: &Value, part: &Value, path: &str) {
    match (whole, part) {
        (Value::Object(whole), Value::Object(part)) => {
            for (key, value) in part {
                let path = format!("{path}.{key}");
                assert!(whole.contains_key(key), "{path} is missing");
                assert_contains(&whole[key], value, &path);
            }
        }
        (Value::Array(whole), Value::Array(part)) => {
            assert_eq!(whole.len(), part.len(), "{path}");
            whole.iter().zip(part).for_each(|(whole, part)| assert_contains(whole, part, path));
        }
        _ => assert_eq!(whole, part, "{path}"),
    }
}

#[test]
fn a_report_written_again_has_every_key_and_value_of_the_specified_sample() {
    let report: Report = serde_json::from_str(SAMPLE).unwrap();
    let written = serde_json::to_value(&report).unwrap();
    assert_contains(&written, &serde_json::from_str(SAMPLE).unwrap(), "report");
}

#[test]
fn the_document_of_a_run_is_the_same_byte_for_byte_when_it_is_written_again() {
    let report: Report = serde_json::from_str(RUN).unwrap();
    let written = serde_json::to_string_pretty(&report).unwrap() + "\n";
    if std::env::var("ISOCHRONE_TEST_PAGES").is_ok_and(|pages| pages == "write") {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/report/run.json");
        return std::fs::write(file, written).unwrap();
    }
    assert_eq!(
        written, RUN,
        "ISOCHRONE_TEST_PAGES=write cargo test -p isochrone-report writes run.json with a new field"
    );
}

#[test]
fn a_report_reads_back_as_it_was_written() {
    let report: Report = serde_json::from_str(SAMPLE).unwrap();
    let json = serde_json::to_string(&report).unwrap();
    assert_eq!(serde_json::from_str::<Report>(&json).unwrap(), report);
}

#[test]
fn keys_of_a_later_version_are_ignored() {
    let json = r#"{"isochrone": "9.0.0", "colour": 7, "tasks": [{"name": "fast", "smell": [1]}]}"#;
    let report: Report = serde_json::from_str(json).unwrap();
    assert_eq!(report.tasks[0].task.name, "fast");
}

#[test]
fn a_document_that_is_no_report_is_an_error() {
    assert!(serde_json::from_str::<Report>(r#"{"tasks": []}"#).is_err());
}

#[test]
fn a_percentile_without_enough_samples_has_no_key() {
    let task = TaskReport {
        execution_ns: Summary { count: 1, max: Some(5), ..Summary::default() },
        ..TaskReport::default()
    };
    let json = serde_json::to_value(&task).unwrap();
    assert_eq!(json["execution_ns"], serde_json::json!({"count": 1, "max": 5}));
    assert_eq!(json["cpu"], Value::Null);
}

#[test]
fn a_new_report_starts_now_in_utc_with_whole_seconds() {
    let report = Report::new(vec!["run".to_owned()], Default::default());
    let started: jiff::Timestamp = report.started.parse().unwrap();
    let age = jiff::Timestamp::now().duration_since(started);
    assert!((0..60).contains(&age.as_secs()), "{}", report.started);
    assert_eq!(report.started.len(), "2026-11-20T12:00:00Z".len());
    assert_eq!(report.isochrone, env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_report_of_earlier_versions_whose_turns_were_called_blocks_reads_as_well() {
    let json = r#"{"isochrone": "0.1.0",
        "tasks": [{"name": "hybrid", "blocks": [{"samples": 7}]}],
        "links": [{"service": "iceoryx2", "blocks": [{"samples": 8}]}],
        "costs": [{"name": "mixed", "blocks": [{"samples": 9}]}]}"#;
    let report: Report = serde_json::from_str(json).unwrap();
    let (task, link, cost) = (&report.tasks[0], &report.links[0], &report.costs[0]);
    let turns = [&task.turns, &link.turns, &cost.turns].map(|turns| turns[0].samples);
    assert_eq!(turns, [7, 8, 9]);
    let written = serde_json::to_value(&report).unwrap();
    assert_eq!(written["tasks"][0]["turns"][0]["samples"], 7);
}
