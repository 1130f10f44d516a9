//! `release`: the end of forces.

use std::sync::Arc;

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
        let names = || params.names.iter().map(String::as_str);
        // Whoever shares the lock need not wait, and only this thread goes over to another index.
        let signals = Arc::clone(self.shared.lock().operator.signals());
        let unmatched = signals.unmatched(names());
        self.change(None, |operator, next| operator.release(names(), unmatched, request, next))
    }
}
