use isochrone_ipc::{FrameHeader, SignalSpec};
use isochrone_recording::{Carried, ClockReading, Frame, Writer};
use isochrone_scope::Triggered;

use super::super::output::Output;
use super::super::text::notes;
use super::*;

const MS: u64 = 1_000_000;

/// Two tasks, each with a row for those of its cycles; each counts the cycles before that are lost or missed.
fn shot() -> Shot {
    let track = |task: &str, period_ns: u64, heads: &[(u64, u64, u64)], next: Option<Head>| {
        let mut rows = Rows::new(1);
        for (cycle, lost, missed) in heads.iter().copied() {
            let head = Head { cycle, release_ns: cycle * period_ns, lost, missed };
            rows.push(head, &[cycle as f64 / 3.0]);
        }
        let signal =
            TrackSignal { name: format!("{task}.y"), unit: "m".into(), value_type: "LREAL".into() };
        let (task, period_ns, signals) = (task.to_owned(), Some(period_ns), vec![signal]);
        Track { task, period_ns, signals, rows, has_history: true, next }
    };
    let fast = [(105, 0, 0), (106, 0, 0), (110, 1, 2), (111, 0, 0), (114, 0, 2), (115, 0, 0)];
    let next = Head { cycle: 123, release_ns: 123 * MS, lost: 2, missed: 5 };
    let slow = [(10, 0, 0), (11, 0, 0)];
    let trigger = Triggered {
        task: "fast".into(),
        cycle: 110,
        release_ns: 110 * MS,
        text: "fast.y > 36.5".into(),
        signal: "fast.y".into(),
        level: Some(36.5),
        lost: 1,
    };
    Shot {
        node: "n".into(),
        tracks: vec![track("fast", MS, &fast, Some(next)), track("slow", 10 * MS, &slow, None)],
        trigger: Some(trigger),
        begin_ns: 100 * MS,
        end_ns: 120 * MS,
    }
}

#[test]
fn a_shot_out_of_its_file_is_the_one_that_was_written_with_what_is_known_of_its_edges() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shot.mcap");
    let clock = Some(ClockReading { monotonic_ns: 0, unix_ns: 1_700_000_000_000_000_000 });
    let captured = Captured { shot: shot(), clock };
    Output::open(&path, false).unwrap().write(&captured).unwrap();
    let window = Window { before_ns: 0, after_ns: MS };
    let look = Look { path: &path, names: &[], window, length_ns: None };
    let (again, judged) = look.capture(None).unwrap();
    assert_eq!(again.shot, captured.shot);
    assert!(judged.is_ok());
    let says = notes(&again.shot);
    assert_eq!(
        says,
        [
            "1 cycle of fast did not arrive; they are shaded",
            "fast missed 4 cycles, in which the values before held; × marks them",
            "1 cycle did not arrive immediately before the trigger: it may have come in one of them",
        ]
    );
}

#[test]
fn cycles_that_were_missed_are_missed_in_a_csv_file_as_well_and_lost_ones_are_lost() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shot.csv");
    let mut shot = shot();
    shot.tracks.truncate(1);
    let captured = Captured { shot, clock: None };
    Output::open(&path, false).unwrap().write(&captured).unwrap();
    let window = Window { before_ns: 0, after_ns: MS };
    let look = Look { path: &path, names: &[], window, length_ns: None };
    let (again, judged) = look.capture(None).unwrap();
    assert!(judged.is_ok());
    assert_eq!(again.shot.missing(), captured.shot.missing());
    let [again, before] = [&again.shot, &captured.shot].map(|shot| &shot.tracks[0]);
    assert_eq!(again.signals.len(), 1);
    let heads = |track: &Track| {
        let heads = track.rows.heads().map(|head| (head.cycle, head.lost, head.missed));
        heads.collect::<Vec<_>>()
    };
    assert_eq!(heads(again), heads(before));
}

#[test]
fn a_file_that_ends_within_the_shot_is_shown_as_far_as_it_goes_and_is_a_finding() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.csv");
    std::fs::write(&path, "time_s,x,y\n0,0,1\n1,0,1\n2,5,1\n3,5,1\n").unwrap();
    let trigger = "x > 1".parse().unwrap();
    let look = |after_s: u64| {
        let window = Window { before_ns: 1_000 * MS, after_ns: after_s * 1_000 * MS };
        Look { path: &path, names: &[], window, length_ns: None }.capture(Some(&trigger)).unwrap()
    };
    let (captured, judged) = look(2);
    assert!(judged.is_ok());
    let signals = |it: &Captured| it.shot.tracks.iter().map(|it| it.signals.len()).sum::<usize>();
    assert_eq!(signals(&captured), 2, "all signals of the file, not only the trigger's");
    let (captured, judged) = look(20);
    assert_eq!(notes(&captured.shot), ["the shot ends 2 s instead of 20 s after the trigger"]);
    let why = judged.unwrap_err().report().unwrap().to_string();
    assert!(why.ends_with("short.csv ends within the shot"), "{why}");
}

#[test]
fn a_recording_is_shown_whole_or_from_its_beginning_on_and_lacks_nothing_where_a_service_ends_before_another()
 {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("services.mcap");
    let out = std::fs::File::create(&path).unwrap();
    let mut writer = Writer::create(out, ClockReading::default()).unwrap();
    for (service, period, cycles) in [("fast", MS, 100), ("slow", 40 * MS, 2)] {
        let carried = Carried {
            service: service.into(),
            period_ns: Some(period),
            signals: vec![SignalSpec::new(format!("{service}.y"), "LREAL")],
            ..Carried::default()
        };
        let channel = writer.add(&carried).unwrap();
        for cycle in 0..cycles {
            let release_ns = 1_000 * MS + cycle * period;
            let header = FrameHeader { cycle, release_ns, ..FrameHeader::default() };
            let (due_ns, sent_ns) = (release_ns, release_ns);
            let frame = Frame { header, values: &[1.0], received_ns: 0, due_ns, sent_ns, lost: 0 };
            writer.write(channel, &frame).unwrap();
        }
    }
    writer.finish().map_err(|(error, _)| error).unwrap();
    let window = Window { before_ns: 0, after_ns: MS };
    let rows = |length_ns| {
        let look = Look { path: &path, names: &[], window, length_ns };
        let (captured, judged) = look.capture(None).unwrap();
        assert!(judged.is_ok());
        assert_eq!(notes(&captured.shot), [""; 0]);
        let shot = captured.shot;
        assert!(shot.tracks.iter().all(|track| shot.gaps(track).is_empty()));
        let rows: Vec<usize> = shot.tracks.iter().map(|track| track.rows.len()).collect();
        (rows, shot.duration_ns() / MS)
    };
    assert_eq!(rows(None), (vec![100, 2], 100));
    assert_eq!(rows(Some(30 * MS)), (vec![30, 1], 30));
}
