//! `alarms`: the active alarms.

use isochrone_control::{AlarmsParams, AlarmsResult, Begun, Caller, Handle, Refusal};

use super::ControlServer;
use super::pages::{fitting, page};

impl Handle<AlarmsParams> for ControlServer {
    fn handle(&mut self, params: AlarmsParams, _: Caller) -> Result<Begun<AlarmsResult>, Refusal> {
        let operating = self.shared.lock();
        let (offset, limit) = page(params.offset, params.limit);
        let alarms = fitting(operating.active_alarms().skip(offset).take(limit));
        Ok(Begun::Ended(AlarmsResult { total: operating.count_alarms() as u64, alarms }))
    }
}
