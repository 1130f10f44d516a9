//! The thread that serves the parameters of a node as those of a node of ROS.

use std::time::{Duration, Instant};

use isochrone_control::{Client, ClientError, SignalDescription};
use isochrone_ipc::{Domain, Participant, ipc};
use isochrone_processes::Stop;
use isochrone_recording::message::{Definitions, RosValue};
use rustdds::mio1::{Events as Wakes, Poll, Token};

use super::event::Events;
use super::requests::{Parameters, is_parameter};
use super::service::RosService;
use crate::dds::Dds;
use crate::failure::Failure;

/// How long a node may take to answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Between two looks whether the bridge is to stop.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);
/// How old the list of parameters may be.
const LIST_AGE: Duration = Duration::from_secs(5);

/// The services of parameters, with their types.
const SERVICES: [(&str, &str); 6] = [
    ("get_parameters", "GetParameters"),
    ("get_parameter_types", "GetParameterTypes"),
    ("list_parameters", "ListParameters"),
    ("describe_parameters", "DescribeParameters"),
    ("set_parameters", "SetParameters"),
    ("set_parameters_atomically", "SetParametersAtomically"),
];

/// A control node, when there is one.
struct Node<'p> {
    participant: &'p Participant<ipc::Service>,
    name: &'p str,
    client: Option<Client>,
    /// Its parameters, and when they were asked for.
    signals: Option<(Vec<SignalDescription>, Instant)>,
}

/// Serves the parameters of a node until it is to stop.
pub(crate) fn parameters(
    domain: &Domain,
    dds: &Dds,
    node: &str,
    of_ros: &str,
    definitions: &Definitions,
    stop: &Stop,
) -> Result<(), Failure> {
    let participant =
        Participant::join("isochrone-ros2/parameters", domain).map_err(Failure::found)?;
    let open = |(name, kind): (&str, &str)| {
        RosService::open(dds, definitions, &format!("{of_ros}/{name}"), kind)
    };
    let mut services = Vec::new();
    for service in SERVICES {
        services.push(open(service)?);
    }
    let events = Events::open(dds, definitions, of_ros.to_owned())?;
    let cannot = |cause| Failure::found(format!("cannot wait for requests: {cause}"));
    let mut poll = Poll::new().map_err(cannot)?;
    for (index, service) in services.iter_mut().enumerate() {
        service.register(poll.registry(), Token(index)).map_err(cannot)?;
    }
    let mut wakes = Wakes::with_capacity(services.len());
    let mut node = Node { participant: &participant, name: node, client: None, signals: None };
    while !stop.is_due() {
        for (service, (name, _)) in services.iter_mut().zip(SERVICES) {
            service.answer_all(|request| node.answer(name, request, &events));
        }
        if let Err(cause) = poll.poll(&mut wakes, Some(LOOK_INTERVAL))
            && cause.kind() != std::io::ErrorKind::Interrupted
        {
            return Err(cannot(cause));
        }
    }
    Ok(())
}

impl Node<'_> {
    /// Answers a request. Without the node, nothing is there: no parameter, and none can be set.
    fn answer(&mut self, service: &str, request: &RosValue, events: &Events) -> RosValue {
        match self.ask(service, request, events) {
            Ok(answer) => answer,
            Err(error) => {
                tracing::warn!("{service} of {:?}: {error}", self.name);
                self.client = None;
                self.signals = None;
                failed(service, request, &error.to_string())
            }
        }
    }

    fn ask(
        &mut self,
        service: &str,
        request: &RosValue,
        events: &Events,
    ) -> Result<RosValue, ClientError> {
        if self.client.is_none() {
            self.client = Some(Client::connect(self.participant, self.name, PATIENCE)?);
        }
        let Some(client) = &mut self.client else {
            return Ok(failed(service, request, "the node is not there"));
        };
        let is_old = self.signals.as_ref().is_none_or(|(_, asked)| asked.elapsed() >= LIST_AGE);
        if is_old {
            let mut signals = client.signals(None)?;
            signals.retain(is_parameter);
            self.signals = Some((signals, Instant::now()));
        }
        let signals = self.signals.as_ref().map(|(signals, _)| &signals[..]).unwrap_or_default();
        let mut parameters = Parameters { client, signals, changed: Vec::new() };
        let answer = match service {
            "get_parameters" => parameters.get(request)?,
            "get_parameter_types" => parameters.types(request),
            "list_parameters" => parameters.list(request),
            "describe_parameters" => parameters.describe(request),
            "set_parameters" => parameters.set_each(request),
            _ => parameters.set_all(request),
        };
        events.tell(parameters.changed);
        Ok(answer)
    }
}

/// The answer where the node cannot be asked.
fn failed(service: &str, request: &RosValue, why: &str) -> RosValue {
    let refused = || RosValue::Message(vec![RosValue::Number(0.0), RosValue::Text(why.to_owned())]);
    let asked = request.parts().first().map_or(0, |names| names.parts().len());
    let none = || RosValue::Several(Vec::new());
    RosValue::Message(vec![match service {
        "list_parameters" => RosValue::Message(vec![none(), none()]),
        "get_parameter_types" => RosValue::Numbers(Vec::new()),
        "set_parameters" => RosValue::Several((0..asked).map(|_| refused()).collect()),
        "set_parameters_atomically" => refused(),
        _ => none(),
    }])
}
