//! `record` and `export`: what is in the file is what was sent, whatever happens meanwhile.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::interpreter;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, FrameSubscriber, ipc};
use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, Ended, Process, wait_for_some, wait_until};
use rustix::process::Signal;
use serde_json::Value;

/// Frames with names of every kind, and values of every kind.
fn frames(rows: usize) -> String {
    let mut text = "ramp.delayedValue,axis.17.y,x-1,level,level.ok\n".to_owned();
    for row in 0..rows {
        let odd = ["NaN", "inf", "-inf", "-0.0", "5e-324"][row % 5];
        text += &format!("{},{odd},{},{}.1,1\n", row as f64 / 3.0, row * row, row);
    }
    text
}

/// Keeps a service in being, so that readers find it before it is written.
fn service(domain: &Domain, name: &str) -> impl Sized + use<> {
    let participant = domain.join("holder");
    let held = FrameSubscriber::<ipc::Service>::open(&participant, name, 5, Depth::Newest).unwrap();
    (held, participant)
}

fn record(domain: &Domain, arguments: &str) -> Process {
    domain.start_until(&format!("record {arguments}"), "Press Ctrl-C to end it.")
}

/// Waits until the recording has so many bytes.
fn wait_until_it_has(domain: &Domain, bytes: u64) {
    wait_until("frames are in the file", || {
        std::fs::metadata(domain.path("out.mcap")).is_ok_and(|file| file.len() > bytes)
    });
}

/// How `export` ends with these arguments: exit status, what it prints, what it says.
fn export(domain: &Domain, arguments: &str) -> (i32, String, String) {
    let ended = domain.run(&format!("export {arguments}"));
    (ended.code(), ended.stdout, ended.stderr)
}

#[track_caller]
fn exported(domain: &Domain, arguments: &str) -> String {
    domain.run(&format!("export {arguments}")).expect_code(0).stdout
}

/// Records 200 frames and subscribes to them, and exports what was recorded.
fn recorded_and_subscribed() -> (Domain, Ended, String) {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    domain.write("in.csv", frames(200));
    let recorder = record(&domain, "plant/level -o out.mcap --json");
    let line = "subscribe plant/level --csv subscribed.csv --columns sequence,publish_ns,flags";
    let subscriber = domain.start_until(line, "subscribed to");
    domain.run("publish plant/level --csv in.csv --rate 500").expect_code(0);
    domain.wait_for_rows("subscribed.csv", 200);
    subscriber.stop().expect_code(0);
    let ended = recorder.stop().expect_code(0);
    let columns = "out.mcap --columns sequence,publish_ns,flags -o out.csv";
    let (_, _, said) = export(&domain, columns);
    (domain, ended, said)
}

#[test]
fn a_recording_exported_is_the_csv_of_a_subscriber_bit_for_bit() {
    // A reader that a busy machine keeps from the names for a second goes on without them.
    let has_names = |text: &str| text.lines().next().is_some_and(|line| line.contains("axis.17.y"));
    let (domain, ended, said) = wait_for_some("both readers have the names in time", || {
        Some(recorded_and_subscribed()).filter(|(domain, ..)| {
            has_names(&domain.read("out.csv")) && has_names(&domain.read("subscribed.csv"))
        })
    });
    assert_eq!(domain.read("out.csv"), domain.read("subscribed.csv"));
    assert_eq!(said, "200 frames, 0 lost\n");
    let summary = ended.json();
    assert_eq!(summary["frames"], 200);
    assert_eq!(summary["is_complete"], true);
    assert_eq!(summary["services"][0]["service"], "plant/level");
    assert_eq!(summary["services"][0]["lost"], 0);
    let bytes = std::fs::metadata(domain.path("out.mcap")).unwrap().len();
    assert!(summary["files"][0]["bytes"].as_u64().is_some_and(|data| data > 0 && data < bytes));
}

/// The frames of a recording, as a library of Python reads them.
fn read_in_python(python: &Path, library: &str, file: &Path) -> Vec<Value> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/isochrone/recording/read.py");
    let mut command = Command::new(python);
    command.arg(script).arg(library).arg(file).env("PYTHONDONTWRITEBYTECODE", "1");
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).unwrap();
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn python_reads_names_values_and_times_of_a_recording() {
    let packages = "mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9";
    let Some(python) = interpreter::python("mcap_ros2, rosbags", packages) else { return };
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let sent = frames(50);
    domain.write("in.csv", &sent);
    let mut recorder = record(&domain, "plant/level -o out.mcap");
    domain.run("publish plant/level --csv in.csv --rate 500").expect_code(0);
    recorder
        .wait_for("recording \"plant/level\": ramp.delayedValue, axis.17.y, x-1, level, level.ok");
    recorder.stop().expect_code(0);
    let file = domain.path("out.mcap");
    let with_mcap = read_in_python(&python, "mcap", &file);
    let with_rosbags = read_in_python(&python, "rosbags", &file);
    assert_eq!((with_mcap.len(), with_rosbags.len()), (50, 50));

    // Of each signal, the field that has its values.
    let spelled =
        ["ramp.delayed_value", "axis_17.y", "x_1", "level.value", "level.ok"].map(str::to_owned);
    let signals: Value =
        serde_json::from_str(with_mcap[0]["metadata"]["isochrone.signals"].as_str().unwrap())
            .unwrap();
    let names: BTreeMap<_, _> = signals
        .as_array()
        .unwrap()
        .iter()
        .map(|it| (it["name"].as_str().unwrap(), &it["field"]))
        .collect();
    assert_eq!(names["level"], "level.value");
    assert_eq!(with_mcap[0]["metadata"]["isochrone.service"], "plant/level");

    let mut offsets = Vec::new();
    for ((frame, of_rosbags), row) in with_mcap.iter().zip(&with_rosbags).zip(sent.lines().skip(1))
    {
        assert_eq!(frame["topic"], "/plant/level");
        assert_eq!(frame["type"].as_str().unwrap().len(), "isochrone/msg/PlantLevel".len() + 16);
        for key in ["topic", "type", "log_time", "fields"] {
            assert_eq!(frame[key], of_rosbags[key], "{key}");
        }
        for (field, text) in spelled.iter().zip(row.split(',')) {
            let bytes = text.parse::<f64>().unwrap().to_le_bytes();
            let expected: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(frame["fields"][field], expected.as_str(), "{field} of {row}");
        }
        let ns = |field: &str| frame["fields"][field].as_str().unwrap().parse::<u64>().unwrap();
        let due_ns = ns("frame.release_ns");
        let due_ns = if due_ns == 0 { ns("frame.publish_ns") } else { due_ns };
        offsets.push(frame["log_time"].as_u64().unwrap() - due_ns);
        assert_eq!(
            frame["publish_time"].as_u64().unwrap() - ns("frame.publish_ns"),
            *offsets.last().unwrap()
        );
        assert!(ns("frame.received_ns") > ns("frame.publish_ns"));
    }
    offsets.dedup();
    assert_eq!(offsets.len(), 1, "one clock has one offset");
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
    let first = u128::from(with_mcap[0]["log_time"].as_u64().unwrap());
    assert!((now.as_nanos() - first) / 1_000_000_000 < 600, "Unix time");
}

#[test]
fn frames_that_the_recorder_misses_are_counted_and_marked_where_they_are_missing() {
    let domain = Domain::new();
    let participant = domain.join("observer");
    let mut observer =
        FrameSubscriber::<ipc::Service>::open(&participant, "plant/level", 1, Depth::Newest)
            .unwrap();
    let mut recorder = record(&domain, "plant/level -o out.mcap --json");
    let publisher = domain.start("publish plant/level --value 1 --signals y --rate 2000");
    recorder.wait_for("recording \"plant/level\": y");
    // What waits for a reader that is stopped is a buffer of 256 frames.
    recorder.signal(Signal::STOP);
    let mut sent = || observer.newest(Monotonic.now_ns()).map(|frame| frame.header().sequence);
    let mut last = None;
    wait_until("a frame comes", || {
        last = sent();
        last.is_some()
    });
    wait_until("more than a buffer was sent", || sent() > last.map(|last| last + 600));
    recorder.signal(Signal::CONT);
    let ended = recorder.stop().expect_code(0);
    publisher.stop().expect_code(0);
    let summary = ended.json();
    let (frames, lost) = (summary["frames"].as_u64(), summary["services"][0]["lost"].as_u64());
    let (frames, lost) = (frames.unwrap(), lost.unwrap());
    assert!(lost > 0 && frames > 0, "{summary}");
    let (_, rows, said) = export(&domain, "out.mcap -o -");
    assert_eq!(said, format!("{frames} frames, {lost} lost\n"));
    assert_eq!(rows.lines().count() as u64, frames + 1);

    if let Some(python) = interpreter::python("mcap_ros2, rosbags", "mcap-ros2-support rosbags") {
        let messages = read_in_python(&python, "mcap", &domain.path("out.mcap"));
        let marks = messages.iter().filter(|message| message["topic"] == "/isochrone/marks");
        let marked = marks.map(|mark| {
            assert_eq!(mark["fields"]["kind"], "lost");
            mark["fields"]["count"].as_str().unwrap().parse::<u64>().unwrap()
        });
        assert_eq!(marked.sum::<u64>(), lost);
        let field = |message: &Value, field: &str| {
            message["fields"][field].as_str().map(|number| number.parse::<u64>().unwrap())
        };
        let gaps: u64 = messages.iter().filter_map(|message| field(message, "frame.lost")).sum();
        assert_eq!(gaps, lost);
    }
}

#[test]
fn a_publisher_that_comes_back_with_other_signals_is_recorded_as_another_layout() {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let mut recorder = record(&domain, "plant/level -o out.mcap --json");
    for signals in ["y", "y,z"] {
        let values = signals.replace('y', "1").replace('z', "2");
        let line = format!(
            "publish plant/level --value {values} --signals {signals} --rate 500 --count 100"
        );
        domain.run(&line).expect_code(0);
    }
    recorder.wait_for("\"plant/level\" has changed, and now carries y, z");
    let ended = recorder.stop().expect_code(0);
    let summary = ended.json();
    let service = &summary["services"][0];
    assert_eq!((&service["layouts"], &service["restarts"]), (&2.into(), &1.into()), "{summary}");
    let rows = exported(&domain, "out.mcap -o -");
    let heads: Vec<&str> = rows.lines().filter(|row| row.starts_with("time_s")).collect();
    assert_eq!(heads, ["time_s,cycle,y", "time_s,cycle,y,z"]);
    assert_eq!(rows.lines().count(), 202);
}

#[test]
fn what_a_killed_recorder_has_written_is_read_and_closed() {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let recorder = record(&domain, "plant/level -o out.mcap");
    let publisher = domain.start("publish plant/level --value 1 --signals y --rate 500");
    wait_until_it_has(&domain, 20_000);
    recorder.kill();
    publisher.stop().expect_code(0);
    let (code, rows, said) = export(&domain, "out.mcap -o -");
    assert_eq!(code, 4, "{said}");
    assert!(rows.lines().count() > 100, "{rows}");
    assert!(said.contains("out.mcap was not closed"), "{said}");
    let (code, _, said) = export(&domain, "out.mcap -o closed.mcap");
    assert!(code == 0 && said.contains("closed.mcap: "), "{said}");
    let (code, again, said) = export(&domain, "closed.mcap -o -");
    assert_eq!((code, again), (4, rows));
    assert!(said.contains("closed.mcap is a copy of a recording that was not closed"), "{said}");
}

#[test]
fn a_damaged_recording_is_exported_without_what_is_damaged_and_is_no_success() {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let recorder = record(&domain, "plant/level -o out.mcap");
    let publisher = domain.start("publish plant/level --value 1 --signals y --rate 500");
    // Two chunks: one describes the signals, the other will be damaged.
    for bytes in [20_000, 40_000] {
        wait_until_it_has(&domain, bytes);
    }
    recorder.stop().expect_code(0);
    publisher.stop().expect_code(0);
    let mut bytes = std::fs::read(domain.path("out.mcap")).unwrap();
    let is_zstd = |four: &[u8]| four == [0x28, 0xb5, 0x2f, 0xfd];
    let chunk = bytes.windows(4).rposition(is_zstd).unwrap();
    bytes[chunk + 20] ^= 0xff;
    std::fs::write(domain.path("out.mcap"), bytes).unwrap();
    let (code, _, said) = export(&domain, "out.mcap -o closed.mcap");
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("out.mcap is damaged: 1 part left out, the first at byte"), "{said}");
    let (code, of_damaged, _) = export(&domain, "out.mcap -o -");
    assert_eq!(code, 4);
    let rows = exported(&domain, "closed.mcap --incomplete -o -");
    assert!(rows.lines().count() > 100 && rows == of_damaged, "{rows}");
}

#[test]
fn a_recording_in_several_files_lacks_no_frame() {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let recorder = record(&domain, "plant/level -o out.mcap --split 1s --json");
    let line = "publish plant/level --wave sine --signals y --frequency 1 --rate 200 --count 600";
    domain.run(line).expect_code(0);
    let ended = recorder.stop().expect_code(0);
    let summary = ended.json();
    let files: Vec<&str> = summary["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["path"].as_str().unwrap())
        .collect();
    assert!(files.len() > 1 && files[..2] == ["out_0001.mcap", "out_0002.mcap"], "{summary}");
    let rows = exported(&domain, &format!("{} -o -", files.join(" ")));
    assert_eq!(rows.lines().count(), 601, "one header");
    let cycles: Vec<u64> =
        rows.lines().skip(1).map(|row| row.split(',').nth(1).unwrap().parse().unwrap()).collect();
    assert!(cycles.is_sorted(), "{cycles:?}");
    assert!(!domain.path("out.mcap").exists());

    // A file that is left out, and one that comes too late.
    let (code, _, err) = export(&domain, &format!("{} {} -o -", files[0], files[2]));
    let left_out = &summary["files"][1]["frames"];
    assert!(code == 0 && err.contains(&format!(" frames, {left_out} lost")), "{err}");
    for twisted in [[files[1], files[0]], [files[0], files[0]]] {
        let (code, _, err) = export(&domain, &format!("{} -o -", twisted.join(" ")));
        assert!(code == 1 && err.contains("in the order of recording"), "{err}");
    }
}

#[test]
fn a_node_stands_for_its_services_and_without_a_name_all_are_recorded() {
    let domain = Domain::new();
    let (all, of_node) =
        (record(&domain, "-o all.mcap --json"), record(&domain, "relay -o node.mcap --json"));
    let node = domain.start_node("relay.toml", RELAY, "");
    let publisher = domain.start("publish relay/in --value 5 --rate 500");
    let services = |recorder: Process, names: &[&str]| {
        let mut recorder = recorder;
        for name in names {
            recorder.wait_for(&format!("recording \"{name}\": "));
        }
        let summary = recorder.stop().expect_code(0).json();
        let services = summary["services"].as_array().unwrap().iter();
        let mut services: Vec<String> =
            services.map(|service| service["service"].as_str().unwrap().to_owned()).collect();
        services.sort();
        assert_eq!(services, names);
    };
    services(of_node, &["relay/out"]);
    services(all, &["relay/in", "relay/out"]);
    publisher.stop().expect_code(0);
    node.stop().expect_code(0);
    domain.expect("export all.mcap -o -", 2, &["choose one with --service: relay/"]);
    domain.expect("export all.mcap --service relay/ou -o -", 2, &["did you mean \"relay/out\"?"]);
    assert!(exported(&domain, "all.mcap --service relay/out -o -").starts_with("time_s,cycle,x\n"));
}

#[test]
fn a_full_disk_ends_the_recording_with_a_count_of_what_is_lost() {
    let domain = Domain::new();
    let _held = service(&domain, "plant/level");
    let recorder = record(&domain, "plant/level -o /dev/full --json");
    let _publisher = domain.start("publish plant/level --value 1 --rate 500");
    let ended =
        recorder.finish().expect_code(1).says(&["cannot write /dev/full: No space left on device"]);
    let summary = ended.json();
    assert_eq!(summary["is_complete"], false);
    let unwritten = summary["unwritten_frames"].as_u64().unwrap();
    assert!(unwritten > 0 && unwritten == summary["services"][0]["unwritten"], "{summary}");
    assert_eq!(summary["services"][0]["frames"], 0);
    let says = format!("with 0 frames in this file, and {unwritten} frame");
    assert!(ended.stderr.contains(&says), "{}", ended.stderr);
    assert!(!ended.stderr.contains("isochrone export"), "{}", ended.stderr);
}

#[test]
fn nothing_recorded_is_no_success_and_leaves_no_file() {
    let domain = Domain::new();
    domain.expect("record -o out.mcap --seconds 0.2", 3, &["there is no service to record"]);
    let _held = service(&domain, "plant/level");
    let ended =
        domain.run("record plant/levl plant/level -o out.mcap --seconds 0.2").expect_code(3);
    let did_you_mean = "\"plant/levl\", which does not exist yet; did you mean \"plant/level\"?";
    assert!(ended.stderr.contains(did_you_mean), "{}", ended.stderr);
    assert!(ended.stderr.contains("nothing was sent on \"plant/level\""), "{}", ended.stderr);
    assert!(!domain.path("out.mcap").exists());
}

#[test]
fn what_is_no_recording_is_refused_with_the_reason() {
    let domain = Domain::with(&[("a.mcap", "time_s,cycle,y\n0,1,2\n"), ("empty.mcap", "")]);
    std::fs::hard_link(domain.path("a.mcap"), domain.path("also_a.csv")).unwrap();
    for (arguments, says) in [
        ("a.mcap -o out.csv", "cannot read a.mcap: it is no MCAP file"),
        ("empty.mcap -o out.mcap", "cannot read empty.mcap: it is no MCAP file"),
        ("missing.mcap -o out.csv", "cannot read missing.mcap: No such file"),
        ("a.mcap -o a.mcap", "a.mcap would overwrite what is read"),
        ("a.mcap -o also_a.csv", "also_a.csv would overwrite what is read"),
        ("a.mcap empty.mcap -o out.mcap", "close one recording at a time"),
        ("a.mcap --service x -o out.mcap", "--service is for CSV"),
    ] {
        domain.expect(&format!("export {arguments}"), 2, &[says]);
    }
    assert!(!domain.path("out.csv").exists() && !domain.path("out.mcap").exists());
    domain.expect("record -o missing/out.mcap", 2, &["cannot write missing/out.mcap"]);
    domain.expect("record -o out.mcap --split 5", 2, &["neither a time nor a size"]);
}
