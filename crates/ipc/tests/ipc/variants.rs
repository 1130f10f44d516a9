//! Frames for tests of both variants: between processes, and within one.

use isochrone_ipc::{FrameLayout, FramePublisher, Service, SignalSpec, Stamp};

/// The readers' clock where it does not matter.
pub(crate) const NOW_NS: u64 = 1_000_000_000;

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
