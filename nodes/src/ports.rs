//! A task's inputs and outputs: which port and channel each belongs to.

use isochrone_cyclic::{Clock, Monotonic, Release};
use isochrone_engine::config::OnStale;
use isochrone_engine::{InputPlan, OutputPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, OpenError, Participant, Repair,
    SignalSpec, Stamp, ipc,
};

type Service = ipc::Service;

/// The services that a task reads.
pub(crate) struct InputPorts {
    ports: Vec<InputPort>,
    rejects: u64,
}

/// One service, and the inputs that are channels of its frame.
struct InputPort {
    service: String,
    subscriber: FrameSubscriber<Service>,
    channels: Vec<Channel>,
}

struct Channel {
    /// Index of the input in the plan.
    input: usize,
    /// Index in the frame.
    channel: usize,
    max_age_ns: Option<u64>,
    on_stale: OnStale,
    /// When the last good sample was published.
    sample_ns: Option<u64>,
}

impl InputPorts {
    /// Opens a subscriber for each service that a task's inputs name.
    pub(crate) fn open(
        participant: &Participant<Service>,
        task: &TaskPlan,
    ) -> Result<Self, OpenError> {
        let mut services: Vec<&String> =
            task.inputs.iter().flat_map(|input| &input.service).collect();
        services.sort();
        services.dedup();
        let open = |service: &String| {
            let of_service =
                |(_, input): &(usize, &InputPlan)| input.service.as_ref() == Some(service);
            let inputs: Vec<_> = task.inputs.iter().enumerate().filter(of_service).collect();
            let expected = expected_layout(inputs.iter().map(|(_, input)| *input));
            Ok::<_, OpenError>(InputPort {
                service: service.clone(),
                subscriber: FrameSubscriber::open(participant, service, &expected, Depth::Newest)?,
                channels: inputs.iter().map(|(index, input)| Channel::new(*index, input)).collect(),
            })
        };
        let ports = services.into_iter().map(open).collect::<Result<_, OpenError>>()?;
        Ok(Self { ports, rejects: 0 })
    }

    /// Reads the newest frame of every service into the image.
    pub(crate) fn read(&mut self, engine: &mut TaskEngine, now_ns: u64) {
        for port in &mut self.ports {
            if let Some(frame) = port.subscriber.newest() {
                for channel in &mut port.channels {
                    let sample = frame.values().get(channel.channel);
                    if !channel.take(engine, sample, frame.header().publish_ns) {
                        self.rejects += 1;
                    }
                }
            }
            for channel in &mut port.channels {
                channel.expire(engine, now_ns);
            }
        }
    }

    /// Connects to publishers that came; for the slack.
    pub(crate) fn maintain(&mut self) {
        self.ports.iter_mut().for_each(|port| port.subscriber.maintain());
    }

    /// Samples that were rejected: their input's type cannot hold them, or the frame is too short.
    pub(crate) fn rejects(&self) -> u64 {
        self.rejects
    }

    /// How often a publisher was seen to come or go.
    pub(crate) fn connects(&self) -> u64 {
        self.ports.iter().map(|port| port.subscriber.counters().connects).sum()
    }

    /// How many connections to a publisher failed.
    pub(crate) fn connect_errors(&self) -> u64 {
        self.ports.iter().map(|port| port.subscriber.counters().connect_errors).sum()
    }

    /// What makes good failed connections.
    pub(crate) fn repairs(&self) -> impl Iterator<Item = Repair> {
        self.ports.iter().map(|port| port.subscriber.repair())
    }

    /// Service, frames received, and frames that newer ones pushed out, of every port.
    pub(crate) fn received(&self) -> impl Iterator<Item = (&str, u64, u64)> {
        self.ports.iter().map(|port| {
            let counters = port.subscriber.counters();
            (port.service.as_str(), counters.received, counters.lost)
        })
    }
}

impl Channel {
    fn new(input: usize, plan: &InputPlan) -> Self {
        Self {
            input,
            channel: plan.channel,
            max_age_ns: plan.max_age_ns,
            on_stale: plan.on_stale,
            sample_ns: None,
        }
    }

    /// Takes a sample over; `false` if it was rejected.
    fn take(&mut self, engine: &mut TaskEngine, sample: Option<&f64>, publish_ns: u64) -> bool {
        let taken = sample.is_some_and(|sample| engine.set_input(self.input, *sample, publish_ns));
        if taken {
            self.sample_ns = Some(publish_ns);
        }
        taken
    }

    /// Falls back to the default if the sample is too old and the configuration wants that.
    fn expire(&mut self, engine: &mut TaskEngine, now_ns: u64) {
        let (Some(max_age_ns), Some(sample_ns)) = (self.max_age_ns, self.sample_ns) else { return };
        if self.on_stale == OnStale::Default && now_ns.saturating_sub(sample_ns) > max_age_ns {
            engine.reset_input(self.input);
            self.sample_ns = None;
        }
    }
}

/// What a frame must have at least, so that these inputs can be read from it.
fn expected_layout<'a>(inputs: impl Iterator<Item = &'a InputPlan>) -> FrameLayout {
    let mut signals: Vec<SignalSpec> = Vec::new();
    for input in inputs {
        if signals.len() <= input.channel {
            signals.resize_with(input.channel + 1, SignalSpec::default);
        }
        if let Some(signal) = signals.get_mut(input.channel) {
            signal.value_type = input.value_type.to_string();
        }
    }
    FrameLayout { signals, period_ns: None }
}

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
            let layout = layout(output, task.period_ns);
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

    /// Service, frames sent, and frames that could not be sent, of every port.
    pub(crate) fn sent(&self) -> impl Iterator<Item = (&str, u64, u64)> {
        self.ports.iter().map(|port| {
            let counters = port.publisher.counters();
            (port.service.as_str(), counters.sent, counters.unsent + counters.send_errors)
        })
    }
}

/// How an output's frame describes itself.
pub(crate) fn layout(output: &OutputPlan, period_ns: u64) -> FrameLayout {
    let signal = |signal: &isochrone_engine::SignalPlan| SignalSpec {
        name: signal.name.clone(),
        value_type: signal.value_type.to_string(),
    };
    FrameLayout { signals: output.signals.iter().map(signal).collect(), period_ns: Some(period_ns) }
}
