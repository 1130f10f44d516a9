//! A sensor, the node that guards it, and what sees each of their frames.

use isochrone_ipc::{
    Depth, Flags, FrameHeader, FrameLayout, FramePublisher, FrameSubscriber, Participant,
    SignalSpec, Stamp, ipc,
};

use isochrone_testing::{Domain, Process, wait_for_some};

pub(crate) fn sensor(domain: &Domain, value: &str) -> Process {
    let value = format!("--value={value}");
    let mut sensor = domain.start_with(&["publish", "plant/sensor", &value, "--rate", "100"]);
    sensor.wait_for("publishing");
    sensor
}

/// Sees every frame of a service.
pub(crate) struct Observer {
    pub(crate) subscriber: FrameSubscriber<ipc::Service>,
    pub(crate) participant: Participant<ipc::Service>,
}

pub(crate) struct Frame {
    pub(crate) header: FrameHeader,
    pub(crate) values: Vec<f64>,
}

impl Frame {
    pub(crate) fn flags(&self) -> Flags {
        self.header.flags()
    }
}

impl Observer {
    /// Opens a service for so many signals before anybody sends.
    pub(crate) fn before(domain: &Domain, service: &str, signals: usize) -> Self {
        let participant = domain.join("observer");
        let subscriber = FrameSubscriber::open(&participant, service, signals, Depth::All).unwrap();
        Self { subscriber, participant }
    }

    pub(crate) fn of(domain: &Domain, service: &str) -> Self {
        let participant = domain.join("observer");
        let subscriber = wait_for_some(&format!("there is {service}"), || {
            FrameSubscriber::open_existing(&participant, service, Depth::All).unwrap()
        });
        Self { subscriber, participant }
    }

    pub(crate) fn next(&mut self) -> Option<Frame> {
        self.subscriber.maintain();
        let frame = self.subscriber.next(now_ns())?;
        Some(Frame { header: *frame.header(), values: frame.values().to_vec() })
    }

    /// Looks at all frames that come, with `check`, until one fits.
    #[track_caller]
    pub(crate) fn until(
        &mut self,
        what: &str,
        mut check: impl FnMut(&Frame),
        fits: impl Fn(&Frame) -> bool,
    ) -> Frame {
        wait_for_some(&format!("there is a frame that is {what}"), || {
            while let Some(frame) = self.next() {
                check(&frame);
                if fits(&frame) {
                    return Some(frame);
                }
            }
            None
        })
    }

    #[track_caller]
    pub(crate) fn flagged(&mut self, flags: Flags) -> Frame {
        self.until(&format!("\"{flags}\""), |_| {}, |frame| frame.flags() == flags)
    }
}

/// The clock of frames; a reader of all frames needs it for silent writers only.
fn now_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Sends frames of its own making.
pub(crate) struct Source {
    publisher: FramePublisher<ipc::Service>,
    _participant: Participant<ipc::Service>,
}

impl Source {
    pub(crate) fn open(domain: &Domain, service: &str, signals: &[&str]) -> Self {
        let participant = domain.join("sensor");
        let signals = signals.iter().map(|name| SignalSpec::new(*name, "LREAL")).collect();
        let layout = FrameLayout { signals, period_ns: None };
        let publisher = FramePublisher::open(&participant, service, &layout).unwrap().plain();
        Self { publisher, _participant: participant }
    }

    pub(crate) fn send(&mut self, values: &[f64]) {
        self.publisher.prepare();
        self.publisher.values_mut().unwrap().copy_from_slice(values);
        self.publisher.send(Stamp::default(), now_ns);
    }
}
