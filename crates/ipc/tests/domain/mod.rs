//! A domain of its own for each test, so that tests run at once and leave nothing behind.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::sync::atomic::{AtomicU32, Ordering};

use iceoryx2::prelude::{FileName, Path, SemanticString};
use isochrone_ipc::{
    Config, FrameLayout, FramePublisher, Participant, Service, SignalSpec, Stamp, ipc, load_config,
    local, remove_leftovers,
};

/// The readers' clock where it does not matter.
pub(crate) const NOW_NS: u64 = 1_000_000_000;

pub(crate) struct Domain {
    directory: tempfile::TempDir,
    pub(crate) config: Config,
}

impl Domain {
    pub(crate) fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let directory = tempfile::tempdir().unwrap();
        let prefix = format!("isotest{}_{number}_", std::process::id());
        let config = Self::config_of(directory.path().to_str().unwrap(), &prefix);
        Self { directory, config }
    }

    pub(crate) fn config_of(root: &str, prefix: &str) -> Config {
        let mut config = load_config(None).unwrap();
        config.global.prefix = FileName::new(prefix.as_bytes()).unwrap();
        config.global.set_root_path(&Path::new(root.as_bytes()).unwrap());
        config
    }

    pub(crate) fn join<S: Service>(&self) -> Participant<S> {
        Participant::join("tester", &self.config).unwrap()
    }

    pub(crate) fn prefix(&self) -> String {
        self.config.global.prefix.to_string()
    }

    pub(crate) fn root(&self) -> &std::path::Path {
        self.directory.path()
    }

    /// All files of the domain, in shared memory and on disk.
    pub(crate) fn files(&self) -> Vec<String> {
        let shared = std::fs::read_dir("/dev/shm").unwrap();
        let mut files: Vec<String> = shared
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.starts_with(&self.prefix()))
            .collect();
        let mut directories = vec![self.root().to_owned()];
        while let Some(directory) = directories.pop() {
            for entry in std::fs::read_dir(directory).unwrap() {
                let path = entry.unwrap().path();
                match path.is_dir() {
                    true => directories.push(path),
                    false => files.push(path.display().to_string()),
                }
            }
        }
        files
    }
}

impl Drop for Domain {
    fn drop(&mut self) {
        remove_leftovers::<ipc::Service>(&self.config);
        remove_leftovers::<local::Service>(&self.config);
    }
}

/// Channels `name:TYPE`.
pub(crate) fn layout(signals: &[&str]) -> FrameLayout {
    let signals = signals.iter().map(|signal| {
        let (name, value_type) = signal.split_once(':').unwrap();
        SignalSpec::new(name, value_type)
    });
    FrameLayout { signals: signals.collect(), period_ns: Some(1_000_000) }
}

/// Sends one frame of one value.
pub(crate) fn send<S: Service>(publisher: &mut FramePublisher<S>, value: f64, publish_ns: u64) {
    assert!(publisher.prepare());
    publisher.values_mut().unwrap()[0] = value;
    assert!(publisher.send(Stamp::default(), || publish_ns));
}

/// Runs each test for processes and within one.
#[macro_export]
macro_rules! for_both_variants {
    ($($test:ident)*) => {
        mod across_processes {
            $(#[test] fn $test() { super::$test::<isochrone_ipc::ipc::Service>(); })*
        }
        mod within_one_process {
            $(#[test] fn $test() { super::$test::<isochrone_ipc::local::Service>(); })*
        }
    };
}
