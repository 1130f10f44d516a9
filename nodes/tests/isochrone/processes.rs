//! The verbs that talk to each other: how they end, and what they report.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use isochrone_processes::Child;
use isochrone_testing::plants::tank;
use isochrone_testing::{Domain, PATIENCE, Plant, wait_until};
use rustix::process::Signal;

fn clock() -> Plant {
    Plant::new("clock")
        .task("fast", "1ms")
        .with("ob = 35")
        .task("slow", "5ms")
        .with("phase = \"1ms\"")
        .on("fast")
        .input("x", "clock/in", "")
        .saw("saw", "incrementRange = 1, endlessSteps = true")
        .on("slow")
        .times(2.0, "level", "\"saw.value\"")
        .on("fast")
        .output("clock/fast", &["saw.value", "x"])
        .on("slow")
        .output("clock/slow", &["level.y", "saw.value", "x"])
}

fn domain() -> Domain {
    Domain::with(&[("node.toml", &clock())])
}

#[test]
fn sigint_and_sigterm_end_every_verb_with_its_summary() {
    for signal in [Signal::INT, Signal::TERM] {
        let (domain, node) = tank(&clock());
        let publisher = domain.publish("clock/in --wave sine,step");
        let stats = domain.start("subscribe clock/fast --stats --csv stats.csv");
        let lines = domain.start_until("subscribe clock/slow", "level.y=");
        // A stats subscriber that saw nothing would say so.
        domain.wait_for_rows("stats.csv", 1);
        for (process, summary) in [
            (stats, "last hop"),
            (lines, "0 lost"),
            (node, "release jitter"),
            (publisher, "published"),
        ] {
            process.signal(signal);
            let ended = process.finish().expect_code(0);
            assert!((ended.stdout + &ended.stderr).contains(summary), "{summary}");
        }
        domain.expect_no_leftovers();
    }
}

#[test]
fn a_node_whose_log_nobody_reads_any_more_goes_on_and_reports() {
    let domain = domain();
    let mut command = domain.command(&["run", "node.toml", "--report", "node.json"]);
    let (reader, writer) = std::io::pipe().unwrap();
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(writer);
    let mut node = Child::start("node", &mut command).unwrap();
    drop(command);
    let mut log = BufReader::new(reader).lines();
    while !log.next().unwrap().unwrap().contains("is running") {}
    drop(log);
    let mut observer = domain.start_until("subscribe clock/fast", "x=");
    // The node logs its input's first sample.
    let publisher = domain.publish("clock/in --value 7");
    observer.wait_for("x=7.0");
    publisher.stop().expect_code(0);
    node.signal(Signal::TERM);
    let ended = node.wait_within(PATIENCE).unwrap().expect("the node does not end");
    assert_eq!(ended.code(), Some(0));
    observer.stop().expect_code(0);
    assert!(domain.json("node.json")["tasks"][0]["cycles"].as_u64() > Some(0));
    domain.expect_no_leftovers();
}

#[test]
fn a_simulation_that_is_stopped_keeps_the_rows_it_has() {
    let domain = domain();
    let simulation = domain.start("simulate node.toml --cycles 1000000000 --output out.csv");
    let length = || std::fs::metadata(domain.path("out.csv")).map_or(0, |file| file.len());
    wait_until("rows are written", || length() > 0);
    simulation.stop().expect_code(0).says(&["of 1000000000 cycles"]);
    let rows = domain.read("out.csv");
    let columns = |row: &str| row.split(',').count();
    assert!(rows.ends_with('\n') && rows.lines().all(|row| columns(row) == 6), "no row is cut");
}

#[test]
fn a_node_with_an_hour_long_period_ends_on_a_signal_too() {
    let domain = Domain::new();
    let hourly =
        "[node]\nname = \"h\"\n[[task]]\nname = \"t\"\nperiod = \"1h\"\nphase = \"59min\"\n";
    let _node = domain.start_node("hour.toml", hourly, "");
}

#[test]
fn run_reports_every_task_and_link() {
    let domain = Domain::new();
    let arguments = "--cycles 400 --report node.json --json";
    let node = domain.start_node("node.toml", &clock(), arguments);
    let publisher = domain.start("publish clock/in --value 1");
    let ended = node.finish().expect_code(0);
    publisher.stop().expect_code(0);
    let report = domain.json("node.json");
    assert_eq!(ended.json(), report);
    let tasks = report["tasks"].as_array().unwrap();
    let [fast, slow] = tasks.as_slice() else { panic!("{tasks:?}") };
    assert_eq!((&fast["name"], &fast["cycles"]), (&"fast".into(), &400.into()));
    assert_eq!((&slow["name"], &slow["period_ns"]), (&"slow".into(), &5_000_000.into()));
    let measured = fast["cycles"].as_u64().unwrap() - fast["warm_up_cycles"].as_u64().unwrap();
    for distribution in ["release_jitter_ns", "execution_ns", "response_ns", "period_error_ns"] {
        assert_eq!(fast[distribution]["count"], measured, "{distribution}");
        assert!(fast[distribution]["max"].as_u64() >= fast[distribution]["p50"].as_u64());
    }
    let links = report["links"].as_array().unwrap();
    let services: Vec<&str> = links.iter().map(|link| link["service"].as_str().unwrap()).collect();
    assert_eq!(services, ["clock/in", "clock/fast", "clock/slow"]);
    assert_eq!(links[1]["frames"], 400);
    assert!(report["environment"]["cpus"].as_u64() > Some(0));
    assert_eq!(report["command"][0], "run");
}

#[test]
fn frames_that_newer_ones_pushed_out_are_reported_as_lost() {
    let domain = Domain::new();
    let slow = clock().replace("period = \"1ms\"", "period = \"50ms\"");
    let node = domain.start_node("slow.toml", &slow, "--report node.json");
    let ended = domain.run("publish clock/in --value 1 --rate 1000 --count 500 --json");
    let sent = ended.expect_code(0).json();
    node.stop().expect_code(0);
    let report = domain.json("node.json");
    let link = &report["links"][0];
    let (frames, lost) = (link["frames"].as_u64().unwrap(), link["lost"].as_u64().unwrap());
    assert!(lost > frames, "{link}");
    assert!(frames + lost <= sent["frames"].as_u64().unwrap(), "{link}");
}

#[test]
fn a_report_does_not_overwrite_the_configuration() {
    let domain = domain();
    domain.expect("run node.toml --cycles 5 --report ./node.toml", 2, &["would overwrite"]);
    assert_eq!(domain.read("node.toml"), *clock());
}

#[test]
fn stats_tell_rate_loss_and_latency_and_the_age_of_the_input_behind_a_frame() {
    let (domain, _node) = tank(&clock());
    let _publisher = domain.publish("clock/in --value 1");
    let ended = domain.run("subscribe clock/fast --stats --json --count 500 --report link.json");
    let report = ended.expect_code(0).json();
    assert_eq!(report, domain.json("link.json"));
    let link = &report["links"][0];
    assert_eq!((&link["frames"], &link["one_way_ns"]["count"]), (&500.into(), &500.into()));
    assert!(link["rate_hz"].as_f64() > Some(0.0));
    assert!(link["one_way_ns"]["p50"].as_u64() > Some(0));
    // x came from a publisher, and the frame is computed from it.
    assert!(link["end_to_end_ns"]["count"].as_u64() > Some(0));
    assert!(link["end_to_end_ns"]["p50"].as_u64() > link["one_way_ns"]["p50"].as_u64());
}

#[test]
fn a_wire_between_tasks_carries_values_of_one_finished_cycle() {
    let (domain, node) = tank(&clock());
    domain.run("subscribe clock/slow --csv slow.csv --count 300").expect_code(0);
    node.stop().expect_code(0);
    let recorded = domain.read("slow.csv");
    assert_eq!(recorded.lines().next(), Some("time_s,cycle,level.y,saw.value,x"));
    for row in recorded.lines().skip(1) {
        let values: Vec<f64> = row.split(',').map(|value| value.parse().unwrap()).collect();
        assert_eq!(values[2], 2.0 * values[3], "{row}");
    }
}

#[test]
fn where_there_is_nothing_to_talk_to_the_exit_status_is_3() {
    let domain = Domain::new();
    domain.expect("subscribe no/body --seconds 0.2", 3, &["there is no service \"no/body\""]);
    let _node = domain.start_node("node.toml", &clock(), "");
    domain.expect("subscribe clock/in --seconds 0.2", 3, &["has no publisher"]);
}

#[test]
fn what_cannot_be_is_refused_before_anything_starts() {
    let domain = domain();
    domain.write("deaf.toml", clock().replace("service = \"clock/in\"", ""));
    for (arguments, parts) in [
        ("run node.toml --report /no/where.json", ["cannot write", "/no/where.json"]),
        ("run deaf.toml", ["deaf.toml:", "has no service"]),
        ("run node.toml --cycles 0", ["--cycles", "0"]),
        ("run node.toml --seconds -1", ["--seconds", "greater than 0"]),
        ("run node.toml --seconds 1x", ["no unit \"x\"", "500ms"]),
        ("publish clock/in", ["--value", "--wave"]),
        ("publish clock/in --value 1 --rate 0", ["--rate", "frames per second"]),
        ("publish clock/in --value x", ["--value", "x"]),
        ("publish clock/in --csv none.csv", ["none.csv", "No such file"]),
        ("publish clock/in --wave sine --amplitude 1,2", ["--amplitude", "2 values for 1 wave;"]),
        ("publish iox2://x --value 1", ["iox2://", "keeps for itself"]),
        ("subscribe clock/fast --csv /no/where.csv", ["cannot write", "/no/where.csv"]),
        ("subscribe clock/fast --count 0", ["--count", "a whole number, 1 or greater"]),
        ("subscribe clock/fast --every 0", ["--every", "a whole number, 1 or greater"]),
        ("publish clock/in --value 1 --count 0", ["--count", "a whole number, 1 or greater"]),
        ("subscribe clock/fast --json --csv -", ["--csv", "choose one"]),
        ("subscribe clock/fast --columns flags", ["--columns", "--csv"]),
    ] {
        domain.expect(arguments, 2, &parts);
    }
    let elsewhere = domain.start_until("run node.toml --seconds 100ms", "is running");
    elsewhere.finish().expect_code(0);
}

#[test]
fn a_full_disk_is_said() {
    let domain = domain();
    domain.expect("run node.toml --cycles 10 --report /dev/full", 1, &["/dev/full: No space left"]);
    let _node = domain.start_until("run node.toml", "is running");
    domain.expect(
        "subscribe clock/fast --csv /dev/full --count 5000",
        1,
        &["/dev/full: No space left"],
    );
}
