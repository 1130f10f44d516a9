//! Each signal of a service as a `Float64` on a topic of its own.

use std::sync::Arc;

use isochrone_ipc::{LayoutKey, Service, SignalFrame};
use isochrone_model::Flags;
use isochrone_recording::field_names;
use isochrone_recording::message::{MessageType, RosValue, encode};

use super::counts::{Count, LinkCounts};
use super::outlet::Outlet;
use crate::config::{OnBad, ToRos};
use crate::dds::Dds;

/// Most signals of a service that get a topic.
const MOST_SIGNALS: usize = 256;

/// Sends each signal on a topic of its own.
pub(super) struct EachSignal<'d> {
    dds: &'d Dds,
    link: ToRos,
    float: Arc<MessageType>,
    layout: Option<LayoutKey>,
    outlets: Vec<Outlet<'d>>,
    good: Option<Vec<f64>>,
}

impl<'d> EachSignal<'d> {
    pub(super) fn new(dds: &'d Dds, link: &ToRos, float: Arc<MessageType>) -> Self {
        let (layout, outlets, good) = (None, Vec::new(), None);
        Self { dds, link: link.clone(), float, layout, outlets, good }
    }

    /// Opens the topics of a layout.
    fn open<S: Service>(&mut self, frame: &SignalFrame<'_, S>, counts: &LinkCounts) {
        self.layout = Some(frame.layout());
        self.outlets.clear();
        self.good = None;
        let Some(announced) = frame.announced() else {
            let why = "its publisher announces no names; name type, fields and channels of another service";
            return tracing::warn!("{}: nothing is sent: {why}", counts.name);
        };
        let signals = &announced.layout.signals;
        if signals.len() > MOST_SIGNALS {
            let (all, first) = (signals.len(), MOST_SIGNALS);
            tracing::warn!("{}: the first {first} of {all} signals get topics", counts.name);
        }
        for name in field_names(signals).iter().take(MOST_SIGNALS) {
            let topic = format!("{}/{}", self.link.topic, name.replace('.', "/"));
            let quality = self.link.quality_of_service;
            match Outlet::open(self.dds, &topic, self.float.dds_name(), quality) {
                Ok(outlet) => {
                    tracing::info!("{}: sends {topic}", counts.name);
                    self.outlets.push(outlet);
                }
                Err(_) => return tracing::error!("{}: cannot write {topic}", counts.name),
            }
        }
    }

    /// Sends a frame.
    pub(super) fn take<S: Service>(&mut self, frame: &SignalFrame<'_, S>, counts: &LinkCounts) {
        if self.layout != Some(frame.layout()) {
            self.open(frame, counts);
        }
        let is_bad = !frame.flags().without(Flags::FORCED).is_empty();
        let values = match (is_bad, self.link.on_bad) {
            (true, OnBad::Stop) => None,
            (true, OnBad::Hold) => self.good.as_deref(),
            _ => Some(frame.channels()),
        };
        let Some(values) = values else {
            counts.add(Count::Bad, 1);
            return;
        };
        for (outlet, value) in self.outlets.iter_mut().zip(values) {
            if value.is_nan() {
                counts.add(Count::NotANumber, 1);
                continue;
            }
            let message = RosValue::Message(vec![RosValue::Number(*value)]);
            let is_sent = encode(&self.float, &message).is_ok_and(|body| outlet.send(body));
            counts.add(if is_sent { Count::Sent } else { Count::Unsent }, 1);
        }
        if !is_bad {
            self.good = Some(frame.channels().to_vec());
        }
    }
}
