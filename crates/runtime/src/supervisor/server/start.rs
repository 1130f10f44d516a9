//! `start`: lets a node send that goes on from its retained state.

use isochrone_control::{Begun, Caller, Handle, Refusal, StartParams, StartResult};

use super::ControlServer;

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
