//! Asking a node: finding it, and saying why it did not answer or would not do it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_engine::{escaped, nearest_name};
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;
use isochrone_runtime::control::{
    self, ByTask, Client, ClientError, Code, GetParams, Method, Params, ReadAt, SignalDescription,
    SignalsParams, Values,
};

use super::known::Known;
use crate::failure::Failure;
use crate::{domain, stop, terminal};

/// A node answers within some milliseconds, and a transaction that is due within a second when it has
/// happened. A process that is stopped does not answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Names of one request, in bytes; far less than a message holds.
const MAX_NAME_BYTES: usize = 100_000;
/// Names of one request that a node takes.
const MAX_NAMES: usize = 4096;

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

/// Values, and the cycles that they are of.
#[derive(serde::Serialize)]
pub(crate) struct Reading {
    /// The cycle of each task. A task whose values needed more than one request is missing.
    pub(crate) tasks: ByTask<ReadAt>,
    pub(crate) values: Values,
    /// The flags of the values that have some; `None`: the node does not say.
    pub(crate) quality: Option<BTreeMap<String, Vec<String>>>,
}

impl Reading {
    /// The flags of a value, with blanks between them; nothing for none.
    pub(super) fn flags(&self, name: &str) -> String {
        let flags = self.quality.as_ref().and_then(|quality| quality.get(name));
        flags.map_or_else(String::new, |flags| flags.join(" "))
    }
}

/// What a verb asks for, which says how a failure is put.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asked {
    ToLook,
    ToChange,
}

impl From<Method> for Asked {
    fn from(method: Method) -> Self {
        if method.changes() { Self::ToChange } else { Self::ToLook }
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

    /// As [`connect`](Self::connect), for a verb that ends by itself after so many seconds.
    pub(crate) fn connect_for(&self, seconds: Option<f64>) -> Result<Node, Failure> {
        let stop = stop::on_signal(seconds)?;
        let participant = self.domain.join("isochrone/operate")?;
        let look = |error| failure(error, Asked::ToLook);
        let client = Client::connect(&participant, &self.node, PATIENCE).map_err(look)?;
        let mut client = client.interrupted_by(stop.flag());
        let strangers = client.strangers();
        if !strangers.is_empty() {
            let name = &self.node;
            terminal::note(&format!(
                "warning: node \"{name}\" answers{}",
                control::beside(name, &strangers)
            ));
        }
        client.allow_for_first_cycles().map_err(look)?;
        Ok(Node { client, participant, stop })
    }
}

impl Node {
    /// Its name.
    pub(crate) fn name(&self) -> &str {
        self.client.node()
    }

    /// What was asked for; `None` if the verb is to end, which may be why there is no answer.
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

    /// Waits so long for each answer from now on.
    pub(super) fn wait_for(&mut self, patience: Duration) {
        self.client.wait_for(patience);
    }

    /// Asks it.
    pub(crate) fn call<P: Params>(&mut self, params: &P) -> Result<P::Result, Failure> {
        self.ask(params).map_err(|error| failure(error, P::METHOD.into()))
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

    /// Its signals, or those that a name or glob matches.
    pub(crate) fn signals(
        &mut self,
        pattern: Option<&str>,
    ) -> Result<Vec<SignalDescription>, Failure> {
        self.client.signals(pattern).map_err(|error| failure(error, Asked::ToLook))
    }

    /// As [`signals`](Self::signals); nothing where nothing matches.
    pub(super) fn signals_if_any(
        &mut self,
        pattern: &str,
    ) -> Result<Vec<SignalDescription>, Failure> {
        match self.client.signals(Some(pattern)) {
            Err(ClientError::Refused(refused)) if refused.code == Code::UnknownName => {
                Ok(Vec::new())
            }
            found => found.map_err(|error| failure(error, Asked::ToLook)),
        }
    }

    /// How many signals it has, or match a glob.
    pub(super) fn count(&mut self, pattern: Option<&str>) -> Result<u64, Failure> {
        let (pattern, limit) = (pattern.map(str::to_owned), Some(1));
        match self.client.call(&SignalsParams { pattern, offset: None, limit }) {
            Ok(page) => Ok(page.total),
            Err(ClientError::Refused(refused)) if refused.code == Code::UnknownName => Ok(0),
            Err(error) => Err(failure(error, Asked::ToLook)),
        }
    }

    /// What it says of the signals of these names; those that it does not have are missing.
    pub(super) fn known<'n>(
        &mut self,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Result<Known, Failure> {
        /// How many signals one answer describes.
        const PAGE: u64 = 1000;
        /// So many names are asked for one by one in any case.
        const EACH: usize = 32;
        let names: BTreeSet<&str> = names.into_iter().collect();
        // A large node would be asked for thousands of pages, of which a few names are wanted.
        if names.len() > EACH && self.count(None)?.div_ceil(PAGE) < names.len() as u64 {
            let all = self.signals(None)?.into_iter();
            return Ok(all.filter(|signal| names.contains(signal.name.as_str())).collect());
        }
        let mut known = Vec::new();
        for name in names {
            let found = self.signals_if_any(name)?.into_iter();
            known.extend(found.filter(|signal| signal.name == name));
        }
        Ok(known.into_iter().collect())
    }

    /// The text of its configuration with the values of now.
    pub(crate) fn save(&mut self) -> Result<String, Failure> {
        self.client.save().map_err(|error| failure(error, Asked::ToLook))
    }

    /// The values of names and globs, in their order. While the configuration is being changed, a node may
    /// have to be asked again.
    pub(crate) fn read(&mut self, names: &[String]) -> Result<Reading, Failure> {
        let reading = self.ask_again(PATIENCE, |_| {}, |node| node.read_once(names));
        let reading = reading.map_err(|error| failure(error, Asked::ToLook))?;
        match unanswered(names, &reading.values) {
            Some(missing) => Err(Failure::found(format!(
                "node \"{}\" answered without the value of \"{}\": see that no other process serves \
                 isochrone/{}/control",
                self.name(),
                escaped(missing),
                self.name()
            ))),
            None => Ok(reading),
        }
    }

    /// Asks again as long as it says that it is busy, until the patience or the verb is at its end. `waiting` is
    /// told why it has to, each time.
    pub(super) fn ask_again<T>(
        &mut self,
        patience: Duration,
        mut waiting: impl FnMut(&control::Failure),
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

    fn read_once(&mut self, names: &[String]) -> Result<Reading, ClientError> {
        let (tasks, values, quality) = (ByTask::new(), Values::default(), Some(BTreeMap::new()));
        let mut reading = Reading { tasks, values, quality };
        let mut mixed = Vec::new();
        let mut rest = names;
        while !rest.is_empty() {
            let mut bytes = 0;
            let fits = rest.iter().take(MAX_NAMES).take_while(|name| {
                bytes += name.len();
                bytes <= MAX_NAME_BYTES
            });
            let (asked, later) = rest.split_at(fits.count().max(1));
            rest = later;
            let params =
                |offset| GetParams { names: asked.to_vec(), offset: Some(offset), limit: None };
            let values = self.client.pages(params, |page| {
                for (task, at) in page.tasks {
                    match reading.tasks.get(&task) {
                        Some(known) if known.cycle != at.cycle => mixed.push(task),
                        _ => drop(reading.tasks.insert(task, at)),
                    }
                }
                match (&mut reading.quality, page.quality) {
                    (Some(all), Some(more)) => all.extend(more),
                    (all, _) => *all = None,
                }
                (page.total, page.values.0)
            })?;
            reading.values.0.extend(values);
        }
        reading.tasks.retain(|task, _| !mixed.contains(task));
        Ok(reading)
    }
}

/// The first name that was asked for and has no value. A pin with several names is answered by its first,
/// so it is enough that its block is there.
fn unanswered<'n>(names: &'n [String], values: &Values) -> Option<&'n str> {
    let owner = |name: &str| name.rsplit_once('.').map(|(owner, _)| owner.to_owned());
    let told: BTreeSet<&str> = values.iter().map(|(name, _)| name).collect();
    let owners: BTreeSet<_> = told.iter().filter_map(|name| owner(name)).collect();
    let mut names = names.iter().map(String::as_str);
    names.find(|name| match name.contains('*') {
        true => told.is_empty(),
        false => !told.contains(name) && !owner(name).is_some_and(|of| owners.contains(&of)),
    })
}

/// How a verb ends that a node did not answer, or whose request it refused.
pub(crate) fn failure(error: ClientError, asked: Asked) -> Failure {
    match error {
        ClientError::NoNode { node, running } => Failure::nobody(absent(&node, &running)),
        ClientError::NotOperated { .. } | ClientError::Stranger { .. } => Failure::nobody(error),
        ClientError::Refused(failure) => Failure::found(refusal(&failure, asked)),
        // Whoever only looked has no need to know what may have been done.
        ClientError::Ended { node } if asked == Asked::ToLook => {
            Failure::nobody(format!("node \"{node}\" ended"))
        }
        ClientError::Ended { .. } => Failure::nobody(error),
        ClientError::NoAnswer { node, patience, strangers } if asked == Asked::ToLook => {
            let beside = control::beside(&node, &strangers);
            Failure::found(format!(
                "node \"{node}\" did not answer within {patience:?}; see that its process is not \
                 stopped{beside}"
            ))
        }
        ClientError::Interrupted { node } if asked == Asked::ToLook => {
            Failure::found(format!("ended by a signal before node \"{node}\" answered"))
        }
        error => Failure::found(error),
    }
}

/// Everything that a node has against a request.
pub(crate) fn refusal(failure: &control::Failure, asked: Asked) -> String {
    let mut text = match &failure.findings[..] {
        [] | [_] => failure.message.clone(),
        findings => findings.iter().map(|finding| format!("\n{finding}")).collect(),
    };
    if asked == Asked::ToChange {
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

/// That a node does not run, and which ones do.
fn absent(node: &str, running: &[String]) -> String {
    let meant = match nearest_name(node, running.iter().map(String::as_str)) {
        Some(nearest) => format!("; did you mean \"{nearest}\"?"),
        None => ".".into(),
    };
    let there_are = match running {
        [] => "No node runs in this domain (-v says which one it is).".into(),
        running => format!("There is: {}", running.join(", ")),
    };
    format!("no node \"{node}\" runs here{meant} {there_are}")
}

#[cfg(test)]
mod tests {
    use isochrone_runtime::control::Finding;

    use super::*;

    #[test]
    fn only_who_wanted_a_change_is_told_that_nothing_was_changed() {
        let finding = |name: &str| Finding::new(name, format!("there is no signal \"{name}\""));
        let one = control::Failure::of(Code::UnknownName, vec![finding("a.b")]);
        assert_eq!(refusal(&one, Asked::ToLook), "there is no signal \"a.b\"");
        assert_eq!(
            refusal(&one, Asked::ToChange),
            "the node refuses, and nothing was changed: there is no signal \"a.b\""
        );
        let two = control::Failure::of(Code::UnknownName, vec![finding("a.b"), finding("c.d")]);
        let both = "there is no signal \"a.b\"\nthere is no signal \"c.d\"";
        assert_eq!(refusal(&two, Asked::ToLook), both);
        assert_eq!(
            refusal(&two, Asked::ToChange),
            format!("the node refuses, and nothing was changed:\n{both}")
        );
    }

    #[test]
    fn a_name_that_is_a_file_here_was_perhaps_a_pattern_without_quotes() {
        let finding = Finding::new("Cargo.toml", "there is no signal \"Cargo.toml\"");
        let failure = control::Failure::of(Code::UnknownName, vec![finding]);
        assert!(refusal(&failure, Asked::ToLook).contains("in quotes"));
    }

    #[test]
    fn a_name_without_a_value_is_found_and_a_pin_of_another_name_is_none() {
        let values: Values = [("ramp.status", 1.0), ("level", 2.0)].into_iter().collect();
        let unanswered = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            super::unanswered(&names, &values).map(str::to_owned)
        };
        assert_eq!(unanswered(&["level", "ramp.subFunctionStatus", "ramp.*"]), None);
        assert_eq!(unanswered(&["level", "scale.y"]).as_deref(), Some("scale.y"));
        assert_eq!(unanswered(&["levle"]).as_deref(), Some("levle"));
        let names = ["*".to_owned()];
        assert_eq!(super::unanswered(&names, &Values::default()), Some("*"));
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
            absent("levle", &running),
            "no node \"levle\" runs here; did you mean \"level\"? There is: level, pump"
        );
        assert_eq!(
            absent("x", &[]),
            "no node \"x\" runs here. No node runs in this domain (-v says which one it is)."
        );
    }
}
