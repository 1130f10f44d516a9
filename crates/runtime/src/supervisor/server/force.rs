//! `force`: holds signals at values.

use isochrone_control::{Begun, Caller, ForceParams, ForceResult, Handle, Refusal};

use super::ControlServer;
use super::requests::{RequestContext, check_count};

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
