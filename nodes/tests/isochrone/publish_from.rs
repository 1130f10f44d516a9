//! `publish --from`: what was recorded is published again, with its values, names and distances.

use crate::recorded_run;
use crate::recorded_run::{CYCLES, MISSED};
use isochrone_ipc::{Depth, FrameSubscriber, ipc};
use isochrone_recording::{Carried, ClockReading, Item, Reader, Writer};
use isochrone_testing::{Domain, Process};

/// A frame that was recorded.
struct Frame {
    service: String,
    names: Vec<String>,
    period_ns: Option<u64>,
    cycle: u64,
    release_ns: u64,
    flags: u64,
    bits: Vec<u64>,
    lost: u64,
}

fn frames(domain: &Domain, name: &str) -> Vec<Frame> {
    let mut reader = Reader::open(std::fs::File::open(domain.path(name)).unwrap()).unwrap();
    let mut frames = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        let Item::Frame(frame) = item else { continue };
        frames.push(Frame {
            service: frame.carried.service.clone(),
            names: frame.carried.signals.iter().map(|signal| signal.name.clone()).collect(),
            period_ns: frame.carried.period_ns,
            cycle: frame.header.cycle,
            release_ns: frame.header.release_ns,
            flags: frame.header.flags,
            bits: frame.values.iter().map(|value| value.to_bits()).collect(),
            lost: frame.lost,
        });
    }
    frames
}

fn of<'a>(frames: &'a [Frame], service: &str) -> Vec<&'a Frame> {
    frames.iter().filter(|frame| frame.service == service).collect()
}

/// Keeps services in being, so that readers find them before they are written.
fn services(domain: &Domain, names: &[&str]) -> impl Sized {
    let participant = domain.join("holder");
    let open = |name: &&str| {
        FrameSubscriber::<ipc::Service>::open(&participant, name, 3, Depth::Newest).unwrap()
    };
    let held: Vec<_> = names.iter().map(open).collect();
    (held, participant)
}

fn record(domain: &Domain, arguments: &str) -> Process {
    domain.start_until(&format!("record {arguments}"), "Press Ctrl-C to end it.")
}

fn csv(first: u64, rows: u64) -> String {
    let rows = (0..rows).map(|row| format!("{},{}.5,{}\n", row as f64 / 3.0, first + row, row % 2));
    "ramp.y,x-1,NaN\n".to_owned() + &rows.collect::<String>()
}

/// What stands between the releases of one frame and the next, in ns, and their values.
fn steps(frames: &[&Frame]) -> Vec<(u64, u64, Vec<u64>)> {
    let first = frames[0].release_ns;
    let of = |frame: &&Frame| (frame.release_ns - first, frame.flags, frame.bits.clone());
    frames.iter().map(of).collect()
}

#[test]
fn a_recording_of_two_services_that_is_published_and_recorded_again_is_the_same() {
    let domain = Domain::new();
    let _held = services(&domain, &["plant/a", "plant/b"]);
    domain.write("a.csv", csv(0, 150));
    domain.write("b.csv", csv(1000, 60));
    let recorder = record(&domain, "plant/a plant/b -o first.mcap");
    let a = domain.publish("plant/a --csv a.csv --rate 500");
    domain.run("publish plant/b --csv b.csv --rate 250").expect_code(0);
    a.finish().expect_code(0);
    recorder.stop().expect_code(0);
    let first = frames(&domain, "first.mcap");

    let recorder = record(&domain, "plant/a plant/b -o second.mcap");
    let ended = domain.run("publish --from first.mcap --json").expect_code(0);
    recorder.stop().expect_code(0);
    let summary = ended.json();
    let second = frames(&domain, "second.mcap");
    for (place, (service, count)) in [("plant/a", 150), ("plant/b", 60)].into_iter().enumerate() {
        let (was, is) = (of(&first, service), of(&second, service));
        assert_eq!((was.len(), is.len()), (count, count), "{service}");
        assert_eq!(steps(&was), steps(&is), "{service}");
        for (was, is) in was.iter().zip(&is) {
            assert_eq!((&was.names, was.period_ns, was.cycle), (&is.names, is.period_ns, is.cycle));
            assert_eq!(is.lost, 0);
        }
        assert_eq!(summary["services"][place]["service"], service);
        assert_eq!(summary["services"][place]["frames"], count);
        assert_eq!(summary["services"][place]["unsent"], 0);
    }
    // Both services keep their relation in time.
    let between = |frames: &[Frame]| {
        let [a, b] = ["plant/a", "plant/b"].map(|service| of(frames, service)[0].release_ns);
        b.wrapping_sub(a)
    };
    assert_eq!(between(&first), between(&second));

    // Half as fast, and one of them.
    let recorder = record(&domain, "plant/b -o slow.mcap");
    let ended = domain.run("publish --from first.mcap plant/b --speed 0.5").expect_code(0);
    assert_eq!(ended.stdout, "published 60 frames on \"plant/b\", 0 could not be sent\n");
    recorder.stop().expect_code(0);
    let slow = frames(&domain, "slow.mcap");
    let twice = |(ns, flags, bits): (u64, u64, Vec<u64>)| (2 * ns, flags, bits);
    let was: Vec<_> = steps(&of(&first, "plant/b")).into_iter().map(twice).collect();
    assert_eq!(steps(&of(&slow, "plant/b")), was);
    assert_eq!(
        slow[0].period_ns,
        first.iter().find(|it| it.service == "plant/b").unwrap().period_ns.map(|ns| 2 * ns)
    );

    domain.run("publish --from first.mcap --speed max").expect_code(0);
}

#[test]
fn a_service_that_changed_its_signals_does_so_again() {
    let domain = Domain::new();
    let _held = services(&domain, &["plant/a"]);
    domain.write("a.csv", "x\n1\n2\n3\n");
    domain.write("b.csv", "y,z\n4,5\n6,7\n");
    let recorder = record(&domain, "plant/a -o first.mcap");
    domain.run("publish plant/a --csv a.csv --rate 100").expect_code(0);
    domain.run("publish plant/a --csv b.csv --rate 100").expect_code(0);
    recorder.stop().expect_code(0);
    let recorder = record(&domain, "plant/a -o second.mcap");
    let ended = domain.run("publish --from first.mcap").expect_code(0);
    assert_eq!(ended.stdout, "published 5 frames on \"plant/a\", 0 could not be sent\n");
    recorder.stop().expect_code(0);
    let names = |name: &str| -> Vec<_> {
        frames(&domain, name).into_iter().map(|frame| (frame.names, frame.bits)).collect()
    };
    assert_eq!(names("first.mcap"), names("second.mcap"));
}

#[test]
fn of_the_recording_of_a_node_its_output_services_are_published() {
    let domain = Domain::new();
    recorded_run::record(&domain.path("run.mcap"));
    let _held = services(&domain, &["plant/level", "plant/slow"]);
    let recorder = record(&domain, "plant/level plant/slow -o again.mcap");
    let ended = domain.run("publish --from run.mcap").expect_code(0);
    recorder.stop().expect_code(0);
    let cycles = CYCLES - (MISSED.end - MISSED.start);
    for (service, count) in [("plant/level", cycles), ("plant/slow", CYCLES / 4)] {
        let said = format!("published {count} frames on \"{service}\", 0 could not be sent\n");
        assert!(ended.stdout.contains(&said), "{}", ended.stdout);
    }
    let again = frames(&domain, "again.mcap");
    let level = of(&again, "plant/level");
    assert_eq!(level.len() as u64, cycles);
    assert_eq!(level[0].names, ["ramp.delayedValue", "back.delayedValue", "target"]);
    assert!(level.windows(2).all(|pair| pair[0].cycle < pair[1].cycle));
    let missed = level.windows(2).find(|pair| pair[1].cycle == MISSED.end).unwrap();
    assert_eq!(missed[1].release_ns - missed[0].release_ns, 14_000_000);
}

#[test]
fn what_cannot_be_published_is_refused_with_the_way_out() {
    let domain = Domain::new();
    recorded_run::record(&domain.path("run.mcap"));
    let refused = |arguments: &str, code: i32, says: &str| {
        domain.expect(arguments, code, &[says]);
    };
    refused("publish --from run.mcap plant/levl", 2, "did you mean \"plant/level\"?");
    refused("publish --from run.mcap isochrone/level/telemetry", 2, "\"isochrone/\" are for");
    refused("publish --from none.mcap", 2, "cannot read none.mcap");
    refused("publish --from run.mcap --rate 10", 2, "--rate");
    refused("publish --from run.mcap --speed 0", 2, "give a factor from 0.001 to 1000");
    refused("publish plant/a plant/b --value 1", 2, "name one");
    refused("publish --speed max plant/a --value 1", 2, "--speed");

    let writer = domain.publish("plant/slow --value 1");
    refused("publish --from run.mcap plant/slow", 1, "plant/slow");
    writer.stop().expect_code(0);

    // What is damaged is left out, and said at the end.
    let mut bytes = std::fs::read(domain.path("run.mcap")).unwrap();
    let is_chunk = |bytes: &[u8]| bytes == [0x28, 0xb5, 0x2f, 0xfd];
    // The first has the descriptions of the channels.
    let chunk = bytes.windows(4).rposition(is_chunk).unwrap();
    bytes[chunk + 200] ^= 0x10;
    std::fs::write(domain.path("bad.mcap"), bytes).unwrap();
    let ended = domain.expect(
        "publish --from bad.mcap plant/level --speed max",
        4,
        &["bad.mcap is damaged: 1 part left out"],
    );
    assert!(ended.stdout.starts_with("published "), "{}", ended.stdout);
}

/// Begins a recording of services.
fn written(file: std::fs::File) -> Writer<std::fs::File> {
    Writer::create(file, ClockReading { monotonic_ns: 0, unix_ns: 1_795_000_000_000_000_000 })
        .unwrap()
}

fn carried(service: String) -> Carried {
    let signals = vec![isochrone_ipc::SignalSpec::new("x", "LREAL")];
    Carried { service, signals, ..Carried::default() }
}

fn frame(due_ns: u64) -> isochrone_recording::Frame<'static> {
    let header = Default::default();
    let (received_ns, sent_ns, lost) = (due_ns, due_ns, 0);
    isochrone_recording::Frame { header, values: &[1.0], received_ns, due_ns, sent_ns, lost }
}

#[test]
fn what_was_not_published_is_said_and_what_was_not_read_is_not_judged() {
    let domain = Domain::new();
    let mut writer = written(std::fs::File::create(domain.path("far.mcap")).unwrap());
    let channel = writer.add(&carried("plant/a".into())).unwrap();
    for due_ns in [1_000_000, 2_000_000, 500 * 31_557_600 * 1_000_000_000] {
        writer.write(channel, &frame(due_ns)).unwrap();
    }
    writer.finish().map_err(|(error, _)| error).unwrap();
    recorded_run::record(&domain.path("run.mcap"));
    let ended = domain.run("publish --from far.mcap --count 1").expect_code(0);
    assert_eq!(ended.stdout, "published 1 of 3 frames on \"plant/a\", 0 could not be sent\n");
    assert!(!ended.stderr.contains("closed"), "{}", ended.stderr);
    let waiting =
        domain.start_until("publish --from far.mcap", "note: the next frame is due in 499 years");
    let ended = waiting.stop().expect_code(0);
    assert!(!ended.stderr.contains("late"), "{}", ended.stderr);
}

#[test]
fn more_services_than_one_would_want_have_to_be_named() {
    let domain = Domain::new();
    let mut writer = written(std::fs::File::create(domain.path("many.mcap")).unwrap());
    for service in 0..101 {
        let channel = writer.add(&carried(format!("plant/s{service}"))).unwrap();
        writer.write(channel, &frame(service)).unwrap();
    }
    writer.finish().map_err(|(error, _)| error).unwrap();
    let ended = domain.run("publish --from many.mcap --speed max").expect_code(2);
    let says = "has 101 services, and without names at most 100 are published";
    assert!(ended.stderr.contains(says), "{}", ended.stderr);
    let ended = domain.run("publish --from many.mcap plant/s7 --speed max").expect_code(0);
    assert_eq!(ended.stdout, "published 1 frame on \"plant/s7\", 0 could not be sent\n");
}

#[test]
fn a_signal_ends_the_first_reading_of_a_file() {
    let domain = Domain::new();
    for (verb, code, says) in [
        ("publish --from", 0, "nothing was published"),
        ("replay", 4, "the replay was stopped while it first read"),
    ] {
        let name = format!("{}.mcap", verb.len());
        let pipe = domain.path(&name);
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let mut running = domain.start(&format!("{verb} {name}"));
        let (begins, begun) = std::sync::mpsc::channel();
        // A file without an end.
        let feed = std::thread::spawn(move || {
            let mut writer = written(std::fs::File::create(pipe).unwrap());
            let channel = writer.add(&carried("plant/a".into())).unwrap();
            while writer.write(channel, &frame(1)).is_ok() && writer.flush().is_ok() {
                let _ = begins.send(());
            }
        });
        running.wait_until_it_handles_signals();
        begun.recv().unwrap();
        running.stop().expect_code(code).says(&[says]);
        feed.join().unwrap();
    }
}
