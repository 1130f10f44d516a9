//! `alarms`: the active alarms, and the process alarms with their events.

use isochrone_control::{AlarmsParams, AlarmsResult, Begun, Caller, Handle, Refusal, Room};

use super::ControlServer;
use super::pages::page;

impl Handle<AlarmsParams> for ControlServer {
    fn handle(&mut self, params: AlarmsParams, _: Caller) -> Result<Begun<AlarmsResult>, Refusal> {
        let operating = self.shared.lock();
        let (process, total) = (&operating.process_alarms, operating.count_alarms());
        let (offset, limit) = page(params.offset, params.limit);
        let mut room = Room::of_answer();
        let alarms = operating.active_alarms().skip(offset).take(limit);
        let alarms: Vec<_> = alarms.take_while(|alarm| room.takes(alarm)).collect();
        let mut answer = AlarmsResult {
            total: total as u64,
            process_total: process.count_standing() as u64,
            newest_event: process.newest_event(),
            lost_events: process.lost(),
            ..AlarmsResult::default()
        };
        // Process alarms go on where these end.
        if offset.saturating_add(alarms.len()) >= total {
            let standing = process.standing(offset.saturating_sub(total));
            let standing = standing.take(limit - alarms.len());
            answer.process = standing.take_while(|alarm| room.takes(alarm)).collect();
        }
        if let Some(since) = params.since {
            let events = process.events_since(since).take(limit);
            answer.events = events.take_while(|event| room.takes(*event)).cloned().collect();
        }
        Ok(Begun::Ended(AlarmsResult { alarms, ..answer }))
    }
}
