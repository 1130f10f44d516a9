//! The client of a node's control service, for any program.

use std::collections::BTreeSet;
use std::hash::{BuildHasher, RandomState};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::Wake;
use isochrone_ipc::{
    OpenError, Participant, RequestClient, RequestError, Service, ServingProcess, ipc, is_stopped,
};

use crate::client::error::ClientError;
use crate::client::running_nodes::running_nodes;
use crate::texts::{self, Answer};
use crate::{
    ActiveAlarm, AlarmsParams, AlarmsResult, DescribeParams, GetParams, ListedAlarm, Method,
    Params, ProcessAlarm, SaveParams, SignalDescription, SignalsParams, TaskDescription, Values,
    service_name, telemetry_service_name,
};

/// Between two looks for an answer. A node looks for requests every 5 ms at the latest.
pub(crate) const PAUSE: Duration = Duration::from_millis(1);
/// Between two looks whether the node is still there.
const LOOK: Duration = Duration::from_millis(100);
/// How long a node may take to say why it does not answer.
const REASON_PATIENCE: Duration = Duration::from_secs(1);

/// A client of one node. It sends one request at a time.
///
/// ```no_run
/// use std::time::Duration;
/// use isochrone_ipc::{Domain, Participant};
/// use isochrone_control::{Client, SetParams};
///
/// let participant = Participant::join("tuner", Domain::find()?)?;
/// let mut node = Client::connect(&participant, "level", Duration::from_secs(5))?;
/// let values = [("ramp.setChangeRate", 5.0)].into_iter().collect();
/// let done = node.call(&SetParams { values, ..SetParams::default() })?;
/// println!("transaction {}: {:?}", done.transaction, done.tasks);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Client<S: Service = ipc::Service> {
    port: RequestClient<S>,
    node: String,
    patience: Duration,
    interruption: Option<Arc<AtomicBool>>,
    /// The start of all request ids of this client.
    beginning: String,
    requests: u64,
    late: u64,
    /// The processes that publish the node's telemetry: that is, the node. If there are none, the node cannot be told
    /// from other servers.
    owners: Vec<u32>,
}

impl<S: Service> Client<S> {
    /// Connects to a running node. Each call waits up to `patience` for its answer; a call that reads values of a task
    /// that has not run yet also waits for its first cycle.
    ///
    /// # Errors
    /// No such node runs (the error names those that do), it takes no requests, or it has eight clients already.
    pub fn connect(
        participant: &Participant<S>,
        node: &str,
        patience: Duration,
    ) -> Result<Self, ClientError> {
        let opened = RequestClient::open(participant, &service_name(node));
        Self::of_port(participant, node, patience, opened)
    }

    /// As [`connect`](Self::connect), for a client that changes something and then leaves: four places are reserved for
    /// such clients, so eight that only look do not keep it out.
    ///
    /// # Errors
    /// As [`connect`](Self::connect), with a limit of twelve clients.
    pub fn connect_to_act(
        participant: &Participant<S>,
        node: &str,
        patience: Duration,
    ) -> Result<Self, ClientError> {
        let opened = RequestClient::open_to_act(participant, &service_name(node));
        Self::of_port(participant, node, patience, opened)
    }

    fn of_port(
        participant: &Participant<S>,
        node: &str,
        patience: Duration,
        opened: Result<Option<RequestClient<S>>, OpenError>,
    ) -> Result<Self, ClientError> {
        let port = match opened {
            Ok(Some(port)) => port,
            Ok(None) | Err(OpenError::ServiceName(_)) => return Err(absent(participant, node)?),
            Err(OpenError::Full { what: "client", limit: clients, holders, .. }) => {
                return Err(ClientError::Full { node: node.to_owned(), clients, holders });
            }
            Err(error) => return Err(error.into()),
        };
        // A client may get the place of an earlier one, and late answers with it, so their ids must differ.
        let chance = RandomState::new().hash_one(std::process::id());
        let beginning = format!("{}-{chance:016x}", std::process::id());
        let owners = participant.publishing_processes(&telemetry_service_name(node))?;
        let node = node.to_owned();
        let (requests, late, interruption) = (0, 0, None);
        let client = Self { port, node, patience, interruption, beginning, requests, late, owners };
        let is_node = |server: &ServingProcess| client.is_node(server.process);
        let mut servers = client.port.living_servers().into_iter();
        match servers.next() {
            Some(first) if !is_node(&first) && !servers.any(|server| is_node(&server)) => {
                Err(ClientError::Stranger { node: client.node, server: first.name })
            }
            _ => Ok(client),
        }
    }

    /// Whether a server of this process is the node.
    fn is_node(&self, process: Option<u32>) -> bool {
        self.owners.is_empty() || process.is_some_and(|process| self.owners.contains(&process))
    }

    /// Other processes that serve the node's service, in words; their answers are not taken.
    pub fn strangers(&self) -> Vec<String> {
        if self.port.servers() <= 1 {
            return Vec::new();
        }
        let servers = self.port.living_servers().into_iter();
        let strangers = servers.filter(|server| !self.is_node(server.process));
        strangers.map(|server| server.name).collect()
    }

    /// Whether the node has left its service.
    fn has_ended(&self) -> bool {
        !self.port.living_servers().iter().any(|server| self.is_node(server.process))
    }

    /// Makes the client stop waiting for an answer once this flag is set, for example by a signal handler.
    #[must_use]
    pub fn interrupted_by(self, flag: Arc<AtomicBool>) -> Self {
        Self { interruption: Some(flag), ..self }
    }

    /// Changes how long each call waits for its answer.
    pub fn wait_for(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// How long each call waits for its answer.
    pub(crate) fn patience(&self) -> Duration {
        self.patience
    }

    /// The node's name.
    pub fn node(&self) -> &str {
        &self.node
    }

    /// The node's process, if iceoryx2 knows it.
    pub fn process(&self) -> Option<u32> {
        self.owners.first().copied()
    }

    /// Calls a method, and waits for the answer.
    ///
    /// # Errors
    /// The node refuses, ends, or does not answer in time.
    pub fn call<P: Params>(&mut self, params: &P) -> Result<P::Result, ClientError> {
        match self.call_once(params) {
            Err(unanswered @ ClientError::NoAnswer { is_stopped: false, .. })
                if P::METHOD == Method::Get =>
            {
                let Some(longest) = self.longest_wait() else { return Err(unanswered) };
                self.call_within(self.patience.saturating_add(longest), params)
            }
            answer => answer,
        }
    }

    /// How long it may take to read values of a task that has to run another cycle first, because it has run none or
    /// never sleeps. `None`: there is no such task, or the node does not say.
    fn longest_wait(&mut self) -> Option<Duration> {
        let sleeps = |task: &TaskDescription| {
            task.placement.as_ref().is_some_and(|placement| placement.wake != Wake::Spin.as_str())
        };
        let node = self.call_within(self.patience.min(REASON_PATIENCE), &DescribeParams {}).ok()?;
        let waiting = node.tasks.iter().filter(|task| task.last_cycle.is_none() || !sleeps(task));
        waiting.map(|task| Duration::from_nanos(task.period_ns)).max()
    }

    fn call_once<P: Params>(&mut self, params: &P) -> Result<P::Result, ClientError> {
        let id = self.send(params)?;
        let answer = self.wait::<P>(&id);
        self.port.give_up();
        answer
    }

    /// As [`call`](Self::call), with another time to wait.
    pub(crate) fn call_within<P: Params>(
        &mut self,
        patience: Duration,
        params: &P,
    ) -> Result<P::Result, ClientError> {
        let usual = std::mem::replace(&mut self.patience, patience);
        let answer = self.call_once(params);
        self.patience = usual;
        answer
    }

    /// All items of a result that comes in pages, with as many requests as that needs. `params` makes the request for
    /// the items from an offset on; `items` splits a page into the total number of items and its own.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn pages<P: Params, T>(
        &mut self,
        params: impl Fn(u64) -> P,
        mut items: impl FnMut(P::Result) -> (u64, Vec<T>),
    ) -> Result<Vec<T>, ClientError> {
        let mut all = Vec::new();
        loop {
            let (total, page) = items(self.call(&params(all.len() as u64))?);
            let is_last = page.is_empty();
            all.extend(page);
            if is_last || all.len() as u64 >= total {
                return Ok(all);
            }
        }
    }

    /// All active alarms: those of the node, and those of the process.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn alarms(&mut self) -> Result<(Vec<ActiveAlarm>, Vec<ProcessAlarm>), ClientError> {
        let all = self.pages(
            |offset| AlarmsParams { offset: Some(offset), ..AlarmsParams::default() },
            AlarmsResult::page,
        )?;
        Ok(ListedAlarm::sorted(all))
    }

    /// All signals that a name or a glob matches, or all signals of the node, with as many requests as that needs.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn signals(
        &mut self,
        pattern: Option<&str>,
    ) -> Result<Vec<SignalDescription>, ClientError> {
        let pattern = pattern.map(str::to_owned);
        self.pages(
            |offset| SignalsParams { pattern: pattern.clone(), offset: Some(offset), limit: None },
            |page| (page.total, page.signals),
        )
    }

    /// The values of names and globs, with as many requests as that needs. If it needs more than one, the values are
    /// of more than one cycle.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn values(&mut self, names: &[&str]) -> Result<Values, ClientError> {
        let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
        let values = self.pages(
            |offset| GetParams {
                names: names.clone(),
                offset: Some(offset),
                ..GetParams::default()
            },
            |page| (page.total, page.values.0),
        )?;
        Ok(Values(values))
    }

    /// The configuration with the current values, with as many requests as that needs. The node writes the text at
    /// the first of them.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn save(&mut self) -> Result<String, ClientError> {
        let mut text = String::new();
        loop {
            let page = self.call(&SaveParams { offset: Some(text.len() as u64) })?;
            let is_last = page.configuration.is_empty();
            text += &page.configuration;
            if is_last || text.len() as u64 >= page.total {
                return Ok(text);
            }
        }
    }

    /// How many answers were dropped because they were late or for another client.
    pub fn late_answers(&self) -> u64 {
        self.late
    }

    /// Sends a request, and returns its id.
    pub(crate) fn send<P: Params>(&mut self, params: &P) -> Result<String, ClientError> {
        self.requests += 1;
        tracing::trace!("asks node \"{}\": {}", self.node, P::METHOD.as_str());
        let id = format!("{}-{}", self.beginning, self.requests);
        let request = texts::request(&id, params).map_err(ClientError::Refused)?;
        let begin = Instant::now();
        loop {
            match self.port.send(&request) {
                Err(RequestError::NoServer { .. }) => {}
                sent => return Ok(sent.map(|()| id)?),
            }
            // A node that lives may be replacing its port.
            if self.has_ended() || begin.elapsed() >= self.patience {
                return Err(self.unanswered());
            }
            thread::sleep(PAUSE);
        }
    }

    /// The answer to the request with this id, if it has arrived.
    pub(crate) fn receive<P: Params>(
        &mut self,
        id: &str,
    ) -> Result<Option<P::Result>, ClientError> {
        while let Some(received) = self.port.receive_from()? {
            if !self.is_node(received.process) {
                continue;
            }
            let answer =
                Answer::read(&received.bytes).map_err(|cause| self.misunderstood(cause))?;
            if answer.id.as_deref() == Some(id) {
                let result = answer.outcome.map_err(ClientError::Refused)?;
                let result = serde_json::from_str(result.get());
                return result.map(Some).map_err(|cause| self.misunderstood(cause));
            }
            self.late += 1;
        }
        Ok(None)
    }

    /// Waits for the answer to the request with this id.
    fn wait<P: Params>(&mut self, id: &str) -> Result<P::Result, ClientError> {
        let begin = Instant::now();
        let mut look = LOOK;
        loop {
            if let Some(answer) = self.receive::<P>(id)? {
                return Ok(answer);
            }
            if self.interruption.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
                return Err(ClientError::Interrupted { node: self.node.clone() });
            }
            let waited = begin.elapsed();
            if waited >= self.patience {
                return Err(self.unanswered());
            }
            if waited >= look {
                look = waited + LOOK;
                if self.has_ended() {
                    return Err(self.ended());
                }
            }
            thread::sleep(PAUSE);
        }
    }

    /// The error if no answer arrived in time.
    pub(crate) fn unanswered(&self) -> ClientError {
        if self.has_ended() {
            return self.ended();
        }
        let (node, strangers, process) = (self.node.clone(), self.strangers(), self.process());
        let is_stopped = process.is_some_and(is_stopped);
        ClientError::NoAnswer { node, patience: self.patience, process, is_stopped, strangers }
    }

    fn ended(&self) -> ClientError {
        ClientError::Ended { node: self.node.clone() }
    }

    pub(super) fn misunderstood(&self, cause: serde_json::Error) -> ClientError {
        ClientError::Misunderstood { node: self.node.clone(), cause: cause.to_string() }
    }
}

/// The error if a node's service has no server.
fn absent<S: Service>(
    participant: &Participant<S>,
    node: &str,
) -> Result<ClientError, ClientError> {
    let running: BTreeSet<String> =
        running_nodes(participant)?.into_iter().map(|node| node.name).collect();
    let (node, domain) = (node.to_owned(), participant.domain());
    Ok(if running.contains(&node) {
        ClientError::NotOperated { node }
    } else {
        ClientError::NoNode { node, running: running.into_iter().collect(), domain }
    })
}
