//! A program that knows only iceoryx2 reads frames that the crate `isochrone-ipc` publishes.
//!
//! Each test has an iceoryx2 domain of its own. The child finds it in the file
//! `config/iceoryx2.toml` of its working directory, where iceoryx2 looks first.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use isochrone::ipc::{
    Announcement, Depth, FrameLayout, FramePublisher, FrameSubscriber, IsolatedDomain,
    LayoutAnnouncer, Participant, SignalSpec, Stamp, ipc,
};
use isochrone_testing::{PATIENCE, afresh};

const STEP: Duration = Duration::from_millis(1);

struct Domain(IsolatedDomain);

impl Domain {
    fn new() -> Self {
        let domain = IsolatedDomain::new("isoex").unwrap();
        let place = domain.folder().join("config");
        std::fs::create_dir(&place).unwrap();
        std::fs::copy(domain.file(), place.join("iceoryx2.toml")).unwrap();
        Self(domain)
    }

    fn join(&self) -> Participant<ipc::Service> {
        Participant::join("tester", &self.0).unwrap()
    }

    fn start_reader(&self, arguments: &[&str]) -> Child {
        afresh(&mut Command::new(env!("CARGO_BIN_EXE_plain_reader")))
            .args(arguments)
            .current_dir(self.0.folder())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Makes sure that nothing is left of the domain.
    fn close(self) {
        self.0.remove_leftovers();
        assert_eq!(self.0.files(), Vec::<PathBuf>::new());
    }
}

fn layout() -> FrameLayout {
    let signals = [
        ("level_raw", "LREAL"),
        ("level.y", "LREAL"),
        ("ramp.delayedValue", "LREAL"),
        ("heartbeat.value", "INT"),
    ];
    let signals = signals.map(|(name, value_type)| SignalSpec::new(name, value_type));
    FrameLayout { signals: signals.into(), period_ns: Some(1_000_000) }
}

/// What a program that has ended printed, and its exit status.
fn ended(child: Child) -> (String, Option<i32>) {
    let output = child.wait_with_output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(complaint, "");
    (String::from_utf8(output.stdout).unwrap(), output.status.code())
}

#[test]
fn a_plain_reader_sees_layout_headers_and_values() {
    let domain = Domain::new();
    let node = domain.join();
    let mut publisher = FramePublisher::open(&node, "plant/level", &layout()).unwrap();
    let mut announcer = LayoutAnnouncer::open(&node, "plant/level", "level", &layout()).unwrap();
    let mut child = domain.start_reader(&["plant/level", "3"]);
    let started = Instant::now();
    while publisher.subscribers() == 0 && child.try_wait().unwrap().is_none() {
        assert!(started.elapsed() < PATIENCE, "the reader does not come");
        std::thread::sleep(STEP);
    }
    for cycle in 10_u64.. {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        assert!(started.elapsed() < PATIENCE, "the reader does not end");
        announcer.tend(&node);
        assert!(publisher.prepare());
        let values = [20736.0, 1.275, 0.01 * cycle as f64, -1.0];
        publisher.values_mut().unwrap().copy_from_slice(&values);
        let release_ns = cycle * 1_000_000;
        let source_ns = release_ns - 500;
        let stamp = Stamp { cycle, release_ns, source_ns, missed: 2, ..Stamp::default() };
        assert!(publisher.send(stamp, || release_ns + 7));
        std::thread::sleep(STEP);
    }
    let (printed, code) = ended(child);
    let (service, frames) = printed.split_at(printed.find("FrameHeader").unwrap());
    let json = String::from_utf8(Announcement::new("level", &layout()).to_json()).unwrap();
    assert_eq!(service, format!("service plant/level\nlayout {json}\n"));
    let number = layout().number();
    let mut lines = frames.lines();
    let mut first = None;
    while let (Some(header), Some(values)) = (lines.next(), lines.next()) {
        let field = |name: &str| {
            let (_, rest) = header.split_once(&format!(" {name}: ")).unwrap();
            rest.split([',', ' ']).next().unwrap().parse::<u64>().unwrap()
        };
        let cycle = field("cycle");
        let first = *first.get_or_insert(cycle);
        assert_eq!(field("sequence"), cycle - 10);
        let times = ["release_ns", "publish_ns", "source_ns"].map(field);
        let release_ns = cycle * 1_000_000;
        assert_eq!(times, [release_ns, release_ns + 7, release_ns - 500]);
        assert_eq!(["missed", "flags", "layout"].map(field), [2, 0, number]);
        assert!(field("term") > 0);
        let ramp = 0.01 * cycle as f64;
        assert_eq!(values, format!("  {:?}", [20736.0, 1.275, ramp, -1.0]));
        assert!(cycle >= first);
    }
    assert_eq!(frames.lines().count(), 6, "{frames}");
    assert_eq!(code, Some(0));
    drop((publisher, announcer, node));
    domain.close();
}

#[test]
fn a_plain_reader_gives_up_when_there_is_no_service() {
    let domain = Domain::new();
    let (printed, code) = ended(domain.start_reader(&[]));
    assert_eq!(printed, "there is no service plant/level\n");
    assert_eq!(code, Some(3));
    domain.close();
}

#[test]
fn a_plain_reader_gives_up_when_nobody_publishes() {
    let domain = Domain::new();
    let node = domain.join();
    let other = FrameSubscriber::open(&node, "plant/quiet", 4, Depth::Newest).unwrap();
    let (printed, code) = ended(domain.start_reader(&["plant/quiet"]));
    assert!(printed.ends_with("\nno frames on plant/quiet\n"), "{printed}");
    assert_eq!(code, Some(3));
    drop((other, node));
    domain.close();
}
