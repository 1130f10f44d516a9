//! Each signal of a service as a `Float64` on a topic of its own.

use std::sync::Arc;

use isochrone_ipc::{LayoutKey, Service, SignalFrame};
use isochrone_model::Flags;
use isochrone_recording::field_names;
use isochrone_recording::message::{MessageType, RosValue, encode};

use super::counts::{Count, LinkCounts};
use super::outlet::{Outlet, kept_back};
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
            return counts.dropped(Count::Bad, 1, || kept_back(frame.flags(), self.link.on_bad));
        };
        for (index, (outlet, value)) in self.outlets.iter_mut().zip(values).enumerate() {
            if value.is_nan() {
                let announced = frame.announced().and_then(|it| it.layout.signals.get(index));
                let signal = announced.map_or("", |signal| &*signal.name);
                let topic = outlet.topic();
                let what = || format!("a value is not sent on {topic}: the signal {signal} is NaN");
                counts.dropped(Count::NotANumber, 1, what);
                continue;
            }
            let message = RosValue::Message(vec![RosValue::Number(*value)]);
            let body = encode(&self.float, &message).map_err(|error| error.to_string());
            match body.and_then(|body| outlet.send(body)) {
                Ok(()) => drop(counts.add(Count::Sent, 1)),
                Err(why) => {
                    let what = || format!("a value is not sent on {}: {why}", outlet.topic());
                    counts.dropped(Count::Unsent, 1, what);
                }
            }
        }
        if !is_bad {
            self.good = Some(frame.channels().to_vec());
        }
    }
}
