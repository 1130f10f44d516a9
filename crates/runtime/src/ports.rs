//! A task's outputs: the frames that it publishes.

use isochrone_cyclic::{Clock, Monotonic, Release};
use isochrone_engine::{OutputPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{
    FrameLayout, FramePublisher, OpenError, Participant, Repair, SignalSpec, Stamp, ipc,
};
use isochrone_timing::LinkReport;

type Service = ipc::Service;

/// The frames that a task publishes.
pub(crate) struct OutputPorts {
    ports: Vec<OutputPort>,
}

struct OutputPort {
    service: String,
    publisher: FramePublisher<Service>,
}

impl OutputPorts {
    /// Opens a publisher for each output; ports and outputs have the same order.
    pub(crate) fn open(
        participant: &Participant<Service>,
        task: &TaskPlan,
    ) -> Result<Self, OpenError> {
        let open = |output: &OutputPlan| {
            let layout = layout(output, task.schedule.period_ns);
            Ok::<_, OpenError>(OutputPort {
                service: output.service.clone(),
                publisher: FramePublisher::open(participant, &output.service, &layout)?,
            })
        };
        Ok(Self { ports: task.outputs.iter().map(open).collect::<Result<_, OpenError>>()? })
    }

    /// Copies the outputs into the frames that were loaned beforehand, and sends them.
    pub(crate) fn send(&mut self, engine: &TaskEngine, release: &Release) {
        for (output, port) in self.ports.iter_mut().enumerate() {
            if let Some(values) = port.publisher.values_mut() {
                engine.read_output(output, values);
            }
            let stamp = Stamp {
                cycle: release.cycle,
                release_ns: release.release_ns,
                source_ns: engine.output_source_ns(output),
                missed: release.missed,
            };
            // A frame that could not be sent is counted by the port.
            port.publisher.send(stamp, || Monotonic.now_ns());
        }
    }

    /// Connects to subscribers that came; for the slack.
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

    /// What makes good failed connections.
    pub(crate) fn repairs(&self) -> impl Iterator<Item = Repair> {
        self.ports.iter().map(|port| port.publisher.repair())
    }

    /// What every port sent.
    pub(crate) fn links(&self) -> impl Iterator<Item = LinkReport> {
        self.ports.iter().map(|port| {
            let counters = port.publisher.counters();
            LinkReport {
                service: port.service.clone(),
                frames: counters.sent,
                lost: counters.unsent + counters.send_errors,
                ..LinkReport::default()
            }
        })
    }
}

/// What an output's frames are.
pub(crate) fn layout(output: &OutputPlan, period_ns: u64) -> FrameLayout {
    let signal = |signal: &isochrone_engine::SignalPlan| {
        SignalSpec::new(signal.name.clone(), signal.value_type.to_string())
    };
    FrameLayout { signals: output.signals.iter().map(signal).collect(), period_ns: Some(period_ns) }
}
