//! A node that answers, and what it is asked for.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use isochrone_ipc::{Participant, ipc};
use isochrone_runtime::control::{
    Client, ClientError, ForceParams, ReleaseParams, SetParams, SetResult, UndoParams, Values,
};

use super::news::{Done, Order};
use super::telemetry::Telemetry;
use crate::operate::{Asked, client, refusal};

type Service = ipc::Service;

/// How long an answer is waited for. A node answers within milliseconds; the screen says before when it
/// does not.
const PATIENCE: Duration = Duration::from_secs(5);

/// A node that answers.
pub(super) struct Link {
    pub(super) client: Client<Service>,
    pub(super) telemetry: Option<Telemetry>,
    /// When the node started and what it was made from; its signals are known of that.
    pub(super) identity: Option<(u64, String)>,
    pub(super) watched: Vec<String>,
    pub(super) state_due: Instant,
    pub(super) values_due: Instant,
}

impl Link {
    pub(super) fn open(
        participant: &Participant<Service>,
        node: &str,
        is_over: &Arc<AtomicBool>,
    ) -> Result<Self, ClientError> {
        let client = Client::connect(participant, node, PATIENCE)?;
        let mut client = client.interrupted_by(is_over.clone());
        client.allow_for_first_cycles()?;
        let telemetry = Telemetry::open(participant, node)?;
        let now = Instant::now();
        Ok(Self {
            client,
            telemetry,
            identity: None,
            watched: Vec::new(),
            state_due: now,
            values_due: now,
        })
    }

    pub(super) fn give(&mut self, order: &Order) -> Result<Done, ClientError> {
        let result = match order.clone() {
            Order::Set { name, value, comment, .. } => {
                let values = Values(vec![(name, value)]);
                let (client, at) = (client(), None);
                self.client.call(&SetParams { values, client, at, comment })?
            }
            Order::Force { name, value, hold, comment, .. } => {
                let values = Values(vec![(name, value)]);
                let params = ForceParams {
                    values,
                    seconds: hold,
                    client: client(),
                    comment,
                    ..ForceParams::default()
                };
                let forced = self.client.call(&params)?;
                SetResult {
                    transaction: forced.transaction,
                    tasks: forced.tasks,
                    before: forced.before,
                    after: Values::default(),
                    warnings: forced.warnings,
                }
            }
            Order::Release { name } => {
                self.client.call(&ReleaseParams { names: vec![name], client: client() })?
            }
            Order::Undo { transaction, .. } => {
                self.client.call(&UndoParams { transaction, client: client() })?
            }
        };
        Ok(Done {
            order: order.clone(),
            transaction: result.transaction,
            before: result.before,
            cycles: result.tasks.into_iter().map(|(task, part)| (task, part.cycle)).collect(),
            warnings: result.warnings.iter().map(|it| format!("{}: {it}", it.name)).collect(),
        })
    }
}

/// Why an order was not carried out.
pub(super) fn whole(error: &ClientError) -> String {
    match error {
        ClientError::Refused(failure) => refusal(failure, Asked::ToChange),
        error => error.to_string(),
    }
}
