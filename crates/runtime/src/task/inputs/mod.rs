//! A task's inputs: the frames that they are read from, and their quality.

mod channel;
mod port;
mod sources;

use channel::{Change, Channel};
use isochrone_cyclic::{Clock, Look, Monotonic, Release, thread_allocations};
use isochrone_engine::{GivenSample, TaskEngine};
use isochrone_ipc::{Depth, Flags, ForRealTime, OpenError, RealTime, Service};
use isochrone_timing::{Direction, InputReport, LinkReport};
use port::CREDIBLE_DELAY_NS;
pub(crate) use port::InputPort;
pub(crate) use sources::{CycleTrigger, TaskInputs};
use sources::{ServiceInputs, channels_of};

use crate::node::alarms::Alarm;
use crate::task::bindings::{Desk, ServiceObservations, ends};
use crate::task::events::EventSender;
use crate::task::freshness::Sample;
use crate::task::orders::Applier;

/// The ports of a task's inputs.
pub(crate) struct InputPorts<S: Service> {
    ports: Vec<InputPort<S>>,
    followed: CycleTrigger,
    /// Inputs that are set by hand.
    set: Vec<Channel>,
    rejects: u64,
    /// An input begins with the value of an earlier run, and no sample has come for it yet.
    are_restored: bool,
}

impl<S: Service> InputPorts<S> {
    /// Opens a subscriber for each service. The desks resolve the inputs' names in the ordinary thread.
    pub(crate) fn open(
        participant: &RealTime<S>,
        inputs: TaskInputs,
    ) -> Result<(ForRealTime<Self>, Vec<Desk>), OpenError> {
        let TaskInputs { services, set, followed, are_restored } = inputs;
        let mut desks = Vec::new();
        let mut ports = Vec::new();
        for ServiceInputs { service, names, wanted, channels, follower } in services {
            let most = wanted.iter().map(channels_of).max().unwrap_or(1);
            let subscriber = participant.subscriber(&service, most, Depth::Newest)?;
            let (resolved, mut desk) = ends(&service, names, wanted);
            desk.follower = follower;
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
                published_ns: None,
            }));
        }
        let ports: ForRealTime<Vec<_>> = ports.into_iter().collect();
        Ok((ports.map(|ports| Self { ports, followed, set, rejects: 0, are_restored }), desks))
    }

    /// The inputs of a node without services.
    pub(crate) fn without_ports(inputs: TaskInputs) -> Self {
        let TaskInputs { set, followed, are_restored, .. } = inputs;
        Self { ports: Vec::new(), followed, set, rejects: 0, are_restored }
    }

    /// Whether the frame that the task follows, or the value that the program gives, has arrived for this cycle.
    ///
    /// The task polls this while it waits. A frame is kept for the next [`read`](Self::read).
    pub(crate) fn has_arrived(&mut self, orders: &mut Applier, look: Look) -> bool {
        let port = match &self.followed {
            CycleTrigger::Nothing => return false,
            CycleTrigger::Given(inputs) => return orders.gives(look.cycle, inputs),
            CycleTrigger::Port(port) => self.ports.get_mut(*port),
        };
        let Some(port) = port else { return false };
        let before = thread_allocations();
        let has_come = port.subscriber.has_newer(look.now_ns, |header| {
            // A stamp far in the past is not of this clock.
            let behind_ns = look.since_ns.saturating_sub(header.publish_ns);
            behind_ns == 0 || behind_ns > CREDIBLE_DELAY_NS
        });
        port.allocations += thread_allocations() - before;
        has_come
    }

    /// The port of the service that the task follows, if it follows frames.
    pub(crate) fn followed(&self) -> Option<&InputPort<S>> {
        let CycleTrigger::Port(port) = self.followed else { return None };
        self.ports.get(port)
    }

    /// Reads the newest frame of every service, and the quality of the inputs, into the image.
    pub(crate) fn read(&mut self, engine: &mut TaskEngine, release: &Release) {
        let now_ns = release.start_ns;
        for port in &mut self.ports {
            self.rejects += port.read(now_ns);
        }
        for channel in &mut self.set {
            if let Some(GivenSample { value, source_ns }) = engine.take_given(channel.input) {
                let (sampled_ns, flags) = (source_ns, Flags::NONE);
                channel.freshness.offer(Sample { value, sampled_ns, source_ns, flags });
            }
        }
        for channel in self.channels_mut() {
            channel.read(engine, release);
        }
        if self.are_restored {
            let is_awaited = |channel: &mut Channel| channel.freshness.awaits_sample();
            let are_restored = self.channels_mut().any(is_awaited);
            self.are_restored = are_restored;
        }
    }

    /// The flags of all frames of the task.
    pub(crate) fn flags(&self) -> Flags {
        if self.are_restored { Flags::RESTORED } else { Flags::NONE }
    }

    fn channels_mut(&mut self) -> impl Iterator<Item = &mut Channel> {
        self.ports.iter_mut().flat_map(|port| &mut port.channels).chain(&mut self.set)
    }

    /// Connects to publishers that joined, and reports observations to the ordinary thread; for the slack.
    pub(crate) fn maintain(&mut self) {
        for port in &mut self.ports {
            port.subscriber.maintain();
            let other_writers = port.subscriber.counters().other_writers;
            ServiceObservations::store(&port.resolved.observed.other_writers, other_writers);
        }
    }

    /// Reports changes in the state of each input; for the slack.
    pub(crate) fn tell(&mut self, events: &mut EventSender) {
        for channel in self.channels_mut() {
            if let Some(Change { to, cycle }) = channel.changed
                && events.tell_input(channel.input, to, cycle)
            {
                channel.reported = Some(to);
                channel.changed = None;
            }
        }
    }

    /// Whether the inputs were ok, in the order of the plan.
    pub(crate) fn reports(&self) -> Vec<InputReport> {
        self.channels().into_iter().map(Channel::report).collect()
    }

    /// The inputs that were not ok, in the order of the plan, for the report.
    pub(crate) fn alarms(&self) -> Vec<Alarm> {
        self.channels().into_iter().filter_map(Channel::alarm).collect()
    }

    /// In the order of the plan.
    fn channels(&self) -> Vec<&Channel> {
        let read = self.ports.iter().flat_map(|port| &port.channels);
        let mut channels: Vec<_> = read.chain(&self.set).collect();
        channels.sort_by_key(|channel| channel.input);
        channels
    }

    /// Samples that were rejected because the type of the input cannot hold them, or the frame has none for it.
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

    /// What every port received. How long that took is measured by observers.
    pub(crate) fn links(&self) -> impl Iterator<Item = LinkReport> {
        self.ports.iter().map(|port| {
            let counters = port.subscriber.counters();
            LinkReport {
                service: port.service.clone(),
                direction: Some(Direction::Received),
                frames: counters.received,
                lost: counters.lost,
                restarts: Some(counters.restarts),
                other_writers: Some(counters.other_writers),
                future_stamps: Some(port.future_stamps),
                past_stamps: Some(port.past_stamps),
                unknown_layouts: Some(port.unknown_layouts),
                ..LinkReport::default()
            }
        })
    }
}
