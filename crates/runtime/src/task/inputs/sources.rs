//! The sources of a task's inputs, according to the plan.

use isochrone_engine::config::Binding;
use isochrone_engine::{InputPlan, TaskPlan};

use super::channel::Channel;
use crate::task::bindings::WantedSignal;

/// The number of channels assumed for frames whose signals are bound by name, if this node creates the service.
const CHANNELS_BY_NAME: usize = 1_000;

/// One service that a task reads, and the inputs that are channels of its frame.
pub(crate) struct ServiceInputs {
    pub(super) service: String,
    pub(super) names: Vec<String>,
    pub(super) wanted: Vec<WantedSignal>,
    pub(super) channels: Vec<Channel>,
    /// The task, if it follows the service.
    pub(super) follower: Option<String>,
}

/// The sources of a task's inputs.
pub(crate) struct TaskInputs {
    pub(super) services: Vec<ServiceInputs>,
    pub(super) set: Vec<Channel>,
    pub(super) followed: CycleTrigger,
    /// Inputs begin with values of an earlier run.
    pub(super) are_restored: bool,
}

/// What a cycle of a task waits for after its release.
pub(crate) enum CycleTrigger {
    Nothing,
    /// Frames of a service, by its index.
    Port(usize),
    /// Values that the program gives these inputs, by their index in the plan.
    Given(Box<[usize]>),
}

impl TaskInputs {
    /// For a node with services: inputs that name none are set by hand.
    pub(crate) fn of(task: &TaskPlan) -> Self {
        let all = || task.inputs.iter().enumerate();
        let mut services: Vec<&String> = all().flat_map(|(_, input)| &input.service).collect();
        services.sort();
        services.dedup();
        let read = |(index, input): (usize, &InputPlan)| Channel::of_service(index, input, task);
        let is_followed =
            |service: &&String| Some(service.as_str()) == task.settings.followed_service();
        let inputs_of = |service: &String| {
            let inputs: Vec<_> =
                all().filter(|(_, input)| input.service.as_ref() == Some(service)).collect();
            ServiceInputs {
                service: service.clone(),
                names: inputs.iter().map(|(_, input)| input.name.clone()).collect(),
                wanted: inputs.iter().map(|(_, input)| wanted(input)).collect(),
                channels: inputs.into_iter().map(read).collect(),
                follower: is_followed(&service).then(|| task.name.clone()),
            }
        };
        let set = all().filter(|(_, input)| input.service.is_none());
        let set = set.map(|(index, input)| Channel::of_program(index, input, task)).collect();
        let followed = services.iter().position(is_followed);
        let followed = followed.map_or(CycleTrigger::Nothing, CycleTrigger::Port);
        let services = services.into_iter().map(inputs_of).collect();
        Self { services, set, followed, are_restored: false }
    }

    /// For a node without services.
    pub(crate) fn set_by_hand(task: &TaskPlan) -> Self {
        let inputs = task.inputs.iter().enumerate();
        let set = inputs.map(|(index, input)| Channel::of_program(index, input, task)).collect();
        let followed = task.settings.followed_service().map(|followed| {
            let inputs = task.inputs.iter().enumerate();
            inputs.filter(|(_, i)| i.service.as_deref() == Some(followed)).map(|(i, _)| i).collect()
        });
        let followed = followed.map_or(CycleTrigger::Nothing, CycleTrigger::Given);
        Self { services: Vec::new(), set, followed, are_restored: false }
    }

    /// Has inputs begin with these values of an earlier run, by their index in the plan.
    pub(crate) fn restore(&mut self, values: &[(usize, f64)]) {
        let read = self.services.iter_mut().flat_map(|service| &mut service.channels);
        for channel in read.chain(&mut self.set) {
            let restored = values.iter().find(|(input, _)| *input == channel.input);
            if let Some((_, value)) = restored {
                channel.freshness.restore(*value);
            }
        }
        self.are_restored = !values.is_empty();
    }
}

fn wanted(input: &InputPlan) -> WantedSignal {
    WantedSignal { binding: input.binding.clone(), value_type: input.value_type.to_string() }
}

pub(super) fn channels_of(wanted: &WantedSignal) -> usize {
    match wanted.binding {
        Binding::Channel(channel) => channel + 1,
        Binding::Signal(_) => CHANNELS_BY_NAME,
    }
}
