//! An iceoryx2 domain for each test and the programs in it.

use std::ffi::OsStr;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::Command;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{NodeBuilder, ServiceName};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use isochrone_ipc::{FrameHeader, IsolatedDomain, Participant, Service, ipc};
use serde_json::Value;

use crate::process::{Ended, Process, program};
use crate::wait_for_ok;

/// The ends of a link: what it writes, and what it would send to its peer.
pub type PlainLink<S> = (Publisher<S, [f64], FrameHeader>, Subscriber<S, [f64], FrameHeader>);

/// An iceoryx2 domain and a folder that nobody else uses, and of which nothing is left when it is dropped.
pub struct Domain(IsolatedDomain);

impl Domain {
    /// A new one, with nobody in it.
    #[expect(clippy::new_without_default, reason = "it creates files")]
    pub fn new() -> Self {
        Self(IsolatedDomain::new("isotest").unwrap())
    }

    /// A new one, with these files in its folder.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let domain = Self::new();
        files.iter().for_each(|(name, content)| drop(domain.write(name, content)));
        domain
    }

    /// Writes a configuration, starts its node with these arguments, and waits until it runs.
    #[track_caller]
    pub fn start_node(&self, file: &str, configuration: &str, arguments: &str) -> Process {
        self.write(file, configuration);
        self.start_until(&format!("run {file} {arguments}"), "is running")
    }

    /// Another domain, with this root path and prefix, whoever else may be in it.
    pub fn at(&self, root: &Path, prefix: &str) -> isochrone_ipc::Domain {
        let text = format!("[global]\nroot-path = {root:?}\nprefix = {prefix:?}\n");
        isochrone_ipc::Domain::from_file(&self.write("other.toml", &text)).unwrap()
    }

    /// A file in the domain's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.folder().join(name)
    }

    /// Copies the program `isochrone` into the domain's folder, where users may run it who may not come to where it was
    /// built. Another process copies it: one that another test forks from this one, meanwhile, would keep the file open
    /// for writing, and the kernel runs no such file ("Text file busy").
    pub fn copy_program(&self) -> PathBuf {
        let copy = self.path("isochrone");
        assert!(Command::new("cp").arg(program()).arg(&copy).status().unwrap().success());
        copy
    }

    /// Writes a file in the domain's folder, and returns where it is.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }

    /// The text of a file in the domain's folder.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// The content of a JSON file in the domain's folder.
    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).unwrap()
    }

    /// Waits until a recording holds the row of a cycle: what has arrived is written at the reader's
    /// next look.
    #[track_caller]
    pub fn wait_for_cycle(&self, name: &str, cycle: u64) {
        let is_of_cycle = |row: &str| row.split(',').nth(1) == Some(&cycle.to_string());
        let what = format!("{name} has the row of cycle {cycle}");
        self.wait_for_recording(name, &what, |text| text.lines().any(is_of_cycle));
    }

    /// Waits until a recording holds so many rows.
    #[track_caller]
    pub fn wait_for_rows(&self, name: &str, rows: usize) {
        let what = format!("{name} has {rows} rows");
        self.wait_for_recording(name, &what, |text| text.lines().count() > rows);
    }

    #[track_caller]
    fn wait_for_recording(&self, name: &str, what: &str, is_complete: impl Fn(&str) -> bool) {
        wait_for_ok(what, || match std::fs::read_to_string(self.path(name)) {
            Ok(text) if is_complete(&text) => Ok(()),
            Ok(text) => {
                let last = text.lines().last().unwrap_or_default();
                Err(format!("it has {} lines, the last is {last:?}", text.lines().count()))
            }
            Err(error) => Err(error.to_string()),
        });
    }

    /// The domain's iceoryx2 configuration.
    pub fn config_file(&self) -> PathBuf {
        self.0.file()
    }

    /// Joins it from within the test.
    pub fn join(&self, name: &str) -> Participant<ipc::Service> {
        self.join_variant(name)
    }

    /// Joins it from within the test, for processes or for threads.
    pub fn join_variant<S: Service>(&self, name: &str) -> Participant<S> {
        Participant::join_variant(name, &self.0).unwrap()
    }

    /// A writer of a service that is there, which knows nothing of isochrone but the types of its frames.
    pub fn plain_writer<S: Service>(&self, service: &str) -> Publisher<S, [f64], FrameHeader> {
        let service = self.plain_service(service);
        service.publisher_builder().initial_max_slice_len(1).create().unwrap()
    }

    /// Both ends of a service that is there in one plain node, as a link between machines has them.
    pub fn plain_link<S: Service>(&self, service: &str) -> PlainLink<S> {
        let service = self.plain_service(service);
        let writer = service.publisher_builder().initial_max_slice_len(1).create().unwrap();
        (writer, service.subscriber_builder().create().unwrap())
    }

    fn plain_service<S: Service>(&self, service: &str) -> PortFactory<S, [f64], FrameHeader> {
        let node = NodeBuilder::new().config(self.0.config()).create::<S>().unwrap();
        let service = node
            .service_builder(&ServiceName::new(service).unwrap())
            .publish_subscribe::<[f64]>()
            .user_header::<FrameHeader>();
        service.open().unwrap()
    }

    /// The program in this domain and its folder, not started yet.
    pub fn command<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Command {
        self.command_by::<&str, _>(&[], arguments)
    }

    /// As [`Domain::command`], started by another program, whose words come first.
    pub fn command_by<W: AsRef<OsStr>, S: AsRef<OsStr>>(
        &self,
        words: &[W],
        arguments: &[S],
    ) -> Command {
        let mut command = match words {
            [] => Command::new(program()),
            [other, words @ ..] => {
                let mut command = Command::new(other);
                command.args(words).arg(program());
                command
            }
        };
        command.args(arguments).current_dir(self.0.folder());
        command.env("ICEORYX2_CONFIG", self.config_file());
        command.env_remove("RUST_LOG").env_remove("NO_COLOR").env("RUST_BACKTRACE", "1");
        command
    }

    /// Starts the program in this domain; the arguments are separated by spaces. It must end in order when the
    /// test lets go of it.
    pub fn start(&self, arguments: &str) -> Process {
        self.start_with(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// As [`Domain::start`], with arguments as they are.
    pub fn start_with<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Process {
        Process::start(self.command(arguments)).ends_in_order()
    }

    /// As [`Domain::start`], by another program, whose words come first.
    pub fn start_by<W: AsRef<OsStr>>(&self, words: &[W], arguments: &str) -> Process {
        let arguments: Vec<_> = arguments.split_whitespace().collect();
        Process::start(self.command_by(words, &arguments)).ends_in_order()
    }

    /// As [`Domain::start`], and waits until a text stands in what the program printed.
    #[track_caller]
    pub fn start_until(&self, arguments: &str, text: &str) -> Process {
        let mut process = self.start(arguments);
        process.wait_for(text);
        process
    }

    /// Starts `publish` with these arguments, and waits until it does so.
    #[track_caller]
    pub fn publish(&self, arguments: &str) -> Process {
        self.start_until(&format!("publish {arguments}"), "publishing")
    }

    /// Runs the program to its end.
    #[track_caller]
    pub fn run(&self, arguments: &str) -> Ended {
        self.start(arguments).finish().expect_readable()
    }

    /// As [`Domain::run`], with arguments as they are.
    #[track_caller]
    pub fn run_with<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Ended {
        self.start_with(arguments).finish().expect_readable()
    }

    /// What the program prints that does what it should and has nothing to remark.
    #[track_caller]
    pub fn stdout(&self, arguments: &str) -> String {
        self.run(arguments).silently()
    }

    /// The JSON that the program prints that does what it should.
    #[track_caller]
    pub fn answer(&self, arguments: &str) -> Value {
        self.run(arguments).expect_code(0).json()
    }

    /// Runs the program to its end: it ends with this exit status, and says all of this to standard error.
    #[track_caller]
    pub fn expect<S: AsRef<str>>(&self, arguments: &str, code: i32, says: &[S]) -> Ended {
        let ended = self.run(arguments);
        let Ended { status, stdout, stderr } = &ended;
        assert_eq!(status.code(), Some(code), "{arguments}\n{stdout}\n{stderr}");
        for part in says.iter().map(AsRef::as_ref) {
            assert!(stderr.contains(part), "{arguments}: {part:?} is not in:\n{stderr}");
        }
        ended
    }

    /// It ended without a trace: no file is left, in shared memory or in the root path.
    #[track_caller]
    pub fn expect_no_leftovers(&self) {
        assert_eq!(self.leftovers(), Vec::<PathBuf>::new());
    }

    /// Files that are left, in shared memory and in the root path.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        self.0.files()
    }
}

impl AsRef<isochrone_ipc::Domain> for Domain {
    fn as_ref(&self) -> &isochrone_ipc::Domain {
        &self.0
    }
}

impl Deref for Domain {
    type Target = IsolatedDomain;

    fn deref(&self) -> &IsolatedDomain {
        &self.0
    }
}

/// Files in shared memory whose names begin with `prefix`.
pub fn shared_memory(prefix: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir("/dev/shm").unwrap();
    let of_domain = |path: &PathBuf| {
        path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(prefix))
    };
    entries.map(|entry| entry.unwrap().path()).filter(of_domain).collect()
}
