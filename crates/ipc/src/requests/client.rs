//! The client of a request-response service.

use std::sync::Arc;

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::LoanError;
use iceoryx2::port::SendError;
use iceoryx2::port::client::{Client, RequestSendError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::client::{ClientCreateError, PortFactoryClient};

use super::service::{self, RequestService, process_of};
use super::{MAX_CLIENTS, MAX_MESSAGE_BYTES, PLACES_TO_ACT, RequestError};
use crate::peers::Peers;
use crate::space::{self, Shortage};
use crate::{OpenError, Participant, Service, give_up_file_override};

type Port<S> = Client<S, [u8], (), [u8], ()>;
type Pending<S> = PendingResponse<S, [u8], (), [u8], ()>;
type Builder<'a, S> = PortFactoryClient<'a, S, [u8], (), [u8], ()>;

/// One request that servers hold, one in their buffers, and the one that is being written.
const REQUESTS: usize = 3;
/// iceoryx2's own header.
const SYSTEM_HEADER_BYTES: usize = 64;

/// Sends requests to the servers of a service, one at a time. For ordinary threads.
///
/// iceoryx2 has no way to sleep until an answer comes: look for it ([`receive`](Self::receive)) every
/// few milliseconds. An answer that comes late may be taken for that of the next request, also of
/// another client that got the place of this one; so what is sent carries something by which the
/// sender recognises the answer.
#[derive(Debug)]
pub struct RequestClient<S: Service> {
    pending: Option<Pending<S>>,
    /// The servers that could receive the request: an answer may outlive its server.
    asked: Vec<(UniqueNodeId, u128)>,
    // Dropped before its service.
    port: Port<S>,
    service: Arc<RequestService<S>>,
}

impl<S: Service> RequestClient<S> {
    /// Opens `service` as a client; `None` if it has no server.
    ///
    /// Allocates the memory of its requests (0.8 MiB). Clients that were killed are removed; if living ones have all
    /// places, this fails after most of a second.
    ///
    /// # Errors
    /// The name or the service does not fit, eight clients are there already, or shared memory has no
    /// room.
    pub fn open(participant: &Participant<S>, service: &str) -> Result<Option<Self>, OpenError> {
        Self::open_among(participant, service, MAX_CLIENTS)
    }

    /// As [`open`](Self::open), for a client that should find a place even if [`MAX_CLIENTS`] others only look.
    ///
    /// # Errors
    /// As [`open`](Self::open), if the [reserved](PLACES_TO_ACT) places are taken, too.
    pub fn open_to_act(
        participant: &Participant<S>,
        service: &str,
    ) -> Result<Option<Self>, OpenError> {
        Self::open_among(participant, service, MAX_CLIENTS + PLACES_TO_ACT)
    }

    fn open_among(
        participant: &Participant<S>,
        service: &str,
        places: usize,
    ) -> Result<Option<Self>, OpenError> {
        let Some(opened) = service::open_existing(participant, service)? else { return Ok(None) };
        if living_servers(&opened).is_empty() {
            return Ok(None);
        }
        let full = |shortage: Shortage| shortage.of_service(service);
        let bytes = (REQUESTS * (SYSTEM_HEADER_BYTES + MAX_MESSAGE_BYTES)) as u64;
        let peers = Peers::default();
        // A node of an older version has fewer.
        let places = places.min(opened.static_config().max_clients());
        let port = service::open_port(participant, &opened, || {
            let is_full = || OpenError::Full {
                service: service.to_owned(),
                what: "client",
                limit: places,
                holders: service::client_holders(&opened),
            };
            // Looking first spares the servers a connection that ends at once.
            if opened.dynamic_config().number_of_clients() >= places {
                return Err(is_full());
            }
            space::require(bytes).map_err(full)?;
            let _given_up = give_up_file_override();
            let created = builder(&opened, REQUESTS, MAX_MESSAGE_BYTES)
                .set_request_degradation_handler(peers.counting_handler())
                .set_response_degradation_handler(peers.counting_handler())
                .create();
            let port = created.map_err(|cause| match cause {
                ClientCreateError::ExceedsMaxSupportedClients => is_full(),
                cause => crate::service::failed(participant, service, cause),
            })?;
            // iceoryx2 never comes back to a connection that failed; a new port does.
            if peers.failures() > 0 {
                let cause = "the connection to its server failed";
                return Err(crate::service::failed(participant, service, cause));
            }
            Ok(port)
        })?;
        space::reserve_messages(participant.node().config(), port.id().value()).map_err(full)?;
        Ok(Some(Self { pending: None, asked: Vec::new(), port, service: opened }))
    }

    /// Sends a request. The one before it is given up, if it was not answered.
    ///
    /// # Errors
    /// The request is too long, or there is nobody to receive it; nothing was sent then.
    pub fn send(&mut self, request: &[u8]) -> Result<(), RequestError> {
        self.give_up();
        let service = || self.service.name().to_string();
        let failed = |cause: String| RequestError::Failed { service: service(), cause };
        if request.len() > MAX_MESSAGE_BYTES {
            return Err(RequestError::TooLong { service: service(), bytes: request.len() });
        }
        let _given_up = give_up_file_override();
        let loaned = self.port.loan_slice_uninit(request.len()).map_err(|cause| match cause {
            LoanError::OutOfMemory => RequestError::NoRoom { service: service() },
            cause => failed(cause.to_string()),
        })?;
        let pending = match loaned.write_from_slice(request).send() {
            Ok(pending) => pending,
            Err(RequestSendError::SendError(SendError::LoanError(LoanError::OutOfMemory))) => {
                return Err(RequestError::NoRoom { service: service() });
            }
            Err(cause) => return Err(failed(cause.to_string())),
        };
        if pending.number_of_server_connections() == 0 {
            return Err(RequestError::NoServer { service: service() });
        }
        self.pending = Some(pending);
        self.asked = service::servers(&self.service);
        Ok(())
    }

    /// The answer, once it has arrived; `None` if it has not, or no request was sent.
    ///
    /// Never waits. With two servers there may be two answers.
    ///
    /// # Errors
    /// iceoryx2 failed.
    pub fn receive(&mut self) -> Result<Option<Vec<u8>>, RequestError> {
        Ok(self.receive_from()?.map(|answer| answer.bytes))
    }

    /// As [`receive`](Self::receive), with the server that answered.
    ///
    /// # Errors
    /// As [`receive`](Self::receive).
    pub fn receive_from(&mut self) -> Result<Option<Answer>, RequestError> {
        let Some(pending) = &self.pending else { return Ok(None) };
        let _given_up = give_up_file_override();
        match pending.receive() {
            Ok(answer) => Ok(answer.map(|answer| {
                let origin = answer.origin().value();
                let now = service::servers(&self.service);
                let mut servers = self.asked.iter().chain(&now);
                let server = servers.find(|(_, server)| *server == origin).copied();
                let process = server.and_then(|(node, _)| process_of::<S>(node));
                Answer { bytes: answer.payload().to_vec(), process }
            })),
            Err(cause) => {
                let service = self.service.name().to_string();
                Err(RequestError::Failed { service, cause: cause.to_string() })
            }
        }
    }

    /// Gives the request up. It is carried out only if a server has received it already.
    pub fn give_up(&mut self) {
        self.pending = None;
    }

    /// The servers that the service has now and that are not known to be dead.
    ///
    /// Looks at a file for each process of the service: not for a cycle, and not for every millisecond.
    pub fn living_servers(&self) -> Vec<ServingProcess> {
        let of_node = |node| ServingProcess {
            process: process_of::<S>(node),
            name: service::holder(&self.service, node),
        };
        living_servers(&self.service).into_iter().map(of_node).collect()
    }

    /// How many servers the service has now, living or dead: one look at shared memory.
    pub fn servers(&self) -> usize {
        self.service.dynamic_config().number_of_servers()
    }
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Answer {
    /// What the server sent.
    pub bytes: Vec<u8>,
    /// The server's process, if iceoryx2 knows it.
    pub process: Option<u32>,
}

/// A server of a service.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ServingProcess {
    /// Its process, if iceoryx2 knows it.
    pub process: Option<u32>,
    /// Its iceoryx2 node, program and process id, in words.
    pub name: String,
}

fn living_servers<S: Service>(opened: &RequestService<S>) -> Vec<UniqueNodeId> {
    let servers = service::servers(opened);
    if servers.is_empty() {
        return Vec::new();
    }
    let dead = service::dead(opened);
    servers.into_iter().map(|(node, _)| node).filter(|node| !dead.contains(node)).collect()
}

/// What a port is made with that has memory for so many requests of so many bytes.
pub(super) fn builder<S: Service>(
    opened: &RequestService<S>,
    requests: usize,
    bytes: usize,
) -> Builder<'_, S> {
    opened
        .client_builder()
        .override_request_preallocation(move |_| requests)
        .initial_max_slice_len(bytes)
        .allocation_strategy(AllocationStrategy::Static)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
}
