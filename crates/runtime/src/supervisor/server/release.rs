//! `release`: the end of forces.

use isochrone_control::{Begun, Caller, Handle, Refusal, ReleaseParams, SetResult};

use super::ControlServer;
use super::requests::RequestContext;

impl Handle<ReleaseParams> for ControlServer {
    fn handle(
        &mut self,
        params: ReleaseParams,
        caller: Caller,
    ) -> Result<Begun<SetResult>, Refusal> {
        self.check_names("names", &params.names)?;
        let request = RequestContext::by(params.client).request(caller)?;
        let names = params.names.iter().map(String::as_str);
        self.change(None, |operator, next| operator.release(names, request, next))
    }
}
