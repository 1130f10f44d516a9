//! An iceoryx2 domain for each test and the programs in it.

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::Command;

use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::{NodeBuilder, ServiceName};
use isochrone_ipc::{FrameHeader, IsolatedDomain, Participant, Service, ipc};
use serde_json::Value;

use crate::process::{Ended, Process, program};
use crate::wait_for_ok;

/// An iceoryx2 domain and a folder that nobody else uses, and of which nothing is left when it is dropped.
pub struct Domain(IsolatedDomain);

impl Domain {
    /// A new one, with nobody in it.
    #[expect(clippy::new_without_default, reason = "it creates files")]
    pub fn new() -> Self {
        Self(IsolatedDomain::new("isotest").unwrap())
    }

    /// Writes a configuration, starts its node with these arguments, and waits until it runs.
    pub fn start_node(&self, file: &str, configuration: &str, arguments: &str) -> Process {
        self.write(file, configuration);
        let mut node = self.start(&format!("run {file} {arguments}"));
        node.wait_for("is running");
        node
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

    /// Writes a file in the domain's folder, and returns where it is.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        std::fs::write(self.path(name), text).unwrap();
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
        let node = NodeBuilder::new().config(self.0.config()).create::<S>().unwrap();
        let service = node
            .service_builder(&ServiceName::new(service).unwrap())
            .publish_subscribe::<[f64]>()
            .user_header::<FrameHeader>()
            .open()
            .unwrap();
        service.publisher_builder().initial_max_slice_len(1).create().unwrap()
    }

    /// Starts the program in this domain; the arguments are separated by spaces.
    pub fn start(&self, arguments: &str) -> Process {
        self.start_with(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    /// Starts the program in this domain with arguments as they are.
    pub fn start_with(&self, arguments: &[&str]) -> Process {
        let mut command = Command::new(program());
        command.args(arguments).current_dir(self.0.folder());
        if !["simulate", "compare", "check", "replay"].contains(&arguments[0]) {
            command.arg("--iceoryx2-config").arg(self.config_file());
        }
        Process::start(command)
    }

    /// Runs the program to its end.
    pub fn run(&self, arguments: &str) -> Ended {
        self.start(arguments).finish()
    }

    /// What the program prints that does what it should and has nothing to remark.
    #[track_caller]
    pub fn stdout(&self, arguments: &str) -> String {
        let ended = self.run(arguments).expect_code(0);
        assert_eq!(ended.complaints(), "", "{arguments}");
        ended.stdout
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
