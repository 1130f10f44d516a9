//! `journal`: what operators did.

use isochrone_control::{
    Begun, Caller, Entry, Handle, JournalParams, JournalResult, Refusal, Room,
};

use super::ControlServer;
use super::pages::page;

impl Handle<JournalParams> for ControlServer {
    fn handle(
        &mut self,
        params: JournalParams,
        _: Caller,
    ) -> Result<Begun<JournalResult>, Refusal> {
        let operating = self.shared.lock();
        let entries = operating.operator.journal(params.since.unwrap_or_default());
        let total = entries.len() as u64;
        let (_, limit) = page(None, params.limit);
        let mut room = Room::of_answer();
        let mut page = Vec::new();
        for mut entry in entries.take(limit) {
            entry.configuration = None;
            if page.is_empty() {
                shorten(&mut entry);
            }
            if !room.takes(&entry) {
                break;
            }
            page.push(entry);
        }
        let pending = operating.operator.pending();
        let pending = pending.take_while(|pending| room.takes(pending)).collect();
        Ok(Begun::Ended(JournalResult { total, entries: page, pending }))
    }
}

/// Leaves out the changes of an entry that do not fit into one answer.
fn shorten(entry: &mut Entry) {
    let mut room = Room::of_answer();
    let changes = std::mem::take(&mut entry.changes);
    let all = changes.len();
    room.takes(entry);
    entry.changes = changes.into_iter().take_while(|change| room.takes(change)).collect();
    entry.left_out = (all - entry.changes.len()) as u64;
}
