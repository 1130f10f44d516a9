//! What changes and reads values: checked, sent to its tasks, and answered when it has happened.

use std::sync::Arc;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::operate::{
    Client, Hold, Operator, Prepared, Refusal, RefusalKind, Refusals, Request, Selection, Value,
};

use crate::control::{
    self, Begun, Caller, Code, Failure, Finding, ForceParams, GetParams, Part, ReleaseParams,
    SetParams, Ticket, UndoParams, Values,
};
use crate::error::SendError;
use crate::operating::Origin;

use super::Attendant;
use super::searching::{Purpose, Search};
use super::under_way::{Change, Read, UnderWay, Work};

/// Most values and names of one request, and most values of one page.
const MAX_VALUES: usize = 4096;
/// Longest comment, in bytes; the journal keeps thousands.
const MAX_COMMENT_BYTES: usize = 1000;
/// Longest name of a client, in bytes.
const MAX_CLIENT_BYTES: usize = 100;
/// What is due later than this is answered before it happens.
pub(super) const PATIENCE_NS: u64 = 1_000_000_000;

/// What a request says beside its values.
#[derive(Default)]
pub(super) struct Beside {
    pub(super) at: Option<u64>,
    pub(super) client: Option<String>,
    pub(super) comment: Option<String>,
}

impl Attendant {
    pub(super) fn set(&mut self, params: SetParams, caller: Caller) -> Result<Begun, Failure> {
        let SetParams { values, at, comment, client } = params;
        check_count("values", values.0.len())?;
        let request = Beside { at, client, comment }.request(caller)?;
        self.change(at, None, |operator, next| operator.set(named(&values), request, next))
    }

    pub(super) fn force(&mut self, params: ForceParams, caller: Caller) -> Result<Begun, Failure> {
        let ForceParams { values, seconds, at, comment, client } = params;
        check_count("values", values.0.len())?;
        let hold = match seconds {
            control::Hold::Seconds(seconds) => Hold::Seconds(seconds),
            control::Hold::UntilReleased => Hold::UntilReleased,
        };
        let request = Beside { at, client, comment }.request(caller)?;
        self.change(at, Some(hold), |operator, next| {
            operator.force(named(&values), hold, request, next)
        })
    }

    pub(super) fn release(
        &mut self,
        params: ReleaseParams,
        caller: Caller,
    ) -> Result<Begun, Failure> {
        check_count("names", params.names.len())?;
        let request = Beside::by(params.client).request(caller)?;
        let names = params.names.iter().map(String::as_str);
        self.change(None, None, |operator, next| operator.release(names, request, next))
    }

    pub(super) fn undo(&mut self, params: UndoParams, caller: Caller) -> Result<Begun, Failure> {
        let UndoParams { transaction, client } = params;
        let request = Beside::by(client).request(caller)?;
        self.change(None, None, |operator, next| operator.undo(transaction, request, next))
    }

    pub(super) fn get(&mut self, params: GetParams) -> Result<Begun, Failure> {
        check_count("names", params.names.len())?;
        let offset = params.offset.unwrap_or_default().try_into().unwrap_or(usize::MAX);
        let limit = params.limit.unwrap_or(MAX_VALUES as u64).min(MAX_VALUES as u64) as usize;
        self.search(Search { names: Some(params.names), offset, limit, purpose: Purpose::Read })
    }

    /// Sends for the values of what was found. `None`: the configuration was changed since.
    pub(super) fn read(
        &mut self,
        ticket: Ticket,
        mut selection: Selection,
    ) -> Result<Option<Begun>, Failure> {
        let mut operating = self.shared.lock();
        let Some(mut prepared) = operating.operator.read(&mut selection) else { return Ok(None) };
        let total = selection.total();
        let order = std::mem::take(&mut prepared.read_from);
        let missing = prepared.tasks().count();
        let number = operating.send(Origin::Service, prepared).map_err(unsent)?.number;
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
        Ok(Some(self.begun(ticket, number, missing, Work::Read(read))))
    }

    /// Sends what is prepared, and says of each part whether it will be waited for.
    fn change(
        &mut self,
        at: Option<u64>,
        hold: Option<Hold>,
        prepare: impl FnOnce(&Operator, &[u64]) -> Result<Prepared, Refusals>,
    ) -> Result<Begun, Failure> {
        let mut operating = self.shared.lock();
        let now_ns = Monotonic.now_ns();
        let next = operating.next_cycles(now_ns);
        let prepared = prepare(&operating.operator, &next).map_err(failure)?;
        let tasks: Vec<usize> = prepared.tasks().collect();
        let sent = operating.send(Origin::Service, prepared).map_err(unsent)?;
        let mut missing = 0;
        let mut change = Change {
            names: operating.lanes.iter().map(|lane| lane.name.clone()).collect(),
            warnings: sent.warnings,
            until: hold.map(|_| control::ByTask::new()),
            ..Change::default()
        };
        for task in tasks {
            let cycle = at.or(next.get(task).copied()).unwrap_or_default();
            if operating.release_ns(task, cycle) <= now_ns.saturating_add(PATIENCE_NS) {
                missing += 1;
                continue;
            }
            let Some(name) = change.names.get(task) else { continue };
            change.tasks.insert(name.clone(), Part { cycle, pending: true });
            if let (Some(hold), Some(until)) = (hold, &mut change.until) {
                let cycles = operating.operator.cycles(task, hold);
                until.insert(name.clone(), cycles.map(|cycles| cycle.saturating_add(cycles)));
            }
        }
        drop(operating);
        let ticket = self.ticket();
        Ok(self.begun(ticket, sent.number, missing, Work::Change(change)))
    }

    fn begun(&mut self, ticket: Ticket, number: u64, missing: usize, work: Work) -> Begun {
        if missing == 0 {
            return Begun::Ended(Ok(work.reply(number, Vec::new())));
        }
        self.under_way.push(UnderWay::new(ticket, number, missing, work));
        Begun::Later(ticket)
    }
}

impl Beside {
    /// No more than who asks.
    pub(super) fn by(client: Option<String>) -> Self {
        Self { client, ..Self::default() }
    }

    pub(super) fn request(self, caller: Caller) -> Result<Request, Failure> {
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
            return Err(Failure::of(Code::InvalidParams, findings));
        }
        let name = self.client.map(Arc::from);
        let client = Client::Other { name, process: caller.process };
        Ok(Request { at: self.at, client, comment: self.comment.map(Arc::from) })
    }
}

fn named(values: &Values) -> impl Iterator<Item = (&str, Value)> {
    values.iter().map(|(name, value)| (name, value.into()))
}

pub(super) fn check_count(member: &'static str, count: usize) -> Result<(), Failure> {
    if count <= MAX_VALUES {
        return Ok(());
    }
    let message = format!("\"{member}\" has {count} entries");
    let help = format!("at most {MAX_VALUES} are possible: divide the request");
    let finding = Finding::new(member, message).with_help(help);
    Err(Failure::of(Code::InvalidParams, vec![finding]))
}

/// Why the operator refuses.
pub(super) fn failure(refusals: Refusals) -> Failure {
    let finding = |refusal: &Refusal| {
        Finding::new(refusal.name(), refusal.to_string()).with_help(refusal.help())
    };
    let findings = refusals.findings().iter().map(finding).collect();
    Failure::of(code(refusals.kind()), findings)
}

fn code(kind: RefusalKind) -> Code {
    match kind {
        RefusalKind::UnknownName => Code::UnknownName,
        RefusalKind::NotWritable => Code::NotWritable,
        RefusalKind::WrongValue => Code::WrongValue,
        RefusalKind::TooLate => Code::TooLate,
        RefusalKind::Busy => Code::Busy,
        RefusalKind::Forbidden => Code::Forbidden,
        RefusalKind::CannotChange => Code::CannotChange,
        RefusalKind::Conflict => Code::Conflict,
        _ => Code::Internal,
    }
}

fn unsent(error: SendError) -> Failure {
    match error {
        SendError::Refused(refusals) => failure(refusals),
        error @ SendError::Busy { .. } => Failure::new(Code::Busy, error.to_string()),
        error @ SendError::Ended => Failure::new(Code::TooLate, error.to_string()),
    }
}
