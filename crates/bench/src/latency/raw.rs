//! Bare iceoryx2 calls: what the ports are compared with. Service, header and the loan beforehand are
//! the same.

use isochrone_ipc::yardstick::{RawPublisher, RawSubscriber};
use isochrone_ipc::{FrameHeader, ipc};

use super::arms::Arm;
use super::end::{End, EndError, Opening, Place, Way};
use super::message::{Header, Message};

pub(super) fn open(place: &Place<'_>) -> Result<Opening, EndError> {
    let (participant, values) = (place.participant.ordinary(), place.values);
    let name = |way| place.name(Arm::Raw, way);
    let mut publisher = RawPublisher::open(participant, &name(Way::Out), values)?;
    let mut subscriber = RawSubscriber::open(participant, &name(Way::In), values)?;
    Ok(Box::new(move || {
        publisher.connect();
        subscriber.connect();
        Ok(Box::new(Raw { publisher, subscriber }) as Box<dyn End>)
    }))
}

struct Raw {
    publisher: RawPublisher<ipc::Service>,
    subscriber: RawSubscriber<ipc::Service>,
}

impl End for Raw {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        let frame = FrameHeader {
            cycle: header.sequence,
            release_ns: header.sent_ns,
            ..FrameHeader::default()
        };
        if self.publisher.send(frame, |values| values.fill(header.value())) {
            Ok(())
        } else {
            Err(EndError::Refused)
        }
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(self.subscriber.receive(|frame, values| {
            Message::read(Header { sequence: frame.cycle, sent_ns: frame.release_ns }, values)
        }))
    }

    fn prepare(&mut self) {
        // Without a sample the next `send` fails, and says so.
        self.publisher.loan();
    }
}
