//! Why a request is refused.

mod kind;
mod refusals;

use isochrone_blocks::PinType;

use super::{Unwritten, Value};
use crate::printable::escaped;

pub use kind::RefusalKind;
pub use refusals::Refusals;

/// Why one name of a request, or the request itself, is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// There is no such signal.
    #[error("there is no signal \"{}\"", shortened(.name))]
    Unknown {
        /// The name.
        name: String,
        /// The name that was meant, or those that there are.
        help: String,
    },
    /// It is an output pin, which its block computes.
    #[error("\"{name}\" is an output pin, which its block computes")]
    Output {
        /// The name.
        name: String,
    },
    /// A wire feeds the pin in every cycle.
    #[error("\"{name}\" is wired to \"{source_name}\", which would write over it")]
    Wired {
        /// The name.
        name: String,
        /// What feeds it.
        source_name: String,
    },
    /// The input is read from a service, or another process may give it.
    #[error("\"{name}\" is an input, which {}", fed_by(.service.as_deref()))]
    Fed {
        /// The input.
        name: String,
        /// The service that it is read from; `None`: the program that runs the node gives it.
        service: Option<String>,
    },
    /// It tells what an input's value is worth, or how old it is.
    #[error("\"{name}\" tells what the value of an input is worth, so it cannot be set")]
    Quality {
        /// The name.
        name: String,
    },
    /// The age of an input cannot be forced.
    #[error("\"{name}\" is the age of an input, which cannot be forced")]
    Age {
        /// The name.
        name: String,
    },
    /// The signal's type does not have the value.
    #[error("{value} is no {value_type}, as \"{name}\" is")]
    Value {
        /// The name.
        name: String,
        /// The value.
        value: Value,
        /// The signal's type.
        value_type: PinType,
    },
    /// The value lies outside of the limits that the configuration gives the parameter.
    #[error("{value} is outside the limits of \"{name}\", {min:?} to {max:?}")]
    Limits {
        /// The name.
        name: String,
        /// The value.
        value: Value,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// The name stands twice in one request.
    #[error("\"{name}\" is given twice in one request")]
    Twice {
        /// The name.
        name: String,
    },
    /// A `[[protect]]` of the configuration names it.
    #[error("\"{name}\" is protected by [[protect]] \"{pattern}\"")]
    Protected {
        /// The name.
        name: String,
        /// What protects it.
        pattern: String,
    },
    /// The configuration does not allow requests of this kind.
    #[error("[node] control = \"{control}\" does not allow {action}")]
    Control {
        /// What the configuration says.
        control: &'static str,
        /// What was asked for.
        action: &'static str,
        /// The least that would allow it.
        needs: &'static str,
    },
    /// The journal cannot be written, so nothing may be changed.
    #[error("nothing can be changed while {}", .why.reason())]
    Journal {
        /// What is wrong with the journal.
        why: Unwritten,
    },
    /// It is not forced.
    #[error("\"{name}\" is not forced")]
    NotForced {
        /// The name.
        name: String,
    },
    /// The request names nothing.
    #[error("the request names no signal")]
    Empty,
    /// The cycle has begun, or is too far ahead, or the values are of several tasks.
    #[error("cycle {at}: {why}")]
    At {
        /// The cycle that was asked for.
        at: u64,
        /// What is wrong with it.
        why: AtRefusal,
    },
    /// As many requests as may name later cycles of a task do.
    #[error(
        "task \"{task}\" keeps at most {most} requests{} for later cycles, and has {by}",
        if *.of_client_alone { " of one client" } else { "" }
    )]
    Scheduled {
        /// The task.
        task: String,
        /// The most that it keeps.
        most: usize,
        /// Whether that is the most of one client; otherwise of all.
        of_client_alone: bool,
        /// Whose they are: `32 of "anna"`.
        by: String,
        /// The cycle that the first of them waits for.
        first: u64,
    },
    /// A force must last longer than 0 s, and at most as long as cycles can be counted.
    #[error("a force cannot last {seconds:?} s")]
    Duration {
        /// How long it was to last.
        seconds: f64,
    },
    /// A task has as many forces as it can have.
    #[error("task \"{task}\" has room for {most} forces, and these would make it more")]
    TooMany {
        /// The task.
        task: String,
        /// The most that it can have.
        most: usize,
    },
    /// What stands here cannot be changed while the node runs.
    #[error("{what} \"{}\" cannot be changed while the node runs: {difference}", escaped(.name))]
    Fixed {
        /// What it is: node, task, input or output.
        what: &'static str,
        /// Its name.
        name: String,
        /// What would be different.
        difference: String,
    },
    /// A signal is forced, and the new configuration does not keep it.
    #[error("\"{name}\" is forced, and the new configuration does not keep its block")]
    ForcedGone {
        /// The name.
        name: String,
    },
    /// The journal says that the configuration was changed, and that cannot be done again.
    #[error("transaction {transaction} changed the configuration, and {why}")]
    NotRepeated {
        /// Its number.
        transaction: u64,
        /// What is in the way.
        why: String,
    },
    /// A change of the configuration is on its way to the tasks.
    #[error("transaction {transaction} changes the configuration at this moment")]
    Changing {
        /// Its number.
        transaction: u64,
    },
    /// A request has not come to its cycle, and the configuration cannot be changed before it has.
    #[error("transaction {transaction} is still to come")]
    Waiting {
        /// Its number.
        transaction: u64,
    },
    /// A value cannot be taken back: the configuration was changed, and its signal is gone.
    #[error("\"{name}\", which transaction {transaction} set, is gone since")]
    Gone {
        /// The name.
        name: String,
        /// The transaction.
        transaction: u64,
    },
    /// There is no such transaction, or none that wrote values.
    #[error("there is no transaction {transaction} that set values and that is still known")]
    UnknownTransaction {
        /// Its number.
        transaction: u64,
    },
    /// The transaction was of an earlier run.
    #[error("transaction {transaction} is of an earlier run of the node, which cannot be undone")]
    EarlierRun {
        /// Its number.
        transaction: u64,
    },
    /// The transaction did something else than to set values.
    #[error("transaction {transaction} is {}, which cannot be undone", deed(.action))]
    NoSet {
        /// Its number.
        transaction: u64,
        /// What it did, as journals say: `force`, `release`, `apply`.
        action: &'static str,
    },
    /// The transaction was undone.
    #[error("transaction {transaction} is already undone, by transaction {by}")]
    TakenBack {
        /// Its number.
        transaction: u64,
        /// The undo.
        by: u64,
    },
    /// A value is about to be changed.
    #[error("transaction {by} is about to change \"{name}\"")]
    Moving {
        /// The name.
        name: String,
        /// The transaction, which has not been applied yet.
        by: u64,
    },
    /// A value was changed since the transaction, so that taking it back would undo that, too.
    #[error("\"{name}\" was changed since transaction {transaction}")]
    Conflict {
        /// The name.
        name: String,
        /// The transaction.
        transaction: u64,
    },
}

/// What is wrong with the cycle of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AtRefusal {
    /// It has begun.
    #[error("it has begun")]
    TooLate,
    /// It is more than 10 s ahead.
    #[error("it is more than 10 s ahead")]
    TooFar,
    /// Cycles are counted by task.
    #[error("the values are of several tasks, each of which counts its own cycles")]
    SeveralTasks,
}

impl Refusal {
    /// The name that it is about; empty where it is about the request.
    pub fn name(&self) -> &str {
        match self {
            Self::Unknown { name, .. }
            | Self::Output { name }
            | Self::Wired { name, .. }
            | Self::Fed { name, .. }
            | Self::Quality { name }
            | Self::Age { name }
            | Self::Value { name, .. }
            | Self::Limits { name, .. }
            | Self::Twice { name }
            | Self::Protected { name, .. }
            | Self::NotForced { name }
            | Self::Fixed { name, .. }
            | Self::ForcedGone { name }
            | Self::Gone { name, .. }
            | Self::Moving { name, .. }
            | Self::Conflict { name, .. } => name,
            Self::Control { .. }
            | Self::Journal { .. }
            | Self::Empty
            | Self::At { .. }
            | Self::Scheduled { .. }
            | Self::Duration { .. }
            | Self::TooMany { .. }
            | Self::NotRepeated { .. }
            | Self::Changing { .. }
            | Self::Waiting { .. }
            | Self::NoSet { .. }
            | Self::TakenBack { .. }
            | Self::EarlierRun { .. }
            | Self::UnknownTransaction { .. } => "",
        }
    }

    /// The way out, as part of a sentence.
    pub fn help(&self) -> String {
        match self {
            Self::Unknown { help, .. } => help.clone(),
            Self::Output { .. } => "set an input pin of the block, or force it".into(),
            Self::Wired { source_name, .. } => {
                format!("set what \"{source_name}\" is computed from, or force the pin")
            }
            Self::Fed { service: Some(_), .. } => "publish the value there, or force it".into(),
            Self::Fed { service: None, .. } => "have the program give it, or force it".into(),
            Self::Quality { name } if name.ends_with(".age") => {
                "it counts by itself; force the input, or its \".ok\"".into()
            }
            Self::Quality { .. } => "force it".into(),
            Self::Age { .. } => "force the input, or its \".ok\"".into(),
            Self::Value { value: Value::Task { .. }, value_type: PinType::Int, .. } => {
                "write a number, or the period of one of the node's tasks at a callOB".into()
            }
            Self::Value { value_type, .. } => match (value_type, value_type.range()) {
                (PinType::Bool, _) => "write true or false".into(),
                (PinType::Time, Some((min, max))) => {
                    format!("write whole milliseconds from {min} to {max}")
                }
                (_, Some((min, max))) => format!("write a whole number from {min} to {max}"),
                (_, None) => "write a number".into(),
            },
            Self::Limits { .. } => "[limits] in the configuration sets them".into(),
            Self::Twice { .. } => "name it once".into(),
            Self::Protected { .. } => "take it out of [[protect]] and start the node again".into(),
            Self::Control { needs, .. } => {
                format!("write control = \"{needs}\" and start the node again")
            }
            Self::Journal { why: Unwritten::ForNow(_) } => {
                "make it writable; the node tries again all the time, and only releases forces until then"
                    .into()
            }
            Self::Journal { why: Unwritten::ForGood(_) } => {
                "start the node again; until then it only releases forces".into()
            }
            Self::NotForced { .. } => "name a signal that is; `forces` lists them".into(),
            Self::Empty => "name at least one".into(),
            Self::At { why, .. } => match why {
                AtRefusal::TooLate => "name a later cycle, or none",
                AtRefusal::TooFar => "ask again when it is near",
                AtRefusal::SeveralTasks => "make one request for each task",
            }
            .into(),
            Self::Scheduled { first, .. } => {
                format!("ask without a cycle, or again after cycle {first}, when the first of them has come")
            }
            Self::Duration { .. } => "write seconds greater than 0 that cycles can count, or hold it until its release".into(),
            Self::TooMany { .. } => "release some of them first".into(),
            Self::Fixed { .. } => {
                "leave it as it is, or stop the node and start it with the new configuration".into()
            }
            Self::ForcedGone { .. } => "release it first".into(),
            Self::NotRepeated { .. } => "repeat what was done before it".into(),
            Self::Changing { .. } => "ask again when it has".into(),
            Self::Waiting { .. } => "ask again when it has".into(),
            Self::Gone { .. } => "set what took its place".into(),
            Self::UnknownTransaction { .. } => "the journal lists those that can be undone".into(),
            Self::EarlierRun { .. } => {
                "set what it changed; `isochrone journal FILE.jsonl` shows that".into()
            }
            Self::NoSet { action, .. } => match *action {
                "apply" => "apply the configuration from before it to go back",
                "force" => "release what it forces",
                _ => "force it again",
            }
            .into(),
            Self::TakenBack { by, .. } => format!("undo {by} to have its values again"),
            Self::Moving { by, .. } => format!("undo {by} first, once it has been applied"),
            Self::Conflict { .. } => "undo what changed it first, or set it".into(),
        }
    }
}

fn deed(action: &str) -> String {
    let article = if action.starts_with(['a', 'e']) { "an" } else { "a" };
    format!("{article} {action}")
}

/// As much of a name as a sentence takes.
fn shortened(name: &str) -> String {
    const SHOWN: usize = 100;
    match name.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", escaped(name.get(..end).unwrap_or_default())),
        None => escaped(name).into_owned(),
    }
}

fn fed_by(service: Option<&str>) -> String {
    match service {
        Some(service) => format!("is read from service \"{service}\""),
        None => "the program that runs the node gives".into(),
    }
}
