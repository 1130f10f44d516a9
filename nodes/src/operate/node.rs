//! Asking a node: finding it, and saying why it did not answer or would not do it.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{ActiveAlarm, Client, ClientError, Code, Method, Params, ProcessAlarm};
use isochrone_engine::{escaped, nearest_name};
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;

use crate::base::failure::Failure;
use crate::base::{domain, stop, terminal};

/// A node answers within some milliseconds, and a transaction that is due within a second when it has
/// happened. A process that is stopped does not answer.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// Which node to operate
#[derive(Debug, Clone, clap::Args)]
#[group(skip)]
pub(crate) struct Args {
    /// Name of the running node, as `[node] name` gives it; `isochrone list --nodes` prints those that run
    #[arg(value_parser = node_name)]
    pub(crate) node: String,
    #[command(flatten)]
    pub(crate) domain: domain::Args,
}

/// A running node that answers.
pub(crate) struct Node {
    client: Client,
    // After the client, which has ports of it.
    participant: Participant<ipc::Service>,
    stop: Stop,
}

/// How a verb gets its place.
type Connect = fn(&Participant<ipc::Service>, &str, Duration) -> Result<Client, ClientError>;

/// The purpose of a verb's request, which determines the wording of failures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    Look,
    Change,
}

impl From<Method> for Purpose {
    fn from(method: Method) -> Self {
        if method.changes() { Self::Change } else { Self::Look }
    }
}

/// The name of a node comes before what it is asked for.
fn node_name(text: &str) -> Result<String, String> {
    if text.contains('=') {
        return Err("the name of the node comes first: NODE NAME=VALUE".into());
    }
    Ok(text.to_owned())
}

impl Args {
    /// Finds the node. From here on signals end the verb in order.
    pub(crate) fn connect(&self) -> Result<Node, Failure> {
        self.connect_for(None)
    }

    /// As [`connect`](Self::connect), for a verb that changes something: there is a place for it where others
    /// look.
    pub(crate) fn connect_to_act(&self) -> Result<Node, Failure> {
        self.open(stop::on_signal(None)?, Client::connect_to_act)
    }

    /// As [`connect`](Self::connect), for a verb that ends by itself after this many seconds.
    pub(crate) fn connect_for(&self, seconds: Option<f64>) -> Result<Node, Failure> {
        self.connect_until(stop::on_signal(seconds)?)
    }

    /// As [`connect`](Self::connect), for a verb that has a way of its own to end.
    pub(crate) fn connect_until(&self, stop: Stop) -> Result<Node, Failure> {
        self.open(stop, Client::connect)
    }

    fn open(&self, stop: Stop, connect: Connect) -> Result<Node, Failure> {
        let participant = self.domain.join("isochrone/operate")?;
        let look = |error| failure(error, Purpose::Look);
        let client = connect(&participant, &self.node, PATIENCE).map_err(look)?;
        let client = client.interrupted_by(stop.flag());
        let strangers = client.strangers();
        if !strangers.is_empty() {
            let name = &self.node;
            terminal::note(&format!(
                "warning: node \"{name}\" answers{}",
                isochrone_control::other_servers(name, &strangers)
            ));
        }
        Ok(Node { client, participant, stop })
    }
}

impl Node {
    /// The client alone, and the domain, which has to outlive it.
    pub(crate) fn into_parts(self) -> (Client, Participant<ipc::Service>) {
        (self.client, self.participant)
    }

    /// Its name.
    pub(crate) fn name(&self) -> &str {
        self.client.node()
    }

    /// The result; `None` if the verb should end, which may be why there is no answer.
    pub(crate) fn unless_ended<T>(&self, asked: Result<T, Failure>) -> Result<Option<T>, Failure> {
        if self.stop.is_due() { Ok(None) } else { asked.map(Some) }
    }

    /// Waits, but no longer than until the verb is to end.
    pub(crate) fn sleep_until(&self, due: Instant) {
        const LOOK_INTERVAL: Duration = Duration::from_millis(50);
        while !self.stop.is_due() {
            match due.saturating_duration_since(Instant::now()) {
                Duration::ZERO => break,
                left => thread::sleep(left.min(LOOK_INTERVAL)),
            }
        }
    }

    /// The domain that it is in.
    pub(crate) fn participant(&self) -> &Participant<ipc::Service> {
        &self.participant
    }

    /// Changes how long each call waits for its answer.
    pub(super) fn wait_for(&mut self, patience: Duration) {
        self.client.wait_for(patience);
    }

    /// Asks it.
    pub(crate) fn call<P: Params>(&mut self, params: &P) -> Result<P::Result, Failure> {
        self.ask(params).map_err(|error| failure(error, P::METHOD.into()))
    }

    /// Its client, for what tells failures in its own way.
    pub(super) fn client(&mut self) -> &mut Client {
        &mut self.client
    }

    /// Asks it, for a verb that tells in its own way why it was refused.
    pub(super) fn ask<P: Params>(&mut self, params: &P) -> Result<P::Result, ClientError> {
        self.client.call(params)
    }

    /// Asks it for all items of a result, as [`Client::pages`] does.
    pub(super) fn pages<P: Params, T>(
        &mut self,
        params: impl Fn(u64) -> P,
        items: impl FnMut(P::Result) -> (u64, Vec<T>),
    ) -> Result<Vec<T>, Failure> {
        self.client.pages(params, items).map_err(|error| failure(error, P::METHOD.into()))
    }

    /// All alarms: those of the node, and those of the process.
    pub(super) fn alarms(&mut self) -> Result<(Vec<ActiveAlarm>, Vec<ProcessAlarm>), Failure> {
        self.client.alarms().map_err(|error| failure(error, Method::Alarms.into()))
    }

    /// Tells what was read first, then reads and tells what there is now, until the verb is to end.
    pub(super) fn follow<T>(
        &mut self,
        first: T,
        mut tell: impl FnMut(T) -> Result<(), Failure>,
        mut read: impl FnMut(&mut Self) -> Result<T, Failure>,
    ) -> Result<(), Failure> {
        /// As soon as people notice.
        const INTERVAL: Duration = Duration::from_millis(100);
        let mut now = first;
        loop {
            tell(now)?;
            self.sleep_until(Instant::now() + INTERVAL);
            let read = read(self);
            match self.unless_ended(read)? {
                Some(next) => now = next,
                None => return Ok(()),
            }
        }
    }

    /// The text of its configuration with the values of now.
    pub(crate) fn save(&mut self) -> Result<String, Failure> {
        self.client.save().map_err(|error| failure(error, Purpose::Look))
    }

    /// Asks again as long as it says that it is busy, until the patience or the verb is at its end. `waiting` is
    /// told why it has to, each time.
    pub(super) fn ask_again<T>(
        &mut self,
        patience: Duration,
        mut waiting: impl FnMut(&isochrone_control::Refusal),
        mut ask: impl FnMut(&mut Self) -> Result<T, ClientError>,
    ) -> Result<T, ClientError> {
        /// As soon as people notice.
        const INTERVAL: Duration = Duration::from_millis(50);
        let until = Instant::now() + patience;
        loop {
            match ask(self) {
                Err(ClientError::Refused(refused))
                    if refused.code == Code::Busy
                        && Instant::now() < until
                        && !self.stop.is_due() =>
                {
                    waiting(&refused);
                    self.sleep_until(Instant::now() + INTERVAL);
                }
                asked => return asked,
            }
        }
    }
}

/// How a verb ends that a node did not answer, or whose request it refused.
pub(crate) fn failure(error: ClientError, purpose: Purpose) -> Failure {
    match error {
        ClientError::NoNode { node, running, domain } => {
            Failure::nobody(absent(&node, &running, &domain))
        }
        ClientError::NotOperated { .. } | ClientError::Stranger { .. } => Failure::nobody(error),
        ClientError::Refused(failure) => Failure::found(refusal(&failure, purpose)),
        // A request that only looks cannot have changed anything, so that is left out.
        ClientError::Ended { node } if purpose == Purpose::Look => {
            Failure::nobody(format!("node \"{node}\" ended"))
        }
        ClientError::Ended { .. } => Failure::nobody(error),
        error @ ClientError::NoAnswer { .. } if purpose == Purpose::Look => {
            Failure::found(silence(&error))
        }
        ClientError::Interrupted { node } if purpose == Purpose::Look => {
            Failure::found(format!("ended by a signal before node \"{node}\" answered"))
        }
        error => Failure::found(error),
    }
}

/// Why a node did not answer, for requests that only look.
pub(crate) fn silence(error: &ClientError) -> String {
    match error {
        ClientError::NoAnswer { node, patience, process, is_stopped, strangers } => format!(
            "node \"{node}\" did not answer within {patience:?}; {}{}",
            isochrone_control::silence(*process, *is_stopped),
            isochrone_control::other_servers(node, strangers)
        ),
        error => error.to_string(),
    }
}

/// Everything that a node has against a request.
pub(crate) fn refusal(failure: &isochrone_control::Refusal, purpose: Purpose) -> String {
    let mut text = match &failure.findings[..] {
        [] | [_] => failure.message.clone(),
        findings => findings.iter().map(|finding| format!("\n{finding}")).collect(),
    };
    if purpose == Purpose::Change {
        let blank = if text.starts_with('\n') { "" } else { " " };
        text = format!("the node refuses, and nothing was changed:{blank}{text}");
    }
    let mut text = text.trim_start().to_owned();
    if failure.code == Code::UnknownName
        && let Some(file) = failure.findings.iter().find(|finding| is_file(&finding.name))
    {
        text += &format!(
            "\n\"{}\" is a file in this folder: if the shell has put it in the place of a *, write the \
             pattern in quotes",
            escaped(&file.name)
        );
    }
    text
}

fn is_file(name: &str) -> bool {
    !name.is_empty() && !name.contains('/') && Path::new(name).exists()
}

/// Says that a node does not run, and which ones do.
fn absent(node: &str, running: &[String], domain: &str) -> String {
    let suggestion = match nearest_name(node, running.iter().map(String::as_str)) {
        Some(nearest) => format!("; did you mean \"{nearest}\"?"),
        None => ".".into(),
    };
    let there_are = match running {
        [] => domain::nothing_runs("No node", domain) + ".",
        running => format!("There is: {}", running.join(", ")),
    };
    format!("no node \"{node}\" runs here{suggestion} {there_are}")
}

#[cfg(test)]
mod tests {
    use isochrone_control::Finding;

    use super::*;

    #[test]
    fn only_who_wanted_a_change_is_told_that_nothing_was_changed() {
        let finding = |name: &str| Finding::new(name, format!("there is no signal \"{name}\""));
        let one = isochrone_control::Refusal::of(Code::UnknownName, vec![finding("a.b")]);
        assert_eq!(refusal(&one, Purpose::Look), "there is no signal \"a.b\"");
        assert_eq!(
            refusal(&one, Purpose::Change),
            "the node refuses, and nothing was changed: there is no signal \"a.b\""
        );
        let two =
            isochrone_control::Refusal::of(Code::UnknownName, vec![finding("a.b"), finding("c.d")]);
        let both = "there is no signal \"a.b\"\nthere is no signal \"c.d\"";
        assert_eq!(refusal(&two, Purpose::Look), both);
        assert_eq!(
            refusal(&two, Purpose::Change),
            format!("the node refuses, and nothing was changed:\n{both}")
        );
    }

    #[test]
    fn a_name_that_is_a_file_here_was_perhaps_a_pattern_without_quotes() {
        let finding = Finding::new("Cargo.toml", "there is no signal \"Cargo.toml\"");
        let failure = isochrone_control::Refusal::of(Code::UnknownName, vec![finding]);
        assert!(refusal(&failure, Purpose::Look).contains("in quotes"));
    }

    #[test]
    fn the_name_of_a_node_comes_before_assignments() {
        assert!(node_name("ramp.value=1").unwrap_err().contains("comes first"));
        assert_eq!(node_name("level"), Ok("level".to_owned()));
    }

    #[test]
    fn whoever_asks_for_a_node_that_does_not_run_is_told_those_that_do() {
        let running = ["level".to_owned(), "pump".to_owned()];
        assert_eq!(
            absent("levle", &running, "/tmp/plant (prefix plant_)"),
            "no node \"levle\" runs here; did you mean \"level\"? There is: level, pump"
        );
        assert_eq!(
            absent("x", &[], "/tmp/plant (prefix plant_)"),
            "no node \"x\" runs here. No node runs in this domain, /tmp/plant (prefix plant_); \
             --iceoryx2-config or ICEORYX2_CONFIG names another."
        );
    }
}
