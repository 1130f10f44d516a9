//! Frames for tests of both variants: between processes, and within one.

use std::process::Child;

use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, Participant, Service, SignalSpec, Stamp,
};
use isochrone_testing::{Domain, wait_until};

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

/// A domain of its own with a participant in it.
pub(crate) fn joined<S: Service>() -> (Domain, Participant<S>) {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    (domain, node)
}

/// Opens the service `x` of one LREAL.
pub(crate) fn open_writer<S: Service>(node: &Participant<S>) -> FramePublisher<S> {
    FramePublisher::open(node, "x", &layout(&["a:LREAL"])).unwrap()
}

/// Reads the first channel of the service `x`.
pub(crate) fn open_reader<S: Service>(node: &Participant<S>, depth: Depth) -> FrameSubscriber<S> {
    FrameSubscriber::open(node, "x", 1, depth).unwrap()
}

/// Ends a process as SIGKILL does.
pub(crate) fn kill(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Removes what an unused domain leaves. A process that another test is starting holds the domain's lock, as
/// all that this process has open, until it becomes its program.
pub(crate) fn remove_leftovers(domain: &isochrone_ipc::Domain) {
    wait_until("nothing is left", || {
        domain.remove_leftovers();
        domain.files().is_empty()
    });
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
