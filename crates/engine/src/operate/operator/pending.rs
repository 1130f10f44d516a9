//! What is still to come.

use std::sync::Arc;

use super::{Client, Forced, Kind, Operator, Sent};

/// A transaction that waits for the cycle that it names.
#[derive(Debug, Clone, PartialEq)]
pub struct Pending {
    /// Its number.
    pub transaction: u64,
    /// What it will do, as journals say: `set`, `force`, `release` or `undo`.
    pub action: &'static str,
    /// Index of its task.
    pub task: usize,
    /// The cycle that it waits for.
    pub cycle: u64,
    /// The signals that it will change.
    pub names: Vec<String>,
    /// Who asked for it.
    pub client: Client,
    /// What they said of it.
    pub comment: Option<Arc<str>>,
}

impl Operator {
    /// The transactions that wait for a cycle that they name, in the order of their numbers.
    pub fn pending(&self) -> impl Iterator<Item = Pending> {
        self.sent.iter().filter_map(|(&transaction, sent)| self.to_come(transaction, sent))
    }

    fn to_come(&self, transaction: u64, sent: &Sent) -> Option<Pending> {
        let cycle = sent.at?;
        let action = match sent.kind {
            Kind::Set => "set",
            Kind::Force => "force",
            Kind::Release => "release",
            Kind::Undo { .. } => "undo",
            Kind::Read | Kind::Change => return None,
        };
        let written = sent.writes.iter().map(|(task, slot)| {
            let name = self.signal_at(*task, *slot).map(|signal| signal.name);
            (*task, name.unwrap_or_default())
        });
        let is_its = |forced: &&Forced| forced.transaction == transaction;
        let forces = self.forces.iter().flat_map(|of| of.values().flatten()).filter(is_its);
        let forced = forces.map(|forced| (forced.task, forced.name.clone()));
        let mut names: Vec<(usize, String)> = written.chain(forced).collect();
        names.sort_unstable();
        // A cycle is of one task; what the program gives to its inputs is no operator's doing.
        let task = names.first()?.0;
        let names = names.into_iter().map(|(_, name)| name).collect();
        let (client, comment) = (sent.client.clone(), sent.comment.clone());
        Some(Pending { transaction, action, task, cycle, names, client, comment })
    }
}
