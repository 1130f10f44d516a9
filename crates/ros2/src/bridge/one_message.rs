//! The frames of a service as messages of one topic.

use isochrone_ipc::{Service, SignalFrame};
use isochrone_model::Flags;

use super::counts::{Count, LinkCounts};
use super::outlet::{Outlet, kept_back};
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
    /// What frames lacked last, so that it is said once.
    lacking: Option<String>,
}

impl<'d> OneMessage<'d> {
    pub(super) fn open(dds: &'d Dds, link: &ToRos, outgoing: &Outgoing) -> Result<Self, Failure> {
        let type_name = outgoing.message.dds_name();
        let outlet = Outlet::open(dds, &link.topic, type_name, link.quality_of_service)?;
        let (outgoing, on_bad) = (outgoing.clone(), link.on_bad);
        Ok(Self { outgoing, on_bad, outlet, good: None, lacking: None })
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
                Err(error) => return self.lacking(&error.to_string(), counts),
            },
        };
        let Some((values, unix_ns)) = now else {
            return counts.dropped(Count::Bad, 1, || kept_back(frame.flags(), self.on_bad));
        };
        if let Some(index) = values.iter().position(|value| value.is_nan()) {
            let signal = &self.outgoing.signals[index];
            let what = || format!("a frame is not sent: the signal {signal} is NaN");
            return counts.dropped(Count::NotANumber, 1, what);
        }
        match self.outgoing.encode(&values, unix_ns) {
            Ok(body) => match self.outlet.send(body) {
                Ok(()) => drop(counts.add(Count::Sent, 1)),
                Err(why) => {
                    counts.dropped(Count::Unsent, 1, || format!("a message is not sent: {why}"));
                }
            },
            Err(error) => {
                let what = || format!("a frame is not sent: {error}");
                return counts.dropped(Count::Misfit, 1, what);
            }
        }
        if !is_bad {
            self.good = Some((values, unix_ns));
        }
    }

    fn lacking(&mut self, why: &str, counts: &LinkCounts) {
        counts.add(Count::Misfit, 1);
        if self.lacking.as_deref() != Some(why) {
            tracing::warn!("{}: a frame is not sent: {why}", counts.name);
            self.lacking = Some(why.to_owned());
        }
    }
}
