//! `get`: values of signals.

use isochrone_control::desk::Selection;
use isochrone_control::{Begun, Caller, GetParams, GetResult, Handle, Refusal};

use super::ControlServer;
use super::requests::{MAX_VALUES, unsent};
use super::under_way::{Read, Work};

impl Handle<GetParams> for ControlServer {
    fn handle(&mut self, params: GetParams, _: Caller) -> Result<Begun<GetResult>, Refusal> {
        self.check_names("names", &params.names)?;
        let offset = params.offset.unwrap_or_default().try_into().unwrap_or(usize::MAX);
        let limit = params.limit.unwrap_or(MAX_VALUES as u64).min(MAX_VALUES as u64) as usize;
        let names = || params.names.iter().map(String::as_str);
        let (mut operating, selection) = self
            .shared
            .search(|signals| Ok(Selection::of(signals, names(), offset, limit)?.with_quality()))?;
        let total = selection.total();
        let is_asked = params.types.unwrap_or_default();
        let types = is_asked.then(|| selection.signals().map(|signal| signal.value_type).collect());
        let mut prepared = operating.operator.read(selection);
        let order = std::mem::take(&mut prepared.read_from);
        let missing = prepared.tasks().count();
        let number = operating.send(prepared).map_err(unsent)?.number;
        let read = Read {
            names: operating.lanes.iter().map(|lane| lane.name.clone()).collect(),
            grids: operating.grids(),
            total: total as u64,
            order,
            types,
            readings: Vec::new(),
        };
        drop(operating);
        Ok(self.begun(number, missing, Work::Read(read)))
    }
}
