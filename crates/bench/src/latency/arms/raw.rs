//! Bare iceoryx2 calls: what the ports are compared with. Service, header and the loan beforehand are
//! the same; nothing here checks who else is on the service, counts what went wrong, or makes good a failed
//! connection.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample_mut::SampleMut;
use isochrone_ipc::{ForRealTime, FrameHeader, ipc, raw_publisher, raw_subscriber};

use crate::latency::arm::Transport;
use crate::latency::end::{End, EndError, Opening, Rendezvous, Way, without_ports};
use crate::latency::message::{Header, Message};

pub(super) struct Raw;

impl Transport for Raw {
    fn name(&self) -> &'static str {
        "raw"
    }

    fn help(&self) -> &'static str {
        "Raw iceoryx2 calls"
    }

    fn open(&self, place: &Rendezvous<'_>) -> Result<ForRealTime<Opening>, EndError> {
        let (participant, values) = (place.participant.ordinary(), place.values);
        let name = |way| place.name(self.name(), way);
        let publisher = raw_publisher(participant, &name(Way::Out), values)?;
        let subscriber = raw_subscriber(participant, &name(Way::In), values)?;
        let mut calls = Calls { loaned: None, publisher, subscriber, values };
        calls.prepare();
        Ok(without_ports(Box::new(move || {
            // A connection that fails is tried again with the next peer that joins.
            let _ = calls.publisher.update_connections();
            let _ = calls.subscriber.update_connections();
            Ok(Box::new(calls) as Box<dyn End>)
        })))
    }
}

struct Calls {
    // Dropped before its port.
    loaned: Option<SampleMut<ipc::Service, [f64], FrameHeader>>,
    publisher: Publisher<ipc::Service, [f64], FrameHeader>,
    subscriber: Subscriber<ipc::Service, [f64], FrameHeader>,
    values: usize,
}

impl End for Calls {
    fn send(&mut self, header: Header) -> Result<(), EndError> {
        let Some(mut sample) = self.loaned.take() else { return Err(EndError::Refused) };
        *sample.user_header_mut() = FrameHeader {
            cycle: header.sequence,
            release_ns: header.sent_ns,
            ..FrameHeader::default()
        };
        sample.payload_mut().fill(header.value());
        sample.send().map(drop).map_err(|_| EndError::Refused)
    }

    fn receive(&mut self) -> Result<Option<Message>, EndError> {
        Ok(self.subscriber.receive().ok().flatten().map(|sample| {
            let frame = sample.user_header();
            let header = Header { sequence: frame.cycle, sent_ns: frame.release_ns };
            Message::read(header, sample.payload())
        }))
    }

    fn prepare(&mut self) {
        // Without a sample the next `send` fails, and says so.
        if self.loaned.is_none() {
            self.loaned = self.publisher.loan_slice(self.values).ok();
        }
    }
}
