//! A node that answers, and what it is asked for.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use isochrone_control::{
    AckParams, Client, ClientError, ForceParams, ReleaseParams, SetParams, SetResult, UndoParams,
    Values,
};
use isochrone_ipc::{Participant, ipc};

use super::news::{Absence, CompletedOrder, Order};
use super::telemetry::Telemetry;
use crate::operate::{Purpose, refusal};

type Service = ipc::Service;

/// How long an answer is waited for. A node answers within milliseconds; the screen says before when it
/// does not.
pub(crate) const PATIENCE: Duration = Duration::from_secs(5);

/// A connection to a node that answers.
pub(crate) struct Connection<'p> {
    pub(crate) client: Client<Service>,
    pub(crate) telemetry: Option<Telemetry<'p>>,
    /// When the node started, what it was made from, and how often an announced unit has changed; its signals are known
    /// of that.
    pub(crate) identity: Option<(u64, String, u64)>,
    /// Which run of the node this is, once it has said so.
    pub(crate) started_unix_ns: Option<u64>,
    pub(crate) watched: Vec<String>,
    pub(crate) state_due: Instant,
    pub(crate) values_due: Instant,
}

impl<'p> Connection<'p> {
    pub(crate) fn open(
        participant: &'p Participant<Service>,
        node: &str,
        is_over: &Arc<AtomicBool>,
    ) -> Result<Self, ClientError> {
        let client = Client::connect(participant, node, PATIENCE)?;
        let client = client.interrupted_by(is_over.clone());
        let telemetry = Telemetry::open(participant, node)?;
        let now = Instant::now();
        Ok(Self {
            client,
            telemetry,
            identity: None,
            started_unix_ns: None,
            watched: Vec::new(),
            state_due: now,
            values_due: now,
        })
    }
}

/// Makes the node carry out an order.
pub(crate) fn give(
    asked: &mut Client<Service>,
    order: &Order,
    client: &Option<String>,
) -> Result<CompletedOrder, ClientError> {
    let client = client.clone();
    let result = match order.clone() {
        Order::Set { name, value, comment, .. } => {
            let values = Values(vec![(name, value.into())]);
            asked.call(&SetParams { values, client, at: None, comment })?
        }
        Order::Force { name, value, hold, comment, .. } => {
            let values = Values(vec![(name, value.into())]);
            let params =
                ForceParams { values, seconds: hold, client, comment, ..ForceParams::default() };
            let forced = asked.call(&params)?;
            SetResult {
                transaction: forced.transaction,
                tasks: forced.tasks,
                before: forced.before,
                after: forced.after,
                types: forced.types,
                warnings: forced.warnings,
            }
        }
        Order::Release { name } => asked.call(&ReleaseParams { names: vec![name], client })?,
        Order::Acknowledge { alarm, occurrence, comment } => {
            let occurrence = Some(occurrence);
            asked.call(&AckParams { alarm, occurrence, comment, client })?;
            return Ok(CompletedOrder {
                order: order.clone(),
                transaction: None,
                before: Values::default(),
                cycles: Vec::new(),
                warnings: Vec::new(),
            });
        }
        Order::Undo { transaction, .. } => asked.call(&UndoParams { transaction, client })?,
    };
    Ok(CompletedOrder {
        order: order.clone(),
        transaction: Some(result.transaction),
        before: result.before,
        cycles: result.tasks.into_iter().map(|(task, part)| (task, part.cycle)).collect(),
        warnings: result.warnings.iter().map(|it| format!("{}: {it}", it.name)).collect(),
    })
}

/// Why an order was not carried out.
pub(crate) fn whole(error: &ClientError) -> String {
    match error {
        ClientError::Refused(failure) => refusal(failure, Purpose::Change),
        error => error.to_string(),
    }
}

/// The state of the node according to an error.
pub(crate) fn absence(error: &ClientError) -> Absence {
    match error {
        ClientError::Ended { .. } | ClientError::NoNode { .. } => Absence::Ended,
        _ => Absence::Silent,
    }
}
