//! A task's inputs: the frames that they are read from, and what those are worth.

use std::sync::atomic::Ordering;

use isochrone_cyclic::{Clock, Monotonic, thread_allocations};
use isochrone_engine::config::{self, OnStale};
use isochrone_engine::{InputPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{
    Binding, Credible, Depth, ForRealTime, FrameSubscriber, OpenError, RealTime, Service, Stamps,
    Wanted,
};

use crate::bindings::{Desk, Observed, Resolved, ends};
use crate::events::{Events, InputState};
use crate::outcome::Link;

/// A frame that is older than any wait in this process by so much has a stamp of another clock.
const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;
/// How many channels a frame is taken for whose signals are bound by name, where this node creates
/// the service.
const CHANNELS_BY_NAME: usize = 1_000;

/// One service that a task reads, and the inputs that are channels of its frame.
pub(crate) struct ServiceInputs {
    service: String,
    names: Vec<String>,
    wanted: Vec<Wanted>,
    channels: Vec<Channel>,
}

/// The services that a task's inputs name.
pub(crate) fn of_task(task: &TaskPlan) -> Vec<ServiceInputs> {
    let mut services: Vec<&String> = task.inputs.iter().flat_map(|input| &input.service).collect();
    services.sort();
    services.dedup();
    let inputs_of = |service: &String| {
        let of_service = |(_, input): &(usize, &InputPlan)| input.service.as_ref() == Some(service);
        let inputs: Vec<_> = task.inputs.iter().enumerate().filter(of_service).collect();
        ServiceInputs {
            service: service.clone(),
            names: inputs.iter().map(|(_, input)| input.name.clone()).collect(),
            wanted: inputs.iter().map(|(_, input)| wanted(input)).collect(),
            channels: inputs.iter().map(|(index, input)| Channel::new(*index, input)).collect(),
        }
    };
    services.into_iter().map(inputs_of).collect()
}

/// The ports of a task's inputs.
pub(crate) struct InputPorts<S: Service> {
    ports: Vec<InputPort<S>>,
    rejects: u64,
}

/// One service, and the inputs that are channels of its frame.
struct InputPort<S: Service> {
    service: String,
    subscriber: FrameSubscriber<S>,
    resolved: Resolved,
    channels: Vec<Channel>,
    /// When frames were last looked for.
    looked_ns: u64,
    future_stamps: u64,
    past_stamps: u64,
    unknown_layouts: u64,
    /// Of iceoryx2, in the cycle: it connects a publisher that joined just before.
    allocations: u64,
}

struct Channel {
    /// Index of the input in the plan.
    input: usize,
    max_age_ns: Option<u64>,
    on_stale: OnStale,
    /// From when the age of the last good sample counts.
    sampled_ns: Option<u64>,
    /// What is to be said of it, and what was said.
    state: InputState,
    told: InputState,
}

impl<S: Service> InputPorts<S> {
    /// Opens a subscriber for each service. The desks resolve the inputs' names, in the ordinary
    /// thread.
    pub(crate) fn open(
        participant: &RealTime<S>,
        services: Vec<ServiceInputs>,
    ) -> Result<(ForRealTime<Self>, Vec<Desk>), OpenError> {
        let mut desks = Vec::new();
        let mut ports = Vec::new();
        for ServiceInputs { service, names, wanted, channels } in services {
            let most = wanted.iter().map(channels_of).max().unwrap_or(1);
            let subscriber = participant.subscriber(&service, most, Depth::Newest)?;
            let (resolved, desk) = ends(&service, names, wanted);
            desks.push(desk);
            ports.push(subscriber.map(|subscriber| InputPort {
                service,
                subscriber,
                resolved,
                channels,
                looked_ns: Monotonic.now_ns(),
                future_stamps: 0,
                past_stamps: 0,
                unknown_layouts: 0,
                allocations: 0,
            }));
        }
        let ports: ForRealTime<Vec<_>> = ports.into_iter().collect();
        Ok((ports.map(|ports| Self { ports, rejects: 0 }), desks))
    }

    /// The inputs of a node without services.
    pub(crate) fn none() -> Self {
        Self { ports: Vec::new(), rejects: 0 }
    }

    /// Reads the newest frame of every service into the image.
    pub(crate) fn read(&mut self, engine: &mut TaskEngine, now_ns: u64) {
        for port in &mut self.ports {
            self.rejects += port.read(engine, now_ns);
            for channel in &mut port.channels {
                channel.expire(engine, now_ns);
            }
        }
    }

    /// Connects to publishers that came, and tells the ordinary thread what was seen; for the slack.
    pub(crate) fn maintain(&mut self) {
        for port in &mut self.ports {
            port.subscriber.maintain();
            let other_writers = port.subscriber.counters().other_writers;
            Observed::store(&port.resolved.observed.other_writers, other_writers);
        }
    }

    /// Says of each input what has become of it; for the slack.
    pub(crate) fn tell(&mut self, events: &mut Events) {
        for channel in self.ports.iter_mut().flat_map(|port| &mut port.channels) {
            if channel.state != channel.told && events.tell_input(channel.input, channel.state) {
                channel.told = channel.state;
            }
        }
    }

    /// Samples that were rejected: their input's type cannot hold them, or the frame has none for it.
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

    /// Allocations of iceoryx2 while it received.
    pub(crate) fn allocations(&self) -> u64 {
        self.ports.iter().map(|port| port.allocations).sum()
    }

    /// What every port received. How long it took is for observers to say.
    pub(crate) fn links(&self) -> impl Iterator<Item = Link> {
        self.ports.iter().map(|port| {
            let counters = port.subscriber.counters();
            Link {
                service: port.service.clone(),
                frames: counters.received,
                lost: counters.lost,
                restarts: counters.restarts,
                other_writers: counters.other_writers,
                future_stamps: port.future_stamps,
                past_stamps: port.past_stamps,
                unknown_layouts: port.unknown_layouts,
            }
        })
    }
}

impl<S: Service> InputPort<S> {
    /// Reads the newest frame, if there is one; returns how many samples were rejected.
    fn read(&mut self, engine: &mut TaskEngine, now_ns: u64) -> u64 {
        if let Some(period_ns) = self.resolved.update() {
            self.subscriber.set_period(period_ns);
        }
        let waited_ns = now_ns.saturating_sub(std::mem::replace(&mut self.looked_ns, now_ns));
        let before = thread_allocations();
        let frame = self.subscriber.newest(now_ns);
        self.allocations += thread_allocations() - before;
        let Some(frame) = frame else { return 0 };
        let header = frame.header();
        let observed = &self.resolved.observed;
        observed.is_plain.store(header.layout == 0, Ordering::Relaxed);
        let Some(bindings) = self.resolved.of(header.layout) else {
            self.unknown_layouts += 1;
            Observed::store(&observed.unknown_layout, header.layout);
            return self.channels.len() as u64;
        };
        Observed::store(&observed.unknown_layout, 0);
        // A frame that came after the cycle had begun is not from the future.
        let arrival_ns = if header.publish_ns > now_ns { Monotonic.now_ns() } else { now_ns };
        let credible = header.credible(bindings.clock, arrival_ns);
        let age_ns = arrival_ns.saturating_sub(header.publish_ns);
        if credible.stamps == Stamps::Future {
            self.future_stamps += 1;
            Observed::store(&observed.ahead_ns, header.publish_ns.saturating_sub(arrival_ns));
        } else if credible.stamps == Stamps::Believed
            && age_ns > waited_ns.saturating_add(CREDIBLE_DELAY_NS)
        {
            self.past_stamps += 1;
            Observed::store(&observed.behind_ns, age_ns);
        }
        let mut rejects = 0;
        for (channel, place) in self.channels.iter_mut().zip(&bindings.places) {
            let sample = place.and_then(|place| frame.values().get(place));
            rejects += u64::from(!channel.take(engine, sample, &credible));
        }
        rejects
    }
}

impl Channel {
    fn new(input: usize, plan: &InputPlan) -> Self {
        let (state, told) = (InputState::Fresh, InputState::Fresh);
        let (max_age_ns, on_stale) = (plan.max_age_ns, plan.on_stale);
        Self { input, max_age_ns, on_stale, sampled_ns: None, state, told }
    }

    /// Takes a sample over; `false` if it was rejected.
    fn take(&mut self, engine: &mut TaskEngine, sample: Option<&f64>, times: &Credible) -> bool {
        let Some(sample) = sample.copied() else { return false };
        let taken = engine.set_input(self.input, sample, times.source_ns);
        if taken {
            self.sampled_ns = Some(times.sampled_ns);
            self.state = InputState::Fresh;
        } else if !matches!(self.state, InputState::Rejected(_)) {
            // The first of a row is told.
            self.state = InputState::Rejected(sample);
        }
        taken
    }

    /// Notes that the sample is too old, and falls back to the default if the configuration wants it.
    fn expire(&mut self, engine: &mut TaskEngine, now_ns: u64) {
        let (Some(max_age_ns), Some(sampled_ns)) = (self.max_age_ns, self.sampled_ns) else {
            return;
        };
        if now_ns.saturating_sub(sampled_ns) <= max_age_ns {
            return;
        }
        if self.state == InputState::Fresh {
            self.state = InputState::Stale;
        }
        if self.on_stale == OnStale::Default {
            engine.reset_input(self.input);
            self.sampled_ns = None;
        }
    }
}

fn wanted(input: &InputPlan) -> Wanted {
    let binding = match &input.binding {
        config::Binding::Channel(channel) => Binding::Channel(*channel),
        config::Binding::Signal(signal) => Binding::Signal(signal.clone()),
    };
    Wanted { binding, value_type: input.value_type.to_string() }
}

fn channels_of(wanted: &Wanted) -> usize {
    match wanted.binding {
        Binding::Channel(channel) => channel + 1,
        Binding::Signal(_) => CHANNELS_BY_NAME,
    }
}
