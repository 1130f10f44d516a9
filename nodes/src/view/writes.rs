//! Changes that a page asks for: the node checks them, and its journal says who asked.

use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};

use serde::{Deserialize, Serialize};

use super::plant::Plant;
use super::threads::locked;
use crate::base::session::{Asker, Order, Outcome, Target, Wish, change};
use crate::operate::NodeArgs;

/// Makes the changes to the node, one at a time.
pub(super) struct Writer {
    pub(super) args: NodeArgs,
    pub(super) asker: Asker,
    pub(super) is_over: Arc<AtomicBool>,
    /// To the thread that reads from the node.
    pub(super) wishes: Sender<Wish>,
    pub(super) turn: Mutex<()>,
}

/// A request of a page.
pub(super) enum WriteRequest {
    Set(Set),
    Undo(Undo),
    Ack(Ack),
}

/// A parameter and its value, as it was typed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Set {
    name: String,
    value: String,
}

/// A set that shall be taken back.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Undo {
    transaction: u64,
}

/// Occurrences of a process alarm that shall be acknowledged.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ack {
    alarm: String,
    /// The last of them.
    occurrence: u64,
}

/// The result of a change.
#[derive(Serialize)]
pub(super) struct WriteResult {
    /// `None`: no value was changed.
    transaction: Option<u64>,
    /// In words.
    told: String,
    warnings: Vec<String>,
}

impl Writer {
    /// Carries out what a page asks for; a sentence if that cannot be.
    pub(super) fn carry_out(
        &self,
        plant: &Mutex<Plant>,
        asked: WriteRequest,
    ) -> Result<WriteResult, String> {
        let order = match asked {
            WriteRequest::Set(Set { name, value }) => {
                let plant = locked(plant);
                let signal = plant.signal(&name).ok_or("the node has no such signal")?;
                let target = Target::new(signal);
                let value = target.read(&value)?;
                let to = target.shown(value);
                Order::Set { name, value, to, comment: None }
            }
            WriteRequest::Ack(Ack { alarm, occurrence }) => {
                Order::Acknowledge { alarm, occurrence, comment: None }
            }
            WriteRequest::Undo(Undo { transaction }) => {
                Order::Undo { transaction, what: "what this page has set".into() }
            }
        };
        let turn = locked(&self.turn);
        let outcome = change(&self.args, &self.asker, &self.is_over, &order, |_| ());
        drop(turn);
        let done = match outcome {
            Outcome::Done(done) => done,
            Outcome::Refused(why) => return Err(why),
            Outcome::NoPlace => {
                return Err(
                    "as many programs as there can be ask this node already; try again".into()
                );
            }
        };
        // Nobody waits for it where the program ends.
        let _ = self.wishes.send(Wish::Look);
        let plant = locked(plant);
        let before = done.before.iter().map(|(name, value)| match plant.signal(name) {
            Some(signal) => Target::new(signal).shown(value),
            None => value.to_string(),
        });
        let before = before.collect::<Vec<_>>().join(", ");
        let since = done.cycles.iter().map(|(task, cycle)| format!("cycle {cycle} of {task}"));
        let since = since.collect::<Vec<_>>().join(", ");
        let told = match order {
            Order::Acknowledge { .. } => order.to_string(),
            Order::Undo { .. } => format!("taken back from {since} on (was {before})"),
            _ => format!("{order}, from {since} on (was {before})"),
        };
        Ok(WriteResult { transaction: done.transaction, told, warnings: done.warnings })
    }
}
