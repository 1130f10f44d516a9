//! This product's ports.

use isochrone_ipc::{
    Depth, ForRealTime, FrameLayout, FramePublisher, FrameSubscriber, SignalSpec, Stamp, ipc,
};

use super::arms::Arm;
use super::end::{End, EndError, Opening, Place, Way};
use super::message::{Header, Message};
use isochrone_cyclic::{Clock, Monotonic};

pub(super) fn open(place: &Place<'_>) -> Result<ForRealTime<Opening>, EndError> {
    let (participant, layout) = (place.participant, layout(place.values));
    let name = |way| place.name(Arm::Ports, way);
    let publisher = participant.publisher(&name(Way::Out), &layout)?;
    let subscriber = participant.subscriber(&name(Way::In), place.values, Depth::All)?;
    Ok(publisher.and(subscriber).map(|(publisher, subscriber)| {
        let mut ports = Ports { publisher: publisher.plain(), subscriber, now_ns: 0 };
        Box::new(move || {
            ports.prepare();
            ports.subscriber.maintain();
            Ok(Box::new(ports) as Box<dyn End>)
        }) as Opening
    }))
}

/// Frames of so many values.
pub(super) fn layout(values: usize) -> FrameLayout {
    let signal = |channel| SignalSpec::new(format!("v{channel}"), "");
    FrameLayout { signals: (0..values).map(signal).collect(), period_ns: None }
}

struct Ports {
    publisher: FramePublisher<ipc::Service>,
    subscriber: FrameSubscriber<ipc::Service>,
    /// A cycle has read the clock before it reads its inputs; so has an end that answers.
    now_ns: u64,
}

impl End for Ports {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        self.now_ns = header.sent_ns;
        publish(&mut self.publisher, header, header.value())
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(self.subscriber.next(self.now_ns).map(|frame| {
            let header = frame.header();
            let header = Header { sequence: header.cycle, sent_ns: header.release_ns };
            Message::read(header, frame.values())
        }))
    }

    fn prepare(&mut self) {
        self.publisher.prepare();
    }
}

/// Writes a value everywhere into the prepared frame, and sends it. Its own sequence goes on over all turns, so the message's
/// stands in place of the cycle; and as `publish_ns` is read after the values were written, the
/// message's time stands in place of the release.
pub(super) fn publish(
    publisher: &mut FramePublisher<ipc::Service>,
    header: Header,
    value: f64,
) -> Result<(), EndError> {
    if let Some(values) = publisher.values_mut() {
        values.fill(value);
    }
    let stamp = Stamp { cycle: header.sequence, release_ns: header.sent_ns, ..Stamp::default() };
    if publisher.send(stamp, || Monotonic.now_ns()) { Ok(()) } else { Err(EndError::Refused) }
}
