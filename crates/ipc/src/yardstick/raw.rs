//! Bare iceoryx2 calls on services that are made as this crate makes them.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy};
use iceoryx2::sample_mut::SampleMut;

use crate::publisher::{MAX_LOANED, frames_bytes};
use crate::service::{self, Quality};
use crate::{FrameHeader, OpenError, Participant, Service, space};

/// iceoryx2's publisher, with the next sample loaned beforehand.
#[derive(Debug)]
pub struct RawPublisher<S: Service> {
    // Dropped before its port.
    loaned: Option<SampleMut<S, [f64], FrameHeader>>,
    port: Publisher<S, [f64], FrameHeader>,
    channels: usize,
}

impl<S: Service> RawPublisher<S> {
    /// Opens `service`, for frames of `channels` values, with the settings that a
    /// [`FramePublisher`](crate::FramePublisher) has.
    ///
    /// # Errors
    /// The name or the existing service does not fit, or shared memory is full.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        channels: usize,
    ) -> Result<Self, OpenError> {
        let opened = service::open_or_create(participant, service, Quality::of_frames(channels))?;
        space::require(frames_bytes(&opened, channels))
            .map_err(|shortage| shortage.of_service(service))?;
        let port = opened
            .publisher_builder()
            .max_loaned_samples(MAX_LOANED)
            .initial_max_slice_len(channels)
            .allocation_strategy(AllocationStrategy::Static)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| service::failed(participant, service, cause))?;
        let mut publisher = Self { loaned: None, port, channels };
        publisher.loan();
        Ok(publisher)
    }

    /// Connects to subscribers that joined, so that the next `send` need not.
    pub fn connect(&mut self) {
        // A connection that fails is tried again with the next peer that joins.
        let _ = self.port.update_connections();
    }

    /// Loans the next sample; `false` if iceoryx2 has none to give.
    pub fn loan(&mut self) -> bool {
        if self.loaned.is_none() {
            self.loaned = self.port.loan_slice(self.channels).ok();
        }
        self.loaned.is_some()
    }

    /// Has the loaned sample written, and sends it; `false` if there was none or it was refused.
    pub fn send(&mut self, header: FrameHeader, write: impl FnOnce(&mut [f64])) -> bool {
        let Some(mut sample) = self.loaned.take() else { return false };
        *sample.user_header_mut() = header;
        write(sample.payload_mut());
        sample.send().is_ok()
    }
}

/// iceoryx2's subscriber.
#[derive(Debug)]
pub struct RawSubscriber<S: Service> {
    port: Subscriber<S, [f64], FrameHeader>,
}

impl<S: Service> RawSubscriber<S> {
    /// Opens `service` with the settings that a [`FrameSubscriber`](crate::FrameSubscriber) has
    /// which reads every frame.
    ///
    /// # Errors
    /// The name or the existing service does not fit.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        channels: usize,
    ) -> Result<Self, OpenError> {
        let opened = service::open_or_create(participant, service, Quality::of_frames(channels))?;
        let created = opened.subscriber_builder().history_request(0).create();
        let port = created.map_err(|cause| service::failed(participant, service, cause))?;
        Ok(Self { port })
    }

    /// Connects to publishers that joined, so that the next `receive` need not.
    pub fn connect(&mut self) {
        // As with the publisher.
        let _ = self.port.update_connections();
    }

    /// Receives the next sample and reads it where it stands; `None` if none waits.
    pub fn receive<R>(&mut self, read: impl FnOnce(&FrameHeader, &[f64]) -> R) -> Option<R> {
        let sample = self.port.receive().ok().flatten()?;
        Some(read(sample.user_header(), sample.payload()))
    }
}
