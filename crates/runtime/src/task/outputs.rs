//! A task's outputs: the frames that it publishes.

use isochrone_cyclic::{Clock, Monotonic, Release, thread_allocations};
use isochrone_engine::{OutputPlan, SignalPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{
    Flags, ForRealTime, FrameLayout, FramePublisher, OpenError, RealTime, Service, SignalSpec,
    Stamp,
};
use isochrone_timing::{Direction, LinkReport};

/// One frame that a task publishes.
pub(crate) struct Output {
    pub(crate) service: String,
    pub(crate) layout: FrameLayout,
    readers: Option<usize>,
}

/// The frames that a task publishes, in the plan's order.
pub(crate) fn of_task(task: &TaskPlan) -> Vec<Output> {
    let output = |output: &OutputPlan| Output {
        service: output.service.clone(),
        layout: FrameLayout {
            signals: output.signals.iter().map(signal).collect(),
            period_ns: Some(task.settings.period_ns),
        },
        readers: output.readers,
    };
    task.outputs.iter().map(output).collect()
}

fn signal(signal: &SignalPlan) -> SignalSpec {
    let SignalPlan { name, value_type, unit, .. } = signal;
    SignalSpec::new(name.clone(), value_type.to_string()).in_unit(unit)
}

/// The ports of a task's outputs.
pub(crate) struct OutputPorts<S: Service> {
    ports: Vec<OutputPort<S>>,
    /// Allocations by iceoryx2 in the cycle, where it connects a subscriber that has just joined.
    allocations: u64,
    /// The stamp of the last frame that was sent.
    published_ns: Option<u64>,
}

/// Which frame of a task it is.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Frame {
    /// Another frame follows.
    Next,
    /// The last one: the task ends.
    Last,
}

impl Frame {
    /// Of a task's last cycle, or of another one.
    pub(crate) fn of(is_last: bool) -> Self {
        if is_last { Self::Last } else { Self::Next }
    }
}

struct OutputPort<S: Service> {
    service: String,
    publisher: FramePublisher<S>,
}

impl<S: Service> OutputPorts<S> {
    /// Opens a publisher for each output; ports and outputs have the same order.
    pub(crate) fn open(
        participant: &RealTime<S>,
        outputs: &[Output],
    ) -> Result<ForRealTime<Self>, OpenError> {
        let open = |output: &Output| {
            let Output { service, layout, readers } = output;
            let publisher = match *readers {
                None => participant.publisher(service, layout),
                Some(readers) => participant.publisher_for_readers(service, layout, readers),
            }?;
            let service = service.clone();
            Ok(publisher.map(|publisher| OutputPort { service, publisher }))
        };
        let ports = outputs.iter().map(open).collect::<Result<ForRealTime<Vec<_>>, OpenError>>()?;
        Ok(ports.map(|ports| Self { ports, allocations: 0, published_ns: None }))
    }

    /// The outputs of a node without services.
    pub(crate) fn none() -> Self {
        Self { ports: Vec::new(), allocations: 0, published_ns: None }
    }

    /// Copies the outputs into the frames that were loaned beforehand.
    pub(crate) fn copy(&mut self, engine: &TaskEngine) {
        for (output, port) in self.ports.iter_mut().enumerate() {
            if let Some(values) = port.publisher.values_mut() {
                engine.read_output(output, values);
            }
        }
    }

    /// Goes on with this term and this number of the next frame.
    pub(crate) fn go_on(&mut self, term: u64, sequence: u64) {
        self.ports.iter_mut().for_each(|port| port.publisher.go_on(term, sequence));
    }

    /// Leaves the numbers of the next frames to so many that the other process of the node may have sent.
    #[inline]
    pub(crate) fn pass_over(&mut self, frames: u64) {
        if frames > 0 {
            self.ports.iter_mut().for_each(|port| port.publisher.pass_over(frames));
        }
    }

    /// The number of the next frame.
    pub(crate) fn next_sequence(&self) -> u64 {
        self.ports.first().map_or(0, |port| port.publisher.next_sequence())
    }

    /// Sends the frames, with these flags besides those of their signals, each only if it may be sent then.
    pub(crate) fn send(
        &mut self,
        engine: &TaskEngine,
        release: &Release,
        frame: Frame,
        flags: Flags,
        may_send: impl Fn() -> bool,
    ) {
        let end = match frame {
            Frame::Next => Flags::NONE,
            Frame::Last => Flags::STOPPED,
        };
        self.published_ns = None;
        for (output, port) in self.ports.iter_mut().enumerate() {
            if !may_send() {
                return;
            }
            let stamp = Stamp {
                cycle: release.cycle,
                release_ns: release.release_ns,
                source_ns: engine.output_source_ns(output),
                missed: release.missed,
                flags: engine.output_flags(output) | flags | end,
            };
            // A frame that could not be sent is counted by the port.
            let before = thread_allocations();
            port.publisher.send(stamp, || *self.published_ns.insert(Monotonic.now_ns()));
            self.allocations += thread_allocations() - before;
        }
    }

    /// When the last frame was published, in ns; `None` if there was none.
    pub(crate) fn published_ns(&self) -> Option<u64> {
        self.published_ns
    }

    /// Connects to subscribers that joined; for the slack.
    pub(crate) fn maintain(&mut self) {
        self.ports.iter_mut().for_each(|port| port.publisher.maintain());
    }

    /// Loans the next frames; for the slack.
    pub(crate) fn prepare(&mut self) {
        for port in &mut self.ports {
            // A loan that failed is counted by the port, and tried again in the next slack.
            port.publisher.prepare();
        }
    }

    /// How often a subscriber was seen to come or go.
    pub(crate) fn connects(&self) -> u64 {
        self.ports.iter().map(|port| port.publisher.counters().connects).sum()
    }

    /// How many connections to a subscriber failed.
    pub(crate) fn connect_errors(&self) -> u64 {
        self.ports.iter().map(|port| port.publisher.counters().connect_errors).sum()
    }

    /// Allocations of iceoryx2 while it sent.
    pub(crate) fn allocations(&self) -> u64 {
        self.allocations
    }

    /// What every port sent.
    pub(crate) fn links(&self) -> impl Iterator<Item = LinkReport> {
        self.ports.iter().map(|port| {
            let counters = port.publisher.counters();
            LinkReport {
                service: port.service.clone(),
                direction: Some(Direction::Sent),
                frames: counters.sent,
                lost: counters.unsent + counters.send_errors,
                ..LinkReport::default()
            }
        })
    }
}
