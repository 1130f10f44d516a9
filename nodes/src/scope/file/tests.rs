use isochrone_recording::ClockReading;

use super::super::output::Output;
use super::super::told::notes;
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
            Signal { name: format!("{task}.y"), unit: "m".into(), value_type: "LREAL".into() };
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
    let look = Look { path: &path, names: &[], window: Window { before_ns: 0, after_ns: MS } };
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
fn a_file_that_ends_within_the_shot_is_shown_as_far_as_it_goes_and_is_a_finding() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.csv");
    std::fs::write(&path, "time_s,x,y\n0,0,1\n1,0,1\n2,5,1\n3,5,1\n").unwrap();
    let trigger = "x > 1".parse().unwrap();
    let look = |after_s: u64| {
        let window = Window { before_ns: 1_000 * MS, after_ns: after_s * 1_000 * MS };
        Look { path: &path, names: &[], window }.capture(Some(&trigger)).unwrap()
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
