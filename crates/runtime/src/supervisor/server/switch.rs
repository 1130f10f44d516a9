//! `switch`: hands the node over to the process that stands by.

use isochrone_control::{Begun, Caller, Code, Handle, Refusal, SwitchParams, SwitchResult};

use super::ControlServer;

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
