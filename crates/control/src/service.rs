//! The server of a node's control service.

use std::time::{Duration, Instant};

use isochrone_ipc::{
    AnswerError, OpenError, Participant, Request, RequestServer, RequestUpkeep, Service, Unanswered,
};

use super::{
    Begun, Call, Caller, Parsed, Refusal, Reply, Ticket, Unparsed, answer, parse, service_name,
};

/// The most requests that are taken in one call: each client has one.
const AT_ONCE: usize = isochrone_ipc::MAX_CLIENTS + isochrone_ipc::PLACES_TO_ACT;
/// After this time, waiting requests are left to the next call.
const LONGEST_TURN: Duration = Duration::from_millis(10);

/// The node's side of the service.
///
/// All methods are called by the thread that serves, and must return soon.
pub trait Operated {
    /// Carries out a request, or begins to. A node that [handles](crate::Handle) every method lets
    /// [`Call::begin`] choose the handler.
    ///
    /// # Errors
    /// The refusal; nothing has been changed then.
    fn begin(&mut self, call: Call, caller: Caller) -> Result<Begun<Reply>, Refusal>;

    /// The next request that has finished since the last call.
    fn ended(&mut self) -> Option<(Ticket, CallResult)>;

    /// No one waits for this request any more. It may be dropped if its work has not really begun.
    fn given_up(&mut self, _ticket: Ticket) {}
}

/// A result, or a refusal.
pub type CallResult = Result<Reply, Refusal>;

/// Receives the requests to a node and sends the answers, in an ordinary thread.
///
/// Call it at least every 5 ms. Clients that give up, leave or die do no harm: their requests are carried out, and no
/// answer is sent.
#[derive(Debug)]
pub struct ControlService<S: Service> {
    waiting: Vec<Parked<S>>,
    /// Answers that had no room in shared memory.
    unsent: Vec<(Request<S>, Vec<u8>)>,
    server: RequestServer<S>,
}

#[derive(Debug)]
struct Parked<S: Service> {
    ticket: Ticket,
    id: String,
    request: Request<S>,
}

impl<S: Service> ControlService<S> {
    /// Opens the service of a node.
    ///
    /// # Errors
    /// As [`RequestServer::open`].
    pub fn open(participant: &Participant<S>, node: &str) -> Result<Self, OpenError> {
        let server = RequestServer::open(participant, &service_name(node))?;
        Ok(Self { waiting: Vec::new(), unsent: Vec::new(), server })
    }

    /// Answers requests that can be answered, and lets the node begin new ones. Never waits.
    pub fn serve(&mut self, node: &mut impl Operated, participant: &Participant<S>) {
        for (request, text) in std::mem::take(&mut self.unsent) {
            self.send(request, text);
        }
        // While a request is kept, its client's next one is not received.
        for one in self.waiting.extract_if(.., |one| !one.request.is_awaited()) {
            node.given_up(one.ticket);
        }
        self.answer(node);
        let begun = Instant::now();
        for _ in 0..AT_ONCE {
            let Some(request) = self.server.receive() else { break };
            self.begin(request, node);
            // After a search of names, the thread that serves has other things to do first.
            if begun.elapsed() > LONGEST_TURN {
                break;
            }
        }
        self.server.tend(participant);
    }

    /// Answers requests that have finished, and takes no new ones.
    pub fn answer(&mut self, node: &mut impl Operated) {
        while let Some((ticket, outcome)) = node.ended() {
            let Some(index) = self.waiting.iter().position(|one| one.ticket == ticket) else {
                continue;
            };
            let Parked { id, request, .. } = self.waiting.swap_remove(index);
            self.send(request, answer(Some(&id), outcome.as_ref()));
        }
    }

    /// Drops all requests: a server without the node leaves the answers to another one.
    pub fn stand_by(&mut self, participant: &Participant<S>) {
        self.waiting.clear();
        self.unsent.clear();
        while self.server.receive().is_some() {}
        self.server.tend(participant);
    }

    /// The upkeep of the service, which removes clients that died; for another thread.
    pub fn upkeep(&self) -> RequestUpkeep<S> {
        self.server.upkeep()
    }

    fn begin(&mut self, request: Request<S>, node: &mut impl Operated) {
        let text = match parse(request.bytes()) {
            Err(Unparsed { id, failure }) => answer::<Reply>(id.as_deref(), Err(&failure)),
            Ok(Parsed { id, call }) => {
                match node.begin(call, Caller { process: request.process() }) {
                    Err(refusal) => answer::<Reply>(Some(&id), Err(&refusal)),
                    Ok(Begun::Ended(reply)) => answer(Some(&id), Ok(&reply)),
                    Ok(Begun::Later(ticket)) => {
                        self.waiting.push(Parked { ticket, id, request });
                        return;
                    }
                }
            }
        };
        self.send(request, text);
    }

    fn send(&mut self, request: Request<S>, text: Vec<u8>) {
        let Err(unanswered) = request.answer(&text) else { return };
        let Unanswered { request, error, .. } = *unanswered;
        match error {
            AnswerError::NoRoom { .. } => self.unsent.push((request, text)),
            // The client sends it again, or reports that there was no answer.
            error => tracing::warn!("{error}"),
        }
    }
}
