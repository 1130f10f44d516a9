//! The common part of requests that change or read values: they are checked, sent to their tasks, and answered when
//! the tasks have carried them out.

use isochrone_control::desk::{Operator, PreparedRequest, RequestTerms};
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::Pattern;

use crate::error::SendError;
use crate::operating::Lane;
use isochrone_control::{AskedBy, At, Begun, ByTask, Caller, Code, Finding, Hold, Part, Refusal};

use super::ControlServer;
use super::under_way::{Change, UnderWay, Work};

/// The most values and names of one request, and the most values of one page.
pub(super) const MAX_VALUES: usize = 4096;
/// The most globs of one request times instances of the node: each glob is compared with each instance, while other
/// clients wait.
const MAX_COMPARED: usize = 16_000_000;
/// Longest comment, in bytes; the journal keeps thousands.
const MAX_COMMENT_BYTES: usize = 1000;
/// Longest name of a client, in bytes.
const MAX_CLIENT_BYTES: usize = 100;
/// A request that is due later than this is answered before it is carried out.
pub(super) const PATIENCE_NS: u64 = 1_000_000_000;

/// The members of a request besides its values.
#[derive(Default)]
pub(super) struct RequestContext {
    pub(super) at: Option<At>,
    pub(super) client: Option<String>,
    pub(super) comment: Option<String>,
}

impl ControlServer {
    /// Sends a prepared request; returns for each part whether its answer is waited for.
    pub(super) fn change<R>(
        &mut self,
        hold: Option<Hold>,
        prepare: impl FnOnce(&Operator, &[u64]) -> Result<PreparedRequest, Refusal>,
    ) -> Result<Begun<R>, Refusal> {
        let mut operating = self.shared.lock();
        let now_ns = Monotonic.now_ns();
        let next = operating.next_cycles(now_ns);
        let prepared = prepare(&operating.operator, &next)?;
        let due: Vec<(usize, u64)> = prepared.cycles().collect();
        let sent = operating.send(prepared).map_err(unsent)?;
        let mut missing = 0;
        let mut change = Change {
            warnings: sent.warnings,
            until: hold.map(|_| ByTask::new()),
            ..Change::default()
        };
        for (task, cycle) in due {
            if operating.release_ns(task, cycle) <= now_ns.saturating_add(PATIENCE_NS) {
                missing += 1;
                continue;
            }
            let Some(Lane { name, .. }) = operating.lanes.get(task) else { continue };
            change.tasks.insert(name.clone(), Part { cycle, pending: true });
            if let (Some(hold), Some(until)) = (hold, &mut change.until) {
                let cycles = operating.operator.cycles(task, hold);
                until.insert(name.clone(), cycles.map(|cycles| cycle.saturating_add(cycles)));
            }
        }
        drop(operating);
        Ok(self.begun(sent.number, missing, Work::Change(change)))
    }

    /// Refuses a request with more names than may be looked up at once.
    pub(super) fn check_names(
        &self,
        member: &'static str,
        names: &[String],
    ) -> Result<(), Refusal> {
        check_count(member, names.len())?;
        let globs = names.iter().filter(|name| Pattern::is_glob(name)).count();
        let instances = self.shared.lock().operator.signals().instances();
        check_at_most(MAX_COMPARED / instances.max(1), member, "names with *", globs)
    }

    /// Keeps a request that was sent until its answer is complete.
    pub(super) fn begun<R>(&mut self, number: u64, missing: usize, work: Work) -> Begun<R> {
        let ticket = self.ticket();
        self.under_way.push(UnderWay::new(ticket, number, missing, work));
        Begun::Later(ticket)
    }
}

impl RequestContext {
    /// No more than who asks.
    pub(super) fn by(client: Option<String>) -> Self {
        Self { client, ..Self::default() }
    }

    pub(super) fn request(self, caller: Caller) -> Result<RequestTerms, Refusal> {
        let mut findings = Vec::new();
        let lengths = [
            ("client", &self.client, MAX_CLIENT_BYTES),
            ("comment", &self.comment, MAX_COMMENT_BYTES),
        ];
        for (name, text, most) in lengths {
            let length = text.as_ref().map_or(0, String::len);
            if length > most {
                let message = format!("\"{name}\" has {length} bytes");
                findings
                    .push(Finding::new(name, message).with_help(format!("give at most {most}")));
            }
        }
        if !findings.is_empty() {
            return Err(Refusal::of(Code::InvalidParams, findings));
        }
        let Self { at, client, comment } = self;
        let by = AskedBy { client, process: caller.process, comment };
        Ok(RequestTerms { at, by, is_remote: true })
    }
}

pub(super) fn check_count(member: &'static str, count: usize) -> Result<(), Refusal> {
    check_at_most(MAX_VALUES, member, "entries", count)
}

fn check_at_most(
    most: usize,
    member: &'static str,
    of: &'static str,
    count: usize,
) -> Result<(), Refusal> {
    if count <= most {
        return Ok(());
    }
    let message = format!("\"{member}\" has {count} {of}");
    let help = format!("at most {most} are possible: divide the request");
    let finding = Finding::new(member, message).with_help(help);
    Err(Refusal::of(Code::InvalidParams, vec![finding]))
}

pub(super) fn unsent(error: SendError) -> Refusal {
    match error {
        SendError::Refused(refusal) => refusal,
        error @ SendError::Busy { .. } => Refusal::new(Code::Busy, error.to_string()),
        error @ SendError::Ended => Refusal::new(Code::TooLate, error.to_string()),
    }
}
