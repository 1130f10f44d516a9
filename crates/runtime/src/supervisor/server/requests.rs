//! What changes and reads values: checked, sent to its tasks, and answered when it has happened.

use std::sync::{Arc, MutexGuard};

use isochrone_control::desk::{Operator, PreparedRequest, RequestTerms, Selection, Signals};
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::Pattern;

use crate::error::SendError;
use crate::operating::{Lane, Operating, Shared};
use isochrone_control::{
    AskedBy, Begun, ByTask, Caller, Code, Finding, ForceParams, GetParams, Hold, Part, Refusal,
    ReleaseParams, SetParams, UndoParams,
};

use super::ControlServer;
use super::under_way::{Change, Read, UnderWay, Work};

/// Most values and names of one request, and most values of one page.
const MAX_VALUES: usize = 4096;
/// Most globs of one request times instances of the node: each glob is compared with each instance while
/// others wait.
const MAX_COMPARED: usize = 16_000_000;
/// Longest comment, in bytes; the journal keeps thousands.
const MAX_COMMENT_BYTES: usize = 1000;
/// Longest name of a client, in bytes.
const MAX_CLIENT_BYTES: usize = 100;
/// What is due later than this is answered before it happens.
pub(super) const PATIENCE_NS: u64 = 1_000_000_000;

/// What a request says beside its values.
#[derive(Default)]
pub(super) struct RequestContext {
    pub(super) at: Option<u64>,
    pub(super) client: Option<String>,
    pub(super) comment: Option<String>,
}

impl ControlServer {
    pub(super) fn set(&mut self, params: SetParams, caller: Caller) -> Result<Begun, Refusal> {
        let SetParams { values, at, comment, client } = params;
        check_count("values", values.0.len())?;
        let request = RequestContext { at, client, comment }.request(caller)?;
        self.change(at, None, |operator, next| operator.set(values.iter(), request, next))
    }

    pub(super) fn force(&mut self, params: ForceParams, caller: Caller) -> Result<Begun, Refusal> {
        let ForceParams { values, seconds: hold, at, comment, client } = params;
        check_count("values", values.0.len())?;
        let request = RequestContext { at, client, comment }.request(caller)?;
        self.change(at, Some(hold), |operator, next| {
            operator.force(values.iter(), hold, request, next)
        })
    }

    pub(super) fn release(
        &mut self,
        params: ReleaseParams,
        caller: Caller,
    ) -> Result<Begun, Refusal> {
        self.check_names("names", &params.names)?;
        let request = RequestContext::by(params.client).request(caller)?;
        let names = params.names.iter().map(String::as_str);
        self.change(None, None, |operator, next| operator.release(names, request, next))
    }

    pub(super) fn undo(&mut self, params: UndoParams, caller: Caller) -> Result<Begun, Refusal> {
        let UndoParams { transaction, client } = params;
        let request = RequestContext::by(client).request(caller)?;
        self.change(None, None, |operator, next| operator.undo(transaction, request, next))
    }

    pub(super) fn get(&mut self, params: GetParams) -> Result<Begun, Refusal> {
        self.check_names("names", &params.names)?;
        let offset = params.offset.unwrap_or_default().try_into().unwrap_or(usize::MAX);
        let limit = params.limit.unwrap_or(MAX_VALUES as u64).min(MAX_VALUES as u64) as usize;
        let names = || params.names.iter().map(String::as_str);
        let (mut operating, selection) = select(&self.shared, |signals| {
            Ok(Selection::of(signals, names(), offset, limit)?.with_quality())
        })?;
        let total = selection.total();
        let mut prepared = operating.operator.read(selection);
        let order = std::mem::take(&mut prepared.read_from);
        let missing = prepared.tasks().count();
        let number = operating.send(prepared).map_err(unsent)?.number;
        let grid = |task: usize| operating.release_ns(task, 0);
        let lanes = operating.lanes.iter().enumerate();
        let read = Read {
            names: operating.lanes.iter().map(|lane| lane.name.clone()).collect(),
            grids: lanes.map(|(task, lane)| (grid(task), lane.schedule.period_ns)).collect(),
            total: total as u64,
            order,
            readings: Vec::new(),
        };
        drop(operating);
        Ok(self.begun(number, missing, Work::Read(read)))
    }

    /// Sends what is prepared, and says of each part whether it will be waited for.
    fn change(
        &mut self,
        at: Option<u64>,
        hold: Option<Hold>,
        prepare: impl FnOnce(&Operator, &[u64]) -> Result<PreparedRequest, Refusal>,
    ) -> Result<Begun, Refusal> {
        let mut operating = self.shared.lock();
        let now_ns = Monotonic.now_ns();
        let next = operating.next_cycles(now_ns);
        let prepared = prepare(&operating.operator, &next)?;
        let tasks: Vec<usize> = prepared.tasks().collect();
        let sent = operating.send(prepared).map_err(unsent)?;
        let mut missing = 0;
        let mut change = Change {
            warnings: sent.warnings,
            until: hold.map(|_| ByTask::new()),
            ..Change::default()
        };
        for task in tasks {
            let cycle = at.or(next.get(task).copied()).unwrap_or_default();
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

    /// Refuses more names than are looked up at once.
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

    fn begun(&mut self, number: u64, missing: usize, work: Work) -> Begun {
        if missing == 0 {
            return Begun::Ended(Ok(work.reply(number, Vec::new())));
        }
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

/// Looks for signals in the index of names, which may take some tenths of a second, so that nobody who shares
/// the lock waits for it. Returns the lock under which the node still has them.
pub(super) fn select(
    shared: &Shared,
    find: impl Fn(&Arc<Signals>) -> Result<Selection, Refusal>,
) -> Result<(MutexGuard<'_, Operating>, Selection), Refusal> {
    loop {
        let signals = Arc::clone(shared.lock().operator.signals());
        let selection = find(&signals)?;
        let operating = shared.lock();
        if selection.is_of(operating.operator.signals()) {
            return Ok((operating, selection));
        }
        // The configuration was changed meanwhile.
    }
}

fn check_count(member: &'static str, count: usize) -> Result<(), Refusal> {
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

fn unsent(error: SendError) -> Refusal {
    match error {
        SendError::Refused(refusal) => refusal,
        error @ SendError::Busy { .. } => Refusal::new(Code::Busy, error.to_string()),
        error @ SendError::Ended => Refusal::new(Code::TooLate, error.to_string()),
    }
}
