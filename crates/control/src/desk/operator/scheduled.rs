//! Requests for a named cycle: which cycle it is, and how many requests may wait.

use std::collections::BTreeMap;

use isochrone_engine::escaped;
use isochrone_model::{AskedBy, At, Code, Refusal};

use super::check::Check;
use super::{Operator, PendingRequest, RequestTerms};

/// How far ahead of its cycle a request may arrive, in ns.
const MAX_AHEAD_NS: u64 = 10_000_000_000;
/// The most requests for later cycles of a task that one client may have waiting, to leave room for others.
const MAX_OF_CLIENT: usize = 32;
/// The most of all clients together, to leave room for requests that are due at once.
const MAX_OF_ALL: usize = 48;

impl Operator {
    /// The cycle that a request names, in its only task.
    pub(super) fn check_at(
        &self,
        check: &mut Check<'_>,
        request: &RequestTerms,
        mut tasks: impl Iterator<Item = usize>,
        next: &[u64],
    ) -> Option<u64> {
        let (named, task) = (request.at?, tasks.next()?);
        let next = next.get(task).copied().unwrap_or_default();
        let at = match named {
            At::Cycle(at) => at,
            At::In(ahead) => next.saturating_sub(1).saturating_add(ahead),
        };
        let period_ns = self.signals.task(task).map_or(1, |task| task.period_ns);
        let ahead_ns = at.saturating_sub(next).saturating_mul(period_ns);
        let mut names = vec![self.signals.task_name(task)];
        names.extend(tasks.map(|other| self.signals.task_name(other)));
        let (why, help) = if names.len() > 1 {
            let names = names.join(", ");
            let why = format!(
                "the values are of several tasks ({names}), each of which counts its own cycles"
            );
            (why, "make one request for each task")
        } else if at < next {
            ("it has begun".into(), "name a later cycle, or none")
        } else if ahead_ns > MAX_AHEAD_NS {
            ("it is more than 10 s ahead".into(), "ask again when it is near")
        } else {
            check.note(self.check_scheduled(request, task));
            return Some(at);
        };
        check.refuse(Refusal::one(Code::TooLate, "", format!("cycle {named}: {why}"), help));
        None
    }

    /// Whether another request of a client may name a later cycle of a task.
    fn check_scheduled(&self, request: &RequestTerms, task: usize) -> Result<(), Refusal> {
        let who = who(&request.by, request.is_remote);
        let scheduled = || self.on_way_to(task).filter(|sent| sent.is_scheduled);
        let of_client = || scheduled().filter(|sent| self::who(&sent.by, sent.is_remote) == who);
        let of_client_alone = of_client().count() >= MAX_OF_CLIENT;
        if !of_client_alone && scheduled().count() < MAX_OF_ALL {
            return Ok(());
        }
        let in_the_way: Vec<&PendingRequest> =
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

    /// The clients whose requests to write a task has not applied yet, with counts: `40 of "anna" and 3 of process
    /// 4711`.
    pub fn waiting_for(&self, task: usize) -> String {
        clients(self.on_way_to(task))
    }

    fn on_way_to(&self, task: usize) -> impl Iterator<Item = &PendingRequest> {
        self.sent.values().filter(move |sent| sent.due.contains_key(&task))
    }
}

/// How many requests each client has, the most first.
fn clients<'s>(sent: impl Iterator<Item = &'s PendingRequest>) -> String {
    /// How many clients are named.
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

/// The identity of a client: its name, if it has one, stands for all processes of that name, since each run of a verb
/// is a process of its own.
fn who(by: &AskedBy, is_remote: bool) -> String {
    match by {
        AskedBy { client: Some(name), .. } => format!("\"{}\"", escaped(name)),
        AskedBy { process: Some(process), .. } => format!("process {process}"),
        AskedBy { .. } if is_remote => "clients without a name".to_owned(),
        AskedBy { .. } => "the program that runs the node".to_owned(),
    }
}
