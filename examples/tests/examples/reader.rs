//! A reader that sleeps between the frames takes each of them.

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use isochrone::cyclic::{Clock, Monotonic};
use isochrone::ipc::{
    FrameLayout, FramePublisher, IsolatedDomain, LayoutAnnouncer, Participant, SignalSpec, Stamp,
    ipc,
};
use isochrone_testing::{PATIENCE, afresh};

const PERIOD: Duration = Duration::from_millis(2);

#[test]
fn a_reader_that_sleeps_shows_each_frame_in_its_order() {
    let domain = IsolatedDomain::new("isoex").unwrap();
    let node = Participant::<ipc::Service>::join("tester", &domain).unwrap();
    let signals = vec![SignalSpec::new("level.y", "LREAL")];
    let period_ns = u64::try_from(PERIOD.as_nanos()).ok();
    let layout = FrameLayout { signals, period_ns };
    let mut publisher = FramePublisher::open(&node, "plant/level", &layout).unwrap();
    let mut announcer = LayoutAnnouncer::open(&node, "plant/level", "level", &layout).unwrap();
    let mut child = afresh(&mut Command::new(env!("CARGO_BIN_EXE_reader")))
        .args(["plant/level", "20"])
        .env("ICEORYX2_CONFIG", domain.file())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let started = Instant::now();
    for cycle in 0.. {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        assert!(started.elapsed() < PATIENCE, "the reader does not end");
        announcer.tend(&node);
        node.tend();
        assert!(publisher.prepare());
        publisher.values_mut().unwrap()[0] = 0.5;
        publisher.send(Stamp { cycle, ..Stamp::default() }, || Monotonic.now_ns());
        thread::sleep(PERIOD);
    }
    let output = child.wait_with_output().unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{printed}{}", String::from_utf8_lossy(&output.stderr));
    let lines: Vec<&str> = printed.lines().collect();
    assert_eq!(lines.len(), 21, "{printed}");
    let sequences: Vec<u64> = lines[..20]
        .iter()
        .map(|line| {
            let (sequence, rest) = line.strip_prefix("frame ").unwrap().split_once(',').unwrap();
            assert!(rest.ends_with(" us old: [(\"level.y\", 0.5)]"), "{printed}");
            sequence.parse().unwrap()
        })
        .collect();
    assert!(sequences.is_sorted_by(|a, b| a < b), "{printed}");
    drop((publisher, announcer, node));
    domain.remove_leftovers();
    assert_eq!(domain.files(), Vec::<PathBuf>::new());
}
