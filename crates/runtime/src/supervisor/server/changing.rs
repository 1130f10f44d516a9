//! The methods that change what the node does, and ask for the right to do so.

use std::sync::Arc;

use isochrone_control::{
    AckParams, AckResult, Begun, Caller, Code, ForceParams, ForceResult, Handle, Refusal,
    ReleaseParams, SetParams, SetResult, StartParams, StartResult, SwitchParams, SwitchResult,
    UndoParams,
};

use super::ControlServer;
use super::requests::{RequestContext, check_count};

/// `set`: new values of parameters.
impl Handle<SetParams> for ControlServer {
    fn handle(&mut self, params: SetParams, caller: Caller) -> Result<Begun<SetResult>, Refusal> {
        let SetParams { values, at, comment, client } = params;
        check_count("values", values.0.len())?;
        self.check_scheduled(at)?;
        let request = RequestContext { at, client, comment }.request(caller)?;
        self.change(None, |operator, next| operator.set(values.iter(), request, next))
    }
}

/// `force`: holds signals at values.
impl Handle<ForceParams> for ControlServer {
    fn handle(
        &mut self,
        params: ForceParams,
        caller: Caller,
    ) -> Result<Begun<ForceResult>, Refusal> {
        let ForceParams { values, seconds: hold, at, comment, client } = params;
        check_count("values", values.0.len())?;
        self.check_scheduled(at)?;
        let request = RequestContext { at, client, comment }.request(caller)?;
        self.change(Some(hold), |operator, next| operator.force(values.iter(), hold, request, next))
    }
}

/// `release`: the end of forces.
impl Handle<ReleaseParams> for ControlServer {
    fn handle(
        &mut self,
        params: ReleaseParams,
        caller: Caller,
    ) -> Result<Begun<SetResult>, Refusal> {
        self.check_names("names", &params.names)?;
        let request = RequestContext::by(params.client).request(caller)?;
        let names = || params.names.iter().map(String::as_str);
        // The search runs without the lock, so that others need not wait; only this thread changes to another index.
        let signals = Arc::clone(self.shared.lock().operator.signals());
        let unmatched = signals.unmatched(names());
        self.change(None, |operator, next| operator.release(names(), unmatched, request, next))
    }
}

/// `undo`: takes back what a transaction set.
impl Handle<UndoParams> for ControlServer {
    fn handle(&mut self, params: UndoParams, caller: Caller) -> Result<Begun<SetResult>, Refusal> {
        let UndoParams { transaction, client } = params;
        let request = RequestContext::by(client).request(caller)?;
        self.change(None, |operator, next| operator.undo(transaction, request, next))
    }
}

/// `ack`: acknowledges a process alarm.
impl Handle<AckParams> for ControlServer {
    fn handle(&mut self, params: AckParams, caller: Caller) -> Result<Begun<AckResult>, Refusal> {
        let AckParams { alarm, occurrence, comment, client } = params;
        let context = RequestContext { client, comment, ..RequestContext::default() };
        let by = context.request(caller)?.by;
        let mut operating = self.shared.lock();
        operating.operator.check_acknowledgement()?;
        let alarm = operating.acknowledge(&alarm, occurrence, by)?;
        Ok(Begun::Ended(AckResult { alarm }))
    }
}

/// `start`: lets a node send that goes on from its retained state.
impl Handle<StartParams> for ControlServer {
    fn handle(&mut self, _: StartParams, _: Caller) -> Result<Begun<StartResult>, Refusal> {
        let operating = self.shared.lock();
        operating.operator.check_may_set()?;
        let waited = operating.start_sending();
        if waited {
            tracing::warn!("a client has started the node, which sends from now on");
        }
        Ok(Begun::Ended(StartResult { waited }))
    }
}

/// `switch`: hands the node over to the process that stands by.
impl Handle<SwitchParams> for ControlServer {
    fn handle(&mut self, _: SwitchParams, _: Caller) -> Result<Begun<SwitchResult>, Refusal> {
        let operating = self.shared.lock();
        operating.operator.check_may_set()?;
        let refused = |why: &str| Refusal::new(Code::CannotChange, why);
        let twin = operating.twin.as_ref().ok_or_else(|| {
            refused(
                "the node has no standby: start both of its processes with `run FILE --redundant`",
            )
        })?;
        let standby = twin.standby().ok_or_else(|| {
            refused(
                "no standby follows: start one with `run FILE --redundant`, or see why it ended",
            )
        })?;
        if !standby.is_complete {
            return Err(refused("the standby has no state of each task yet: wait until it has"));
        }
        let Some(term) = twin.term() else {
            return Err(refused("the other process holds the node now"));
        };
        let (holder, standby) = (std::process::id(), standby.process);
        tracing::warn!("a client has the node handed over to process {standby}");
        twin.seat().page().ask_to_take_over(term);
        Ok(Begun::Ended(SwitchResult { holder, standby }))
    }
}
