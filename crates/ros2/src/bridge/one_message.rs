//! The frames of a service as messages of one topic.

use isochrone_ipc::{Service, SignalFrame};
use isochrone_model::Flags;

use super::counts::{Count, LinkCounts};
use super::outlet::Outlet;
use crate::config::{OnBad, ToRos};
use crate::dds::Dds;
use crate::failure::Failure;
use crate::mapping::Outgoing;

/// Sends frames as messages of one topic.
pub(super) struct OneMessage<'d> {
    outgoing: Outgoing,
    on_bad: OnBad,
    outlet: Outlet<'d>,
    /// The values of the last good frame, and its Unix time.
    good: Option<(Vec<f64>, u64)>,
    /// What was wrong with the last frame, so that it is said once.
    wrong: Option<String>,
}

impl<'d> OneMessage<'d> {
    pub(super) fn open(dds: &'d Dds, link: &ToRos, outgoing: &Outgoing) -> Result<Self, Failure> {
        let type_name = outgoing.message.dds_name();
        let outlet = Outlet::open(dds, &link.topic, type_name, link.quality_of_service)?;
        let (outgoing, on_bad) = (outgoing.clone(), link.on_bad);
        Ok(Self { outgoing, on_bad, outlet, good: None, wrong: None })
    }

    /// Sends a frame of this Unix time.
    pub(super) fn take<S: Service>(
        &mut self,
        frame: &SignalFrame<'_, S>,
        unix_ns: u64,
        counts: &LinkCounts,
    ) {
        let is_bad = !frame.flags().without(Flags::FORCED).is_empty();
        let now = match (is_bad, self.on_bad) {
            (true, OnBad::Stop) => None,
            (true, OnBad::Hold) => self.good.clone(),
            _ => match frame.values() {
                Ok(values) => Some((values.map(|(_, value)| value).collect::<Vec<_>>(), unix_ns)),
                Err(error) => return self.misfit(&error.to_string(), counts),
            },
        };
        let Some((values, unix_ns)) = now else {
            counts.add(Count::Bad, 1);
            return;
        };
        if values.iter().any(|value| value.is_nan()) {
            counts.add(Count::NotANumber, 1);
            return;
        }
        match self.outgoing.encode(&values, unix_ns) {
            Ok(body) => {
                self.wrong = None;
                let sent = if self.outlet.send(body) { Count::Sent } else { Count::Unsent };
                counts.add(sent, 1);
            }
            Err(error) => return self.misfit(&error.to_string(), counts),
        }
        if !is_bad {
            self.good = Some((values, unix_ns));
        }
    }

    fn misfit(&mut self, why: &str, counts: &LinkCounts) {
        counts.add(Count::Misfit, 1);
        if self.wrong.as_deref() != Some(why) {
            tracing::warn!("{}: a frame is not sent: {why}", counts.name);
            self.wrong = Some(why.to_owned());
        }
    }
}
