//! Whose requests wait for cycles of a task, and how many may.

use std::collections::BTreeMap;

use isochrone_engine::escaped;
use isochrone_model::{AskedBy, Code, Refusal};

use super::{Operator, RequestTerms, Sent};

/// Most requests of one client that may name later cycles of a task, so that it leaves others some room.
const MAX_OF_CLIENT: usize = 32;
/// Most requests of all clients that may: what is to happen at once finds room beside them.
const MAX_OF_ALL: usize = 48;

impl Operator {
    /// Whether another request of a client may name a later cycle of a task.
    pub(super) fn check_scheduled(
        &self,
        request: &RequestTerms,
        task: usize,
    ) -> Result<(), Refusal> {
        let who = who(&request.by, request.is_remote);
        let scheduled = || self.on_way_to(task).filter(|sent| sent.is_scheduled);
        let of_client = || scheduled().filter(|sent| self::who(&sent.by, sent.is_remote) == who);
        let of_client_alone = of_client().count() >= MAX_OF_CLIENT;
        if !of_client_alone && scheduled().count() < MAX_OF_ALL {
            return Ok(());
        }
        let in_the_way: Vec<&Sent> =
            if of_client_alone { of_client().collect() } else { scheduled().collect() };
        let first = in_the_way.iter().filter_map(|sent| sent.due.get(&task)).min();
        let (most, whose) =
            if of_client_alone { (MAX_OF_CLIENT, " of one client") } else { (MAX_OF_ALL, "") };
        let message = format!(
            "task \"{}\" keeps at most {most} requests{whose} for later cycles, and has {}",
            self.signals.task_name(task),
            clients(in_the_way.iter().copied())
        );
        let help = format!(
            "ask without a cycle, or again after cycle {}, when the first of them has come",
            first.copied().unwrap_or_default()
        );
        Err(Refusal::one(Code::Busy, "", message, help))
    }

    /// Whose requests to write a task has not come to yet, and how many: `40 of "anna" and 3 of process 4711`.
    pub fn waiting_for(&self, task: usize) -> String {
        clients(self.on_way_to(task))
    }

    fn on_way_to(&self, task: usize) -> impl Iterator<Item = &Sent> {
        self.sent.values().filter(move |sent| sent.due.contains_key(&task))
    }
}

/// How many are of whom, those with the most first.
fn clients<'s>(sent: impl Iterator<Item = &'s Sent>) -> String {
    /// So many are named.
    const NAMED: usize = 4;
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for sent in sent {
        *counts.entry(who(&sent.by, sent.is_remote)).or_default() += 1;
    }
    let mut counts: Vec<(String, usize)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let others: usize = counts.iter().skip(NAMED).map(|(_, count)| count).sum();
    counts.truncate(NAMED);
    let others = (others > 0).then(|| format!("{others} of others"));
    let named = counts.into_iter().map(|(who, count)| format!("{count} of {who}"));
    let parts: Vec<String> = named.chain(others).collect();
    match &parts[..] {
        [parts @ .., last] if !parts.is_empty() => format!("{} and {last}", parts.join(", ")),
        parts => parts.concat(),
    }
}

/// As whom a client counts: a name stands for all processes that call themselves so, since each run of a verb is a
/// process of its own.
fn who(by: &AskedBy, is_remote: bool) -> String {
    match by {
        AskedBy { client: Some(name), .. } => format!("\"{}\"", escaped(name)),
        AskedBy { process: Some(process), .. } => format!("process {process}"),
        AskedBy { .. } if is_remote => "clients without a name".to_owned(),
        AskedBy { .. } => "the program that runs the node".to_owned(),
    }
}
