//! Opening and creating the iceoryx2 services that carry requests.

use std::sync::Arc;

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::{NodeState, NodeView as _};
use iceoryx2::prelude::{CallbackProgression, MessagingPattern, ServiceName};
use iceoryx2::service::builder::request_response::{
    RequestResponseCreateError as CreateError, RequestResponseOpenError as Cause,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::request_response::PortFactory;

use super::{MAX_CLIENTS, MAX_SERVERS, PLACES_TO_ACT};
use crate::domain::{EndsLocked, LockGuard};
use crate::service::{self, Attempt, Obstacle, holders};
use crate::{OpenError, Participant, Service, give_up_file_override};

pub(super) type RequestService<S> = EndsLocked<PortFactory<S, [u8], (), [u8], ()>>;

/// Servers, clients, and those who wait for a place.
const MAX_NODES: usize = 40;

/// Opens the service as it is; creates it when there is none.
pub(super) fn open_or_create<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<Arc<RequestService<S>>, OpenError> {
    let name = service::service_name(service)?;
    let create = || match create(participant, &name) {
        Ok(created) => Ok(Some(created)),
        Err(cause) => Err(cause.to_string()),
    };
    let open = |held: &LockGuard| open_once(participant, service, &name, held);
    let opened = service::repeat(participant, service, open, create)?;
    let neither = || service::failed(participant, service, "it was neither opened nor created");
    opened.map(Arc::new).ok_or_else(neither)
}

/// Opens the service as it is, or returns `None` when there is none.
pub(super) fn open_existing<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<Option<Arc<RequestService<S>>>, OpenError> {
    let name = service::service_name(service)?;
    let open = |held: &LockGuard| open_once(participant, service, &name, held);
    let opened = service::repeat(participant, service, open, || Ok(None))?;
    Ok(opened.map(Arc::new))
}

/// Opens a port of a service, see [`service::repeat_port`].
pub(super) fn open_port<S: Service, P>(
    participant: &Participant<S>,
    opened: &RequestService<S>,
    open: impl Fn() -> Result<P, OpenError>,
) -> Result<P, OpenError> {
    let service = opened.name().as_str();
    service::repeat_port(participant, service, open, || clean_up(participant, opened))
}

/// Removes what the dead left in the domain and in this service.
pub(super) fn clean_up<S: Service>(participant: &Participant<S>, opened: &RequestService<S>) {
    let ports = || servers(opened).into_iter().chain(clients(opened)).collect();
    service::clean_up(participant, opened.name().as_str(), opened.service_hash(), ports);
}

/// The servers of a service, each with its node.
pub(super) fn servers<S: Service>(opened: &RequestService<S>) -> Vec<(UniqueNodeId, u128)> {
    let mut servers = Vec::new();
    opened.dynamic_config().list_servers(|server| {
        servers.push((server.node_id, server.server_id.value()));
        CallbackProgression::Continue
    });
    servers
}

/// The clients of a service, each with its node.
pub(super) fn clients<S: Service>(opened: &RequestService<S>) -> Vec<(UniqueNodeId, u128)> {
    let mut clients = Vec::new();
    opened.dynamic_config().list_clients(|client| {
        clients.push((client.node_id, client.client_id.value()));
        CallbackProgression::Continue
    });
    clients
}

/// The process of a node, where iceoryx2 tells it.
pub(crate) fn process_of<S: Service>(node: UniqueNodeId) -> Option<u32> {
    u32::try_from(node.pid::<S>().ok()?.value()).ok()
}

/// A node of a service in words.
pub(super) fn holder<S: Service>(opened: &RequestService<S>, node: UniqueNodeId) -> String {
    holders::node(&**opened, node)
}

/// The nodes of a service whose processes have died, and that were not cleared yet.
pub(super) fn dead<S: Service>(opened: &RequestService<S>) -> Vec<UniqueNodeId> {
    let _given_up = give_up_file_override();
    let mut dead = Vec::new();
    // What cannot be listed is seen at the next look.
    let _ = opened.nodes(|state| {
        if let NodeState::Dead(view) = state {
            dead.push(*view.id());
        }
        CallbackProgression::Continue
    });
    dead
}

/// The nodes that have the places for servers.
pub(super) fn server_holders<S: Service>(opened: &RequestService<S>) -> String {
    let nodes: Vec<_> = servers(opened).into_iter().map(|(node, _)| node).collect();
    holders::listed(&**opened, &nodes)
}

/// The nodes that have the places for clients.
pub(super) fn client_holders<S: Service>(opened: &RequestService<S>) -> String {
    let nodes: Vec<_> = clients(opened).into_iter().map(|(node, _)| node).collect();
    holders::listed(&**opened, &nodes)
}

/// Opens without a single wish about quality of service, so that every service of our types fits.
fn open_once<S: Service>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    held: &LockGuard,
) -> Result<Attempt<RequestService<S>>, OpenError> {
    // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
    let _given_up = give_up_file_override();
    let opened = participant.node().service_builder(name).request_response::<[u8], [u8]>().open();
    let obstacle = match opened {
        Ok(opened) => return Ok(Attempt::Done(participant.membership().keep(opened))),
        Err(cause) => match cause {
            Cause::DoesNotExist => Obstacle::Absent,
            Cause::ExceedsMaxNumberOfNodes => Obstacle::NoPlaceForNode,
            Cause::IncompatibleRequestOrResponseType | Cause::IncompatibleMessagingPattern => {
                Obstacle::OtherTypes {
                    carries: types_of(participant, name),
                    needs: "requests and answers are bytes ([u8]) without user headers".to_owned(),
                }
            }
            Cause::VersionMismatch => Obstacle::OtherVersion,
            Cause::ServiceInCorruptedState => Obstacle::Damaged,
            Cause::InsufficientPermissions => Obstacle::Forbidden,
            cause => Obstacle::Passing(cause.to_string()),
        },
    };
    obstacle.judge(participant, service, held)
}

fn create<S: Service>(
    participant: &Participant<S>,
    name: &ServiceName,
) -> Result<RequestService<S>, CreateError> {
    let created = participant
        .node()
        .service_builder(name)
        .request_response::<[u8], [u8]>()
        // Nobody waits for anybody: what was given up is replaced.
        .enable_safe_overflow_for_requests(true)
        .enable_safe_overflow_for_responses(true)
        // A request that its client gave up before it was read is never carried out.
        .enable_fire_and_forget_requests(false)
        .max_servers(MAX_SERVERS)
        .max_clients(MAX_CLIENTS + PLACES_TO_ACT)
        .max_nodes(MAX_NODES)
        .max_active_requests_per_client(1)
        .max_loaned_requests(1)
        .max_response_buffer_size(1)
        .max_borrowed_responses_per_pending_response(1)
        .create();
    created.map(|created| participant.membership().keep(created))
}

fn types_of<S: Service>(participant: &Participant<S>, name: &ServiceName) -> String {
    let details = S::details(name, participant.node().config(), MessagingPattern::RequestResponse);
    match details {
        Ok(Some(details)) => {
            let config = details.static_details.request_response();
            let (request, response) =
                (config.request_message_type_details(), config.response_message_type_details());
            format!(
                "requests that are {} and answers that are {}",
                service::describe(&request.payload, &request.user_header),
                service::describe(&response.payload, &response.user_header)
            )
        }
        _ => "messages of unknown type".to_owned(),
    }
}
