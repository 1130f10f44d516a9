//! A domain of its own for each test, so that tests run at once and leave nothing behind.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::ops::Deref;
use std::path::Path;

use isochrone_ipc::{
    FrameLayout, FramePublisher, IsolatedDomain, Participant, Service, SignalSpec, Stamp,
};

/// The readers' clock where it does not matter.
pub(crate) const NOW_NS: u64 = 1_000_000_000;

pub(crate) struct Domain(IsolatedDomain);

impl Domain {
    pub(crate) fn new() -> Self {
        Self(IsolatedDomain::new("isotest").unwrap())
    }

    /// A domain with this root path and prefix, whoever else may be in it.
    pub(crate) fn at(&self, root: &Path, prefix: &str) -> isochrone_ipc::Domain {
        let file = self.folder().join("other.toml");
        let text = format!("[global]\nroot-path = {root:?}\nprefix = {prefix:?}\n");
        std::fs::write(&file, text).unwrap();
        isochrone_ipc::Domain::from_file(&file).unwrap()
    }

    pub(crate) fn join<S: Service>(&self) -> Participant<S> {
        Participant::join_variant("tester", self).unwrap()
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
