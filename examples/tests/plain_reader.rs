//! A program that knows only iceoryx2 reads frames that the crate `isochrone-ipc` publishes.
//!
//! Each test has an iceoryx2 domain of its own. The child finds it in the file
//! `config/iceoryx2.toml` of its working directory, where iceoryx2 looks first.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use isochrone_ipc::{
    Announcement, Config, Depth, FrameLayout, FramePublisher, FrameSubscriber, LayoutAnnouncer,
    Participant, SignalSpec, Stamp, ipc, load_config, remove_leftovers,
};

const LIMIT: Duration = Duration::from_secs(30);
const STEP: Duration = Duration::from_millis(1);

struct Domain {
    directory: tempfile::TempDir,
    prefix: String,
    config: Config,
}

impl Domain {
    fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let prefix = format!("isoex{}_{number}_", std::process::id());
        // Root path and prefix end up in the address of a socket, which is short.
        let directory = tempfile::Builder::new().prefix("isoex").tempdir_in("/tmp").unwrap();
        let root = directory.path().join("iox2").display().to_string();
        let file = directory.path().join("config/iceoryx2.toml");
        std::fs::create_dir(directory.path().join("config")).unwrap();
        let text = format!("[global]\nroot-path = \"{root}\"\nprefix = \"{prefix}\"\n");
        std::fs::write(&file, text).unwrap();
        let config = load_config(Some(&file)).unwrap();
        Self { directory, prefix, config }
    }

    fn join(&self) -> Participant<ipc::Service> {
        Participant::join("tester", &self.config).unwrap()
    }

    fn start_reader(&self, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_plain_reader"))
            .args(arguments)
            .current_dir(&self.directory)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Makes sure that nothing is left of the domain.
    fn close(self) {
        remove_leftovers::<ipc::Service>(&self.config);
        let shared = std::fs::read_dir("/dev/shm").unwrap();
        let names = shared.map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let left: Vec<_> = names.filter(|name| name.starts_with(&self.prefix)).collect();
        assert!(left.is_empty(), "{left:?}");
        assert_eq!(files(&self.directory.path().join("iox2")), Vec::<String>::new());
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        // For a test that failed before it came to `close`.
        remove_leftovers::<ipc::Service>(&self.config);
    }
}

/// All files below a directory; empty directories do not count.
fn files(directory: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(directory) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .flat_map(
            |path| {
                if path.is_dir() { files(&path) } else { vec![path.display().to_string()] }
            },
        )
        .collect()
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
        assert!(started.elapsed() < LIMIT, "the reader does not come");
        std::thread::sleep(STEP);
    }
    for cycle in 10_u64.. {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        assert!(started.elapsed() < LIMIT, "the reader does not end");
        announcer.tend(&node);
        assert!(publisher.prepare());
        let values = [20736.0, 1.275, 0.01 * cycle as f64, -1.0];
        publisher.values_mut().unwrap().copy_from_slice(&values);
        let release_ns = cycle * 1_000_000;
        let stamp = Stamp { cycle, release_ns, source_ns: release_ns - 500, missed: 2 };
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
