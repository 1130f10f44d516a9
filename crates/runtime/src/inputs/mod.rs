//! A task's inputs: the frames that they are read from, and what those are worth.

use std::sync::atomic::Ordering;

use isochrone_cyclic::{Clock, Look, Monotonic, Release, thread_allocations};
use isochrone_engine::config;
use isochrone_engine::{GivenSample, InputPlan, TaskEngine, TaskPlan};
use isochrone_ipc::{
    Binding, Depth, Flags, ForRealTime, FrameHeader, FrameSubscriber, OpenError, RealTime, Service,
    Stamps, Wanted,
};
use isochrone_timing::Direction;

use crate::bindings::{Desk, Observed, Resolved, ends};
use crate::events::Events;
use crate::freshness::{Freshness, InputState, Sample, Tally};
use crate::orders::Applier;
use crate::outcome::{InputOutcome, Link};

/// A frame that is older than any wait in this process by so much has a stamp of another clock.
const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;
/// How old the oldest sample behind a fresh frame may be before that is an alarm.
const OLD_SOURCE_NS: u64 = 10_000_000_000;
/// How long an input may be without its first sample before that is said: publishers announce their
/// layout within half of it.
const PATIENCE_NS: u64 = 1_000_000_000;
/// How many channels a frame is taken for whose signals are bound by name, where this node creates
/// the service.
const CHANNELS_BY_NAME: usize = 1_000;

/// One service that a task reads, and the inputs that are channels of its frame.
pub(crate) struct ServiceInputs {
    service: String,
    names: Vec<String>,
    wanted: Vec<Wanted>,
    channels: Vec<Channel>,
    /// The task, if it follows the service.
    follower: Option<String>,
}

/// What a task's inputs are read from.
pub(crate) struct TaskInputs {
    services: Vec<ServiceInputs>,
    set: Vec<Channel>,
    followed: Followed,
}

/// What the cycles of a task begin with, beside their releases.
pub(crate) enum Followed {
    Nothing,
    /// Frames of a service, by its place.
    Port(usize),
    /// Values that the program gives these inputs, by their places in the plan.
    Given(Box<[usize]>),
}

impl TaskInputs {
    /// Of a node that has services: inputs that name none are set by hand.
    pub(crate) fn of(task: &TaskPlan) -> Self {
        let all = || task.inputs.iter().enumerate();
        let mut services: Vec<&String> = all().flat_map(|(_, input)| &input.service).collect();
        services.sort();
        services.dedup();
        let channel = |(index, input): (usize, &InputPlan)| Channel::new(index, input, task);
        let is_followed = |service: &&String| Some(*service) == task.followed_service.as_ref();
        let inputs_of = |service: &String| {
            let inputs: Vec<_> =
                all().filter(|(_, input)| input.service.as_ref() == Some(service)).collect();
            ServiceInputs {
                service: service.clone(),
                names: inputs.iter().map(|(_, input)| input.name.clone()).collect(),
                wanted: inputs.iter().map(|(_, input)| wanted(input)).collect(),
                channels: inputs.into_iter().map(channel).collect(),
                follower: is_followed(&service).then(|| task.name.clone()),
            }
        };
        let set = all().filter(|(_, input)| input.service.is_none()).map(channel).collect();
        let followed = services.iter().position(is_followed);
        let followed = followed.map_or(Followed::Nothing, Followed::Port);
        Self { services: services.into_iter().map(inputs_of).collect(), set, followed }
    }

    /// Of a node without services.
    pub(crate) fn set_by_hand(task: &TaskPlan) -> Self {
        let inputs = task.inputs.iter().enumerate();
        let set = inputs.map(|(index, input)| Channel::new(index, input, task)).collect();
        let followed = task.followed_service.as_ref().map(|followed| {
            let inputs = task.inputs.iter().enumerate();
            inputs.filter(|(_, i)| i.service.as_ref() == Some(followed)).map(|(i, _)| i).collect()
        });
        let followed = followed.map_or(Followed::Nothing, Followed::Given);
        Self { services: Vec::new(), set, followed }
    }
}

/// The ports of a task's inputs.
pub(crate) struct InputPorts<S: Service> {
    ports: Vec<InputPort<S>>,
    followed: Followed,
    /// Inputs that are set by hand.
    set: Vec<Channel>,
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
    /// When the newest frame was published, in ns, if its stamp can be believed.
    published_ns: Option<u64>,
}

struct Channel {
    /// Index of the input in the plan.
    input: usize,
    name: String,
    service: Option<String>,
    freshness: Freshness,
    /// What was said of it last, and the first cycle in which that was no longer so.
    told: Option<InputState>,
    changed: Option<Change>,
    first_ns: Option<u64>,
}

/// A change of what is to be said of an input.
#[derive(Clone, Copy)]
struct Change {
    to: InputState,
    cycle: u64,
}

impl<S: Service> InputPorts<S> {
    /// Opens a subscriber for each service. The desks resolve the inputs' names, in the ordinary
    /// thread.
    pub(crate) fn open(
        participant: &RealTime<S>,
        inputs: TaskInputs,
    ) -> Result<(ForRealTime<Self>, Vec<Desk>), OpenError> {
        let TaskInputs { services, set, followed } = inputs;
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
        Ok((ports.map(|ports| Self { ports, followed, set, rejects: 0 }), desks))
    }

    /// The inputs of a node without services.
    pub(crate) fn without_ports(inputs: TaskInputs) -> Self {
        Self { ports: Vec::new(), followed: inputs.followed, set: inputs.set, rejects: 0 }
    }

    /// Whether what the task follows has come for this cycle: a frame, or a value that the program gives.
    ///
    /// Asked again and again while the task waits for it. A frame is kept for the next
    /// [`read`](Self::read).
    pub(crate) fn has_arrived(&mut self, orders: &mut Applier, look: Look) -> bool {
        let port = match &self.followed {
            Followed::Nothing => return false,
            Followed::Given(inputs) => return orders.gives(look.cycle, inputs),
            Followed::Port(port) => self.ports.get_mut(*port),
        };
        let Some(port) = port else { return false };
        let before = thread_allocations();
        let has_come = port.subscriber.has_newer(look.now_ns, |header| {
            // A stamp that lies far back is no time of this clock.
            let behind_ns = look.since_ns.saturating_sub(header.publish_ns);
            behind_ns == 0 || behind_ns > CREDIBLE_DELAY_NS
        });
        port.allocations += thread_allocations() - before;
        has_come
    }

    /// When the newest frame of the service that the task follows was published, in ns; `None` if its
    /// stamp cannot be believed, or there are no frames.
    pub(crate) fn followed_ns(&self) -> Option<u64> {
        let Followed::Port(port) = self.followed else { return None };
        self.ports.get(port)?.published_ns
    }

    /// Reads the newest frame of every service into the image, and what the inputs are worth.
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
    }

    fn channels_mut(&mut self) -> impl Iterator<Item = &mut Channel> {
        self.ports.iter_mut().flat_map(|port| &mut port.channels).chain(&mut self.set)
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
        for channel in self.channels_mut() {
            if let Some(Change { to, cycle }) = channel.changed
                && events.tell_input(channel.input, to, cycle)
            {
                channel.told = Some(to);
                channel.changed = None;
            }
        }
    }

    /// How often and for how long the inputs were not ok, in the order of the plan.
    pub(crate) fn outcomes(&mut self) -> Vec<InputOutcome> {
        let mut outcomes: Vec<_> = self.channels_mut().map(|channel| channel.outcome()).collect();
        outcomes.sort_by_key(|(input, _)| *input);
        outcomes.into_iter().map(|(_, outcome)| outcome).collect()
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
                direction: Direction::Received,
                frames: counters.received,
                lost: counters.lost,
                restarts: Some(counters.restarts),
                other_writers: Some(counters.other_writers),
                future_stamps: Some(port.future_stamps),
                past_stamps: Some(port.past_stamps),
                unknown_layouts: Some(port.unknown_layouts),
            }
        })
    }
}

impl<S: Service> InputPort<S> {
    /// Takes over the newest frame, if there is one; returns how many samples were rejected.
    fn read(&mut self, now_ns: u64) -> u64 {
        if let Some(period_ns) = self.resolved.update() {
            self.subscriber.set_period(period_ns);
        }
        let waited_ns = now_ns.saturating_sub(std::mem::replace(&mut self.looked_ns, now_ns));
        let before = thread_allocations();
        let frame = self.subscriber.newest(now_ns);
        self.allocations += thread_allocations() - before;
        let Some(frame) = frame else { return 0 };
        self.published_ns = None;
        let header = frame.header();
        let observed = &self.resolved.observed;
        observed.is_plain.store(header.layout == 0, Ordering::Relaxed);
        let Some(bindings) = self.resolved.of(header.layout) else {
            self.unknown_layouts += 1;
            Observed::store(&observed.unknown_layout, header.layout);
            self.channels.iter_mut().for_each(|channel| channel.freshness.miss(header.flags()));
            return self.channels.len() as u64;
        };
        Observed::store(&observed.unknown_layout, 0);
        // A frame that came after the cycle had begun is not from the future.
        let arrival_ns = if header.publish_ns > now_ns { Monotonic.now_ns() } else { now_ns };
        let credible = header.credible(bindings.clock, arrival_ns);
        let age_ns = arrival_ns.saturating_sub(header.publish_ns);
        let is_believed = matches!(credible.stamps, Stamps::Believed);
        self.published_ns = is_believed.then_some(header.publish_ns);
        match credible.stamps {
            Stamps::Future => {
                self.future_stamps += 1;
                Observed::store(&observed.ahead_ns, header.publish_ns.saturating_sub(arrival_ns));
            }
            Stamps::Believed if age_ns > waited_ns.saturating_add(CREDIBLE_DELAY_NS) => {
                self.past_stamps += 1;
                Observed::store(&observed.behind_ns, age_ns);
            }
            Stamps::Believed => note_old_source(observed, header),
            Stamps::Foreign => {}
        }
        let mut rejects = 0;
        for (channel, place) in self.channels.iter_mut().zip(&bindings.places) {
            let value = place.and_then(|place| frame.values().get(place));
            let is_taken = value.is_some_and(|value| {
                channel.freshness.offer(Sample {
                    value: *value,
                    sampled_ns: credible.sampled_ns,
                    source_ns: credible.source_ns,
                    flags: header.flags(),
                })
            });
            if value.is_none() {
                channel.freshness.miss(header.flags());
            }
            rejects += u64::from(!is_taken);
        }
        rejects
    }
}

/// Samples go round in a loop of nodes, or come from a publisher whose death nobody has noticed.
fn note_old_source(observed: &Observed, header: &FrameHeader) {
    let behind_ns = header.publish_ns.saturating_sub(header.source_ns);
    // A frame that says itself what it is worth comes from a node that has noticed.
    let is_flagged = !header.flags().without(Flags::FORCED | Flags::STOPPED).is_empty();
    if header.source_ns > 0 && behind_ns > OLD_SOURCE_NS && !is_flagged {
        Observed::store(&observed.old_source_ns, behind_ns);
    }
}

impl Channel {
    fn new(input: usize, plan: &InputPlan, task: &TaskPlan) -> Self {
        Self {
            input,
            name: plan.name.clone(),
            service: plan.service.clone(),
            freshness: Freshness::new(plan, task.schedule.period_ns),
            // Of one that is set by hand, nobody expects a sample.
            told: plan.service.is_none().then_some(InputState::Waiting),
            changed: None,
            first_ns: None,
        }
    }

    fn read(&mut self, engine: &mut TaskEngine, release: &Release) {
        engine.read_input(self.input, &self.freshness.read(release.start_ns));
        let to = self.freshness.state();
        let first_ns = *self.first_ns.get_or_insert(release.start_ns);
        let is_start =
            self.told.is_none() && release.start_ns.saturating_sub(first_ns) < PATIENCE_NS;
        let is_expected = is_start && matches!(to, InputState::Waiting | InputState::Missing);
        if is_expected || self.told.is_some_and(|told| told.is_like(to)) {
            self.changed = None;
        } else if self.changed.is_none_or(|changed| !changed.to.is_like(to)) {
            self.changed = Some(Change { to, cycle: release.cycle });
        }
    }

    fn outcome(&self) -> (usize, InputOutcome) {
        let Tally { falls, not_ok_ns } = self.freshness.tally();
        let is_ok = self.freshness.state().is_ok();
        let (name, service) = (self.name.clone(), self.service.clone());
        (self.input, InputOutcome { name, service, is_ok, falls, not_ok_ns })
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
