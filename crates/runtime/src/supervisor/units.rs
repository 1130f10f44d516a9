//! The units in which publishers announce what inputs read.

use isochrone_ipc::FrameLayout;

use crate::node::alarms::Alarm;
use crate::task::bindings::{Desk, Unfit};

/// The unit of an input's signal, as it is announced.
#[derive(Debug, Clone, Default)]
pub(super) struct AnnouncedUnit {
    /// The first one.
    first: Option<String>,
    /// The newest; empty: none is announced.
    now: String,
    is_news: bool,
}

impl AnnouncedUnit {
    /// Notes where an input is in frames of a layout; returns the alarm that its unit gives cause for.
    pub(super) fn note(
        &mut self,
        desk: &Desk,
        index: usize,
        place: &Result<usize, Unfit>,
        layout: &FrameLayout,
    ) -> Option<Alarm> {
        let wanted = desk.wanted.get(index)?;
        let announced = match place {
            Ok(channel) => layout.unit(*channel),
            Err(Unfit::Unit { announced, .. }) => announced,
            Err(Unfit::Layout(_)) => "",
        };
        if self.now != announced {
            announced.clone_into(&mut self.now);
            self.is_news = true;
        }
        // Samples without an announced unit are accepted.
        if announced.is_empty() {
            return None;
        }
        let first = self.first.get_or_insert_with(|| announced.to_owned());
        let is_declared = !wanted.unit.is_empty();
        let unit = if is_declared { &wanted.unit } else { first };
        (unit != announced).then(|| Alarm::Unit {
            input: desk.inputs.get(index).cloned().unwrap_or_default(),
            service: desk.service.clone(),
            unit: unit.clone(),
            announced: announced.to_owned(),
            is_declared,
        })
    }

    /// The newest, if it has changed since the last call.
    pub(super) fn news(&mut self) -> Option<String> {
        std::mem::take(&mut self.is_news).then(|| self.now.clone())
    }
}
