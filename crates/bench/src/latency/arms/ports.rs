//! This product's ports.

use isochrone_ipc::{Depth, ForRealTime, FramePublisher, FrameSubscriber, ipc};

use crate::latency::arm::Transport;
use crate::latency::end::{End, EndError, Opening, Rendezvous, Way};
use crate::latency::frames::{layout, publish};
use crate::latency::message::{Header, Message};

pub(super) struct Ports;

impl Transport for Ports {
    fn name(&self) -> &'static str {
        "ports"
    }

    fn help(&self) -> &'static str {
        "isochrone's ports"
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let (participant, layout) = (place.participant, layout(place.values));
        let name = |way| place.name(self.name(), way);
        let publisher = participant.publisher(&name(Way::Out), &layout)?;
        let subscriber = participant.subscriber(&name(Way::In), place.values, Depth::All)?;
        Ok(publisher.and(subscriber).map(|(publisher, subscriber)| {
            let mut frames = Frames { publisher: publisher.plain(), subscriber, now_ns: 0 };
            Box::new(move || {
                frames.prepare();
                frames.subscriber.maintain();
                Ok(Box::new(frames) as Box<dyn End>)
            }) as Opening
        }))
    }
}

struct Frames {
    publisher: FramePublisher<ipc::Service>,
    subscriber: FrameSubscriber<ipc::Service>,
    /// A cycle has read the clock before it reads its inputs; so has an end that answers.
    now_ns: u64,
}

impl End for Frames {
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
