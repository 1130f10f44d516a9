//! `apply`: a new configuration, prepared in the thread for long jobs.

use std::ops::Range;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::{Diagnostic, Diagnostics, escaped};

use crate::error::ApplyError;
use crate::node::apply::PreparedApply;
use isochrone_control::{
    ApplyParams, ApplyResult, At, Begun, ByTask, Caller, Code, ConfigPlace, Finding, Handle, Part,
    Refusal, Ticket,
};

use super::ControlServer;
use super::applied::Applied;
use super::making::{HeldUp, Making};
use super::requests::{PATIENCE_NS, RequestContext};
use super::under_way::{UnderWay, Work};

/// A client whose change has to wait asks again within this time, if it still wants the change.
const ASKED_AGAIN: Duration = Duration::from_secs(2);

impl Handle<ApplyParams> for ControlServer {
    fn handle(
        &mut self,
        params: ApplyParams,
        caller: Caller,
    ) -> Result<Begun<ApplyResult>, Refusal> {
        if self.making.is_some() {
            let message = "another configuration is being checked; ask again in a second";
            return Err(Refusal::new(Code::Busy, message));
        }
        let ApplyParams { configuration, file, dry_run, allow_missed, client, comment } = params;
        let named = |client: &String| format!("\"{}\"", escaped(client));
        let who = client.as_ref().map_or_else(|| "a client without a name".to_owned(), named);
        let request = RequestContext { at: None, client, comment }.request(caller)?;
        let shared = self.shared.clone();
        // A configuration of thousands of blocks takes time, and other clients should not wait for it.
        let work = move || PreparedApply::new(&shared, &configuration, file, request);
        let job = self.jobs.begin(work)?;
        let ticket = self.ticket();
        let (is_dry, allow_missed) =
            (dry_run.unwrap_or_default(), allow_missed.unwrap_or_default());
        self.making = Some(Making { ticket, who, is_dry, allow_missed, is_given_up: false, job });
        Ok(Begun::Later(ticket))
    }
}

impl ControlServer {
    /// If no one waits for the answer any more, the change is not sent: no answer means that nothing was done.
    pub(super) fn forget_making(&mut self, ticket: Ticket) {
        if let Some(making) = self.making.as_mut().filter(|making| making.ticket == ticket) {
            making.is_given_up = true;
        }
    }

    /// Stops preparing; returns the tickets that wait.
    pub(super) fn end_making(&mut self) -> Option<Ticket> {
        self.making.take().map(|making| making.ticket)
    }

    /// Sends the configurations that have been prepared since the last call.
    pub(super) fn send_made(&mut self) {
        let result = self.making.as_ref().and_then(|making| making.job.result());
        let Some(prepared) = result else { return };
        let Some(making) = self.making.take() else { return };
        let ticket = making.ticket;
        if making.is_given_up {
            tracing::info!(
                "the configuration that was asked for is not applied: nobody waits for it"
            );
            return;
        }
        let prepared = prepared.and_then(|prepared| prepared.map_err(unapplied));
        let sent = prepared.and_then(|prepared| self.send_change(&making, prepared));
        // If transactions are in the way of a change, the refusal has a finding for each.
        let has_to_wait = |failure: &Refusal| {
            failure.code == Code::Busy && !failure.findings.is_empty() && !making.is_dry
        };
        let held_up = sent.as_ref().err().filter(|failure| has_to_wait(failure));
        self.held_up = held_up.map(|_| HeldUp { who: making.who.clone(), at: Instant::now() });
        match sent {
            Ok(under_way) if under_way.is_complete() => self.ended.push_back(under_way.end()),
            Ok(under_way) => self.under_way.push(under_way),
            Err(failure) => self.ended.push_back((ticket, Err(failure))),
        }
    }

    /// Refuses requests for later cycles while a change waits for those that are pending: if new ones were accepted,
    /// it could wait for ever.
    pub(super) fn check_scheduled(&self, at: Option<At>) -> Result<(), Refusal> {
        let waits = |held_up: &&HeldUp| at.is_some() && held_up.at.elapsed() < ASKED_AGAIN;
        let Some(HeldUp { who, .. }) = self.held_up.as_ref().filter(waits) else { return Ok(()) };
        let message = format!("an apply of {who} waits until nothing is still to come");
        let help = "ask without a cycle, or again when it is done";
        Err(Refusal::one(Code::Busy, "", message, help))
    }

    fn send_change(&self, making: &Making, prepared: PreparedApply) -> Result<UnderWay, Refusal> {
        let Making { ticket, is_dry, allow_missed, .. } = *making;
        let (summary, cost_ns) = (prepared.summary().clone(), prepared.cost_ns());
        let (values, tuned) = (prepared.values().to_vec(), prepared.tuned().to_vec());
        let mut operating = self.shared.lock();
        let (tasks, refused) = (ByTask::new(), None);
        let lost_alarms = operating.lost_alarms(&prepared);
        let mut applied = Applied { tasks, summary, values, tuned, lost_alarms, cost_ns, refused };
        if is_dry {
            let slack = operating.check_slack(&prepared);
            applied.refused = slack.err().filter(|_| !allow_missed).map(|error| error.to_string());
            return Ok(UnderWay::new(ticket, 0, 0, Work::Apply(applied)));
        }
        if !allow_missed {
            operating.check_slack(&prepared).map_err(unapplied)?;
        }
        let now_ns = Monotonic.now_ns();
        let sent = operating.send_change(prepared, now_ns).map_err(unapplied)?;
        let mut missing = 0;
        for (task, &cycle) in sent.cycles.iter().enumerate() {
            if operating.release_ns(task, cycle) <= now_ns.saturating_add(PATIENCE_NS) {
                missing += 1;
            } else if let Some(lane) = operating.lanes.get(task) {
                applied.tasks.insert(lane.name.clone(), Part { cycle, pending: true });
            }
        }
        Ok(UnderWay::new(ticket, sent.number, missing, Work::Apply(applied)))
    }
}

fn unapplied(error: ApplyError) -> Refusal {
    match error {
        ApplyError::Configuration(diagnostics) => configuration(&diagnostics),
        ApplyError::Refused(refusal) => refusal,
        error @ (ApplyError::Busy { .. } | ApplyError::NotMeasured { .. }) => {
            Refusal::new(Code::Busy, error.to_string())
        }
        error @ ApplyError::NoSlack { .. } => Refusal::new(Code::CannotChange, error.to_string()),
        error @ ApplyError::Ended => Refusal::new(Code::TooLate, error.to_string()),
        error @ ApplyError::Build(_) => Refusal::new(Code::Internal, error.to_string()),
    }
}

/// The refusal of a configuration, with a finding for each diagnostic.
fn configuration(diagnostics: &Diagnostics) -> Refusal {
    let starts = diagnostics.all.iter().map(|diagnostic| diagnostic.span.start);
    let places = diagnostics.source.positions(starts);
    let finding = |(diagnostic, (line, column)): (&Diagnostic, (usize, usize))| {
        let bytes = |span: &Range<usize>| span.start as u64..span.end as u64;
        Finding {
            name: format!("{line}:{column}"),
            message: diagnostic.to_string(),
            help: diagnostic.help.clone(),
            place: Some(ConfigPlace {
                line: line as u64,
                column: column as u64,
                span: bytes(&diagnostic.span),
                first: diagnostic.first.as_ref().map(bytes),
            }),
        }
    };
    let all = diagnostics.all.iter().zip(places);
    let errors = all.filter(|(diagnostic, _)| !diagnostic.is_warning());
    Refusal::of(Code::Configuration, errors.map(finding).collect())
}
