//! `forces`: the forces in place.

use isochrone_control::{Begun, Caller, ForcesParams, ForcesResult, Handle, Refusal};

use super::ControlServer;
use super::pages::{fitting, page};

impl Handle<ForcesParams> for ControlServer {
    fn handle(&mut self, params: ForcesParams, _: Caller) -> Result<Begun<ForcesResult>, Refusal> {
        let operating = self.shared.lock();
        let (offset, limit) = page(params.offset, params.limit);
        let in_place = || operating.operator.forces();
        let forces = fitting(in_place().skip(offset).take(limit));
        Ok(Begun::Ended(ForcesResult { total: in_place().count() as u64, forces }))
    }
}
