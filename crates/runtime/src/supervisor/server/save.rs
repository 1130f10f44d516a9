//! `save`: the running values as a configuration, written in the thread for long jobs and sent in pieces.

use isochrone_control::{Begun, Caller, Code, Handle, Refusal, SaveParams, SaveResult};

use super::ControlServer;

/// A piece of the text; the first one starts the writing.
impl Handle<SaveParams> for ControlServer {
    fn handle(&mut self, params: SaveParams, caller: Caller) -> Result<Begun<SaveResult>, Refusal> {
        let offset = params.offset.unwrap_or_default();
        if offset > 0 {
            return self.saving.piece(caller.process, offset).map(Begun::Ended);
        }
        if self.saving.is_full() {
            let message = "the configuration is being saved for others; ask again in a second";
            return Err(Refusal::new(Code::Busy, message));
        }
        let mut operating = self.shared.lock();
        let changes = operating.hand_out_changes();
        let text = operating.configuration.source.text.clone();
        drop(operating);
        // A configuration may have megabytes, and other clients should not wait until it is read.
        let job = self.jobs.begin(move || changes.save(&text))?;
        let ticket = self.ticket();
        self.saving.begin(ticket, caller.process, job);
        Ok(Begun::Later(ticket))
    }
}
