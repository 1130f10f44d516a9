//! The server of a request-response service.

use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

use iceoryx2::active_request::ActiveRequest;
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::port::LoanError;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::server::ServerCreateError;

use super::departures::{Burden, Departures};
use super::service::{self, RequestService, process_of};
use super::{AnswerError, MAX_CLIENTS, MAX_MESSAGE_BYTES, PLACES_TO_ACT, RequestUpkeep};
use crate::frames::peers::Peers;
use crate::space::{self, Shortage};
use crate::{OpenError, Participant, Service, give_up_file_override};

type Port<S> = Server<S, [u8], (), [u8], ()>;
type Active<S> = ActiveRequest<S, [u8], (), [u8], ()>;
/// Requests that are finished, but must not be dropped yet.
type Retired<S> = Rc<RefCell<Vec<Active<S>>>>;

/// An answer in its buffer and one in its hands for each client, and the one that is being written.
const ANSWERS: usize = 2 * (MAX_CLIENTS + PLACES_TO_ACT) + 1;
/// iceoryx2 counts an attempt to get memory for an answer as a loan, also where there was none: with few
/// loans, a request whose answer was tried too often could never be answered.
const MAX_LOANS: usize = 1 << 20;
/// iceoryx2's own header.
const SYSTEM_HEADER_BYTES: usize = 64;

/// Receives the requests of a service, and answers them.
///
/// For an ordinary thread, which calls [`receive`](Self::receive) until there are no more requests, and then
/// [`tend`](Self::tend), about two hundred times a second. A service has places for two servers, and each gets every
/// request; a server that should not answer drops them.
#[derive(Debug)]
pub struct RequestServer<S: Service> {
    retired: Retired<S>,
    departures: Departures,
    peers: Peers,
    /// `None` where it could not be replaced. Dropped before its service.
    port: Option<Port<S>>,
    service: Arc<RequestService<S>>,
}

impl<S: Service> RequestServer<S> {
    /// Opens `service` as a server; creates it if necessary.
    ///
    /// The memory of all answers is claimed here (6.3 MiB), as
    /// [`FramePublisher::open`](crate::FramePublisher::open) does.
    ///
    /// # Errors
    /// The name or the existing service does not fit, two servers are there already, or shared memory
    /// has no room.
    pub fn open(participant: &Participant<S>, service: &str) -> Result<Self, OpenError> {
        let opened = service::open_or_create(participant, service)?;
        let peers = Peers::default();
        let open = || open_port(participant, &opened, &peers);
        let port = Some(service::open_port(participant, &opened, open)?);
        let (retired, departures) = (Retired::default(), Departures::default());
        Ok(Self { retired, departures, peers, port, service: opened })
    }

    /// The next request; `None` when there is none.
    ///
    /// Never waits; allocates, and maps the memory of clients that came. Requests that were given up
    /// before they were received are not among them.
    pub fn receive(&mut self) -> Option<Request<S>> {
        self.retired.borrow_mut().retain(|active| would_close_anothers(&self.service, active));
        let present = service::clients(&self.service).into_iter().map(|(_, client)| client);
        self.departures.note(present.collect());
        let active = {
            // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
            let _given_up = give_up_file_override();
            // An error means that all who have sent another request wait for an answer to one before.
            self.port.as_ref()?.receive().ok().flatten()?
        };
        Some(Request {
            process: client_of(&self.service, &active).and_then(process_of::<S>),
            active: Some(active),
            retired: Rc::clone(&self.retired),
            service: Arc::clone(&self.service),
        })
    }

    /// Replaces the port when clients that left too early have left something behind: while there are
    /// no clients (or when it is too much), and never while a request is held. Nearly always this does
    /// nothing.
    pub fn tend(&mut self, participant: &Participant<S>) {
        let burden = self.departures.burden(S::CROSSES_PROCESSES);
        if burden == Burden::None && self.port.is_some() {
            return;
        }
        // Requests keep their port in being.
        if Rc::strong_count(&self.retired) > 1 || !self.retired.borrow().is_empty() {
            return;
        }
        // Clients come under the lock only, so none comes between this look and the new port.
        let Ok(_held) = participant.lock_at_once(self.service.name().as_str()) else { return };
        if burden == Burden::Light && self.port.is_some() && self.clients() > 0 {
            return;
        }
        self.port = None;
        self.departures = Departures::default();
        self.port = open_port(participant, &self.service, &self.peers).ok();
    }

    /// The upkeep, which removes clients that died and retries failed connections; for another thread.
    pub fn upkeep(&self) -> RequestUpkeep<S> {
        RequestUpkeep::new(Arc::clone(&self.service), self.peers.failure_count())
    }

    /// How many clients the service has now, living or dead.
    pub fn clients(&self) -> usize {
        self.service.dynamic_config().number_of_clients()
    }
}

/// Makes the port, under the domain's lock.
fn open_port<S: Service>(
    participant: &Participant<S>,
    opened: &RequestService<S>,
    peers: &Peers,
) -> Result<Port<S>, OpenError> {
    let service = opened.name().as_str();
    let full = |shortage: Shortage| shortage.of_service(service);
    space::require((ANSWERS * (SYSTEM_HEADER_BYTES + MAX_MESSAGE_BYTES)) as u64).map_err(full)?;
    let port = {
        let _given_up = give_up_file_override();
        opened
            .server_builder()
            .max_loaned_responses_per_request(MAX_LOANS)
            .override_response_preallocation(|_| ANSWERS)
            .initial_max_slice_len(MAX_MESSAGE_BYTES)
            .allocation_strategy(AllocationStrategy::Static)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .set_request_degradation_handler(peers.counting_handler())
            .set_response_degradation_handler(peers.counting_handler())
            .create()
    };
    let port = port.map_err(|cause| match cause {
        ServerCreateError::ExceedsMaxSupportedServers => OpenError::Full {
            service: service.to_owned(),
            what: "server",
            limit: opened.static_config().max_servers(),
            holders: service::server_holders(opened),
        },
        cause => crate::frames::service::failed(participant, service, cause),
    })?;
    space::reserve_messages(participant.node().config(), port.id().value()).map_err(full)?;
    Ok(port)
}

/// The outcome of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Delivery {
    /// It was delivered.
    Sent,
    /// No one waits for it any more: the client gave up, left or died.
    GivenUp,
}

/// A request that waits for its answer. Dropping it sends none.
///
/// It may be kept while the server goes on receiving; its client's next request is received only
/// afterwards.
pub struct Request<S: Service> {
    /// `None` once it was handed back.
    active: Option<Active<S>>,
    process: Option<u32>,
    retired: Retired<S>,
    service: Arc<RequestService<S>>,
}

impl<S: Service> Request<S> {
    /// What the client sent; may be longer than [`MAX_MESSAGE_BYTES`] if the client is other software.
    pub fn bytes(&self) -> &[u8] {
        self.active.as_ref().map_or(&[], |active| active.payload())
    }

    /// The client's process, if iceoryx2 knows it.
    pub fn process(&self) -> Option<u32> {
        self.process
    }

    /// Whether the client still waits, as far as is known: a killed client counts until it is removed.
    pub fn is_awaited(&self) -> bool {
        // Another client may have got the place of one that is gone.
        let is_awaited = |active: &Active<S>| {
            active.is_connected() && client_of(&self.service, active).is_some()
        };
        self.active.as_ref().is_some_and(is_awaited)
    }

    /// Sends the answer.
    ///
    /// # Errors
    /// The answer is too long, or there is no memory for it at the moment; the request comes back, for
    /// another attempt.
    pub fn answer(self, answer: &[u8]) -> Result<Delivery, Box<Unanswered<S>>> {
        if !self.is_awaited() {
            return Ok(Delivery::GivenUp);
        }
        match self.send(answer) {
            Ok(()) => Ok(Delivery::Sent),
            Err(error) => Err(Box::new(Unanswered { request: self, error })),
        }
    }

    fn send(&self, answer: &[u8]) -> Result<(), AnswerError> {
        let Some(active) = &self.active else { return Ok(()) };
        let service = || self.service.name().to_string();
        let failed = |cause: String| AnswerError::Failed { service: service(), cause };
        let _given_up = give_up_file_override();
        let loaned = active.loan_slice_uninit(answer.len()).map_err(|cause| match cause {
            LoanError::ExceedsMaxLoanSize => AnswerError::TooLong {
                service: service(),
                bytes: answer.len(),
                limit: MAX_MESSAGE_BYTES,
            },
            LoanError::OutOfMemory | LoanError::ExceedsMaxLoans => {
                AnswerError::NoRoom { service: service() }
            }
            cause => failed(cause.to_string()),
        })?;
        loaned.write_from_slice(answer).send().map_err(|cause| failed(cause.to_string()))
    }
}

impl<S: Service> Drop for Request<S> {
    fn drop(&mut self) {
        let active = self.active.take();
        let kept = active.filter(|active| would_close_anothers(&self.service, active));
        self.retired.borrow_mut().extend(kept);
    }
}

impl<S: Service> fmt::Debug for Request<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Request")
            .field("process", &self.process)
            .field("bytes", &self.bytes().len())
            .finish_non_exhaustive()
    }
}

/// A request whose answer could not be sent.
#[derive(Debug)]
#[non_exhaustive]
pub struct Unanswered<S: Service> {
    /// The request, for another attempt.
    pub request: Request<S>,
    /// The cause.
    pub error: AnswerError,
}

/// Whether dropping a request would close the place of another client for an answer.
///
/// iceoryx2 knows a request by its client's place among the clients and a number that counts from zero
/// in each client. If a client died and another took its place, the number may be that of the newcomer's
/// request, which would then be passed over.
fn would_close_anothers<S: Service>(opened: &RequestService<S>, active: &Active<S>) -> bool {
    active.is_connected() && client_of(opened, active).is_none()
}

/// The node of a request's client, if the client is still there.
fn client_of<S: Service>(opened: &RequestService<S>, active: &Active<S>) -> Option<UniqueNodeId> {
    let origin = active.origin().value();
    let mut clients = service::clients(opened).into_iter();
    clients.find(|(_, client)| *client == origin).map(|(node, _)| node)
}
