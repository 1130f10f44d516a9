//! `set`: new values of parameters.

use isochrone_control::{Begun, Caller, Handle, Refusal, SetParams, SetResult};

use super::ControlServer;
use super::requests::{RequestContext, check_count};

impl Handle<SetParams> for ControlServer {
    fn handle(&mut self, params: SetParams, caller: Caller) -> Result<Begun<SetResult>, Refusal> {
        let SetParams { values, at, comment, client } = params;
        check_count("values", values.0.len())?;
        self.check_scheduled(at)?;
        let request = RequestContext { at, client, comment }.request(caller)?;
        self.change(None, |operator, next| operator.set(values.iter(), request, next))
    }
}
