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
        // The search runs without the lock, so that others need not wait; only this thread changes to another index.
        let signals = Arc::clone(self.shared.lock().operator.signals());
        let unmatched = signals.unmatched(names());
        self.change(None, |operator, next| operator.release(names(), unmatched, request, next))
    }
}
