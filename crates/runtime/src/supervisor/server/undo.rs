//! `undo`: takes back what a transaction set.

use isochrone_control::{Begun, Caller, Handle, Refusal, SetResult, UndoParams};

use super::ControlServer;
use super::requests::RequestContext;

impl Handle<UndoParams> for ControlServer {
    fn handle(&mut self, params: UndoParams, caller: Caller) -> Result<Begun<SetResult>, Refusal> {
        let UndoParams { transaction, client } = params;
        let request = RequestContext::by(client).request(caller)?;
        self.change(None, |operator, next| operator.undo(transaction, request, next))
    }
}
