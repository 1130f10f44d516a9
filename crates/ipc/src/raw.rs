//! iceoryx2's own ports on services like those of this crate, to compare its ports with.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy};

use crate::publisher::{MAX_LOANED, frame_pool};
use crate::service::{self, Quality};
use crate::{FrameHeader, OpenError, Participant, Service, space};

/// Opens iceoryx2's publisher of `service`, for frames of `channels` values, with the settings that a
/// [`FramePublisher`](crate::FramePublisher) has. Nobody checks who else is on the service.
///
/// # Errors
/// The name or the existing service does not fit, or shared memory is full.
pub fn raw_publisher<S: Service>(
    participant: &Participant<S>,
    service: &str,
    channels: usize,
) -> Result<Publisher<S, [f64], FrameHeader>, OpenError> {
    let opened = service::open_or_create(participant, service, Quality::of_frames(channels))?;
    let pool = frame_pool(&opened, channels);
    space::require(pool.bytes).map_err(|shortage| shortage.of_service(service))?;
    opened
        .publisher_builder()
        .max_loaned_samples(MAX_LOANED)
        .initial_max_slice_len(channels)
        .override_sample_preallocation(move |_| pool.messages)
        .allocation_strategy(AllocationStrategy::Static)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .create()
        .map_err(|cause| service::failed(participant, service, cause))
}

/// Opens iceoryx2's subscriber of `service` with the settings that a
/// [`FrameSubscriber`](crate::FrameSubscriber) has which reads every frame of `channels` values.
///
/// # Errors
/// The name or the existing service does not fit.
pub fn raw_subscriber<S: Service>(
    participant: &Participant<S>,
    service: &str,
    channels: usize,
) -> Result<Subscriber<S, [f64], FrameHeader>, OpenError> {
    let opened = service::open_or_create(participant, service, Quality::of_frames(channels))?;
    let created = opened.subscriber_builder().history_request(0).create();
    created.map_err(|cause| service::failed(participant, service, cause))
}
