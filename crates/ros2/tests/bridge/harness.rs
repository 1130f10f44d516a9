//! A bridge, a peer in Python, and frames on the other side.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, SignalReader, SignalSpec, Stamp, ipc,
};
use isochrone_model::Flags;
use isochrone_testing::{Domain, Ended, PATIENCE, Process, wait_for_some};
use serde_json::Value;

/// A domain of iceoryx2 and one of DDS, with a bridge between them.
pub(crate) struct Bridge {
    pub(crate) domain: Domain,
    pub(crate) dds_domain: u16,
    pub(crate) process: Process,
}

/// The program, in this domain.
pub(crate) fn program(domain: &Domain) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone-ros2"));
    command.env("ICEORYX2_CONFIG", domain.config_file()).env_remove("ROS_DOMAIN_ID");
    command
}

/// A domain of DDS that no other test of this process has, and rarely one of another process.
fn next_dds_domain() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let offset = u16::try_from(std::process::id() % 97).unwrap();
    // The ports of higher ones are those that the kernel gives to anybody.
    1 + (offset * 7 + NEXT.fetch_add(1, Ordering::Relaxed)) % 100
}

impl Bridge {
    /// Starts a bridge with this configuration.
    pub(crate) fn start(configuration: &str) -> Self {
        Self::start_with(configuration, &[])
    }

    /// The same, with these arguments; without a file if the configuration is empty.
    pub(crate) fn start_with(configuration: &str, arguments: &[&str]) -> Self {
        let domain = Domain::new();
        let dds_domain = next_dds_domain();
        let mut command = program(&domain);
        if !configuration.is_empty() {
            command.arg(domain.write("ros2.toml", configuration));
        }
        command.args(["--local", "-v", "--domain", &dds_domain.to_string()]).args(arguments);
        let process = Process::start(command);
        Self { domain, dds_domain, process }
    }

    /// A peer on Cyclone DDS, when it is there.
    pub(crate) fn peer(&self, arguments: &[&str]) -> Process {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer.py");
        let mut command = Command::new(python());
        command.arg(script).args(arguments).args(["--domain", &self.dds_domain.to_string()]);
        command.env_remove("CYCLONEDDS_URI");
        ready(command)
    }

    /// Ends the bridge.
    pub(crate) fn stop(self) -> Ended {
        self.process.stop().expect_code(0).expect_readable()
    }
}

/// Starts a peer, and waits until it is ready.
pub(crate) fn ready(command: Command) -> Process {
    let mut peer = Process::start(command);
    peer.wait_for("ready");
    peer
}

/// Python with the wheel `cyclonedds`, as docs/contributing.md makes it.
fn python() -> PathBuf {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let python = workspace.join("target/python-ros2/bin/python");
    assert!(
        python.exists(),
        "the peer is missing: python3 -m venv target/python-ros2 && target/python-ros2/bin/pip install \
         cyclonedds==11.0.1"
    );
    python
}

/// The first message that a subscriber printed and that is as wanted.
#[track_caller]
pub(crate) fn message(peer: &mut Process, what: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
    let mut found = None;
    peer.wait_until(what, |stdout, _| {
        let messages = stdout.lines().filter_map(|line| serde_json::from_str(line).ok());
        found = messages.into_iter().find(&is_wanted);
        found.is_some()
    });
    found.unwrap()
}

/// Publishes the same frame 100 times a second, until it is dropped.
pub(crate) struct Source {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What a source publishes.
#[derive(Clone, Default)]
pub(crate) struct Given {
    pub(crate) signals: Vec<(&'static str, f64)>,
    pub(crate) flags: Flags,
    pub(crate) source_ns: u64,
}

impl Given {
    pub(crate) fn of(signals: &[(&'static str, f64)]) -> Self {
        Self { signals: signals.to_vec(), ..Self::default() }
    }
}

impl Source {
    /// Publishes frames that a function gives, by their number.
    pub(crate) fn start(
        domain: &Domain,
        service: &str,
        given: impl Fn(u64) -> Given + Send + 'static,
    ) -> Self {
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let participant = domain.join("source");
        let service = service.to_owned();
        drop(participant);
        let config = isochrone_ipc::Domain::from_file(&domain.config_file()).unwrap();
        let thread = thread::spawn(move || {
            let participant = isochrone_ipc::Participant::join("source", config).unwrap();
            let signals = given(0).signals;
            let signals = signals.iter().map(|(name, _)| SignalSpec::new(*name, "LREAL"));
            let layout = FrameLayout { signals: signals.collect(), period_ns: Some(10_000_000) };
            let mut publisher = FramePublisher::open(&participant, &service, &layout).unwrap();
            let mut announcer =
                LayoutAnnouncer::open(&participant, &service, "source", &layout).unwrap();
            let mut frame = 0;
            while !over.load(Ordering::Relaxed) {
                announcer.tend(&participant);
                participant.tend();
                let Given { signals, flags, source_ns } = given(frame);
                publisher.prepare();
                let values = publisher.values_mut().unwrap();
                values.iter_mut().zip(&signals).for_each(|(value, (_, given))| *value = *given);
                let stamp = Stamp { cycle: frame, flags, source_ns, ..Stamp::default() };
                publisher.send(stamp, || Monotonic.now_ns());
                frame += 1;
                thread::sleep(Duration::from_millis(10));
            }
        });
        Self { is_over, thread: Some(thread) }
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let ended = self.thread.take().unwrap().join();
        assert!(ended.is_ok() || thread::panicking());
    }
}

/// A frame that the bridge published: its values by name, its flags and its source time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Taken {
    pub(crate) values: Vec<(String, f64)>,
    pub(crate) types: Vec<String>,
    pub(crate) flags: Flags,
    pub(crate) source_ns: u64,
}

/// The next frame of a service that is as wanted.
#[track_caller]
pub(crate) fn frame(
    domain: &Domain,
    service: &str,
    what: &str,
    is_wanted: impl Fn(&Taken) -> bool,
) -> Taken {
    let participant = domain.join("reader");
    let mut reader = SignalReader::open(&participant, service, &[]).unwrap();
    next(&mut reader, what, is_wanted)
}

/// The next frame that is as wanted.
#[track_caller]
pub(crate) fn next(
    reader: &mut SignalReader<'_, ipc::Service>,
    what: &str,
    is_wanted: impl Fn(&Taken) -> bool,
) -> Taken {
    wait_for_some(what, || {
        let frame = reader.wait(PATIENCE / 100)?;
        let values = frame.values().ok()?.map(|(name, value)| (name.to_owned(), value)).collect();
        let signals = &frame.announced()?.layout.signals;
        let types = signals.iter().map(|signal| signal.value_type.clone()).collect();
        let (flags, source_ns) = (frame.flags(), frame.header().source_ns);
        Some(Taken { values, types, flags, source_ns }).filter(&is_wanted)
    })
}
