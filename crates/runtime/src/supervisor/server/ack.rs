//! `ack`: acknowledges a process alarm.

use isochrone_control::{AckParams, AckResult, Begun, Caller, Handle, Refusal};

use super::ControlServer;
use super::requests::RequestContext;

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
