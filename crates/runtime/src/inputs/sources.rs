//! What a task's inputs are read from, as the plan has it.

use isochrone_engine::config::Binding;
use isochrone_engine::{InputPlan, TaskPlan};

use super::channel::Channel;
use crate::bindings::Wanted;

/// How many channels a frame is taken for whose signals are bound by name, where this node creates
/// the service.
const CHANNELS_BY_NAME: usize = 1_000;

/// One service that a task reads, and the inputs that are channels of its frame.
pub(crate) struct ServiceInputs {
    pub(super) service: String,
    pub(super) names: Vec<String>,
    pub(super) wanted: Vec<Wanted>,
    pub(super) channels: Vec<Channel>,
    /// The task, if it follows the service.
    pub(super) follower: Option<String>,
}

/// What a task's inputs are read from.
pub(crate) struct TaskInputs {
    pub(super) services: Vec<ServiceInputs>,
    pub(super) set: Vec<Channel>,
    pub(super) followed: Followed,
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
        let followed = followed.map_or(Followed::Nothing, Followed::Port);
        Self { services: services.into_iter().map(inputs_of).collect(), set, followed }
    }

    /// Of a node without services.
    pub(crate) fn set_by_hand(task: &TaskPlan) -> Self {
        let inputs = task.inputs.iter().enumerate();
        let set = inputs.map(|(index, input)| Channel::of_program(index, input, task)).collect();
        let followed = task.settings.followed_service().map(|followed| {
            let inputs = task.inputs.iter().enumerate();
            inputs.filter(|(_, i)| i.service.as_deref() == Some(followed)).map(|(i, _)| i).collect()
        });
        let followed = followed.map_or(Followed::Nothing, Followed::Given);
        Self { services: Vec::new(), set, followed }
    }
}

fn wanted(input: &InputPlan) -> Wanted {
    Wanted { binding: input.binding.clone(), value_type: input.value_type.to_string() }
}

pub(super) fn channels_of(wanted: &Wanted) -> usize {
    match wanted.binding {
        Binding::Channel(channel) => channel + 1,
        Binding::Signal(_) => CHANNELS_BY_NAME,
    }
}
