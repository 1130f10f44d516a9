//! The participant that opens the ports of real-time threads.

use crate::{
    Depth, ForRealTime, FrameLayout, FramePublisher, FrameSubscriber, JoinError, OpenError,
    Participant, Service,
};

/// A participant whose ports belong to real-time threads: they never wait while connecting.
///
/// If a peer is still being created, or was killed while it was, the connection fails at once instead
/// of after the creation timeout. [`tend`](Self::tend), called by an ordinary thread, retries the
/// failed connections of all ports opened here. Create one with [`Participant::for_real_time`].
#[derive(Debug)]
pub struct RealTime<S: Service> {
    participant: Participant<S>,
}

impl<S: Service> RealTime<S> {
    /// Opens a service for writing, as [`FramePublisher::open`] does.
    ///
    /// # Errors
    /// As `FramePublisher::open`.
    pub fn publisher(
        &self,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<ForRealTime<FramePublisher<S>>, OpenError> {
        FramePublisher::open(&self.participant, service, layout).map(FramePublisher::for_real_time)
    }

    /// The same, as [`FramePublisher::open_for_readers`] does.
    ///
    /// # Errors
    /// As `FramePublisher::open`.
    pub fn publisher_for_readers(
        &self,
        service: &str,
        layout: &FrameLayout,
        readers: usize,
    ) -> Result<ForRealTime<FramePublisher<S>>, OpenError> {
        FramePublisher::open_for_readers(&self.participant, service, layout, readers)
            .map(FramePublisher::for_real_time)
    }

    /// Opens a service for writing, as [`FramePublisher::take_over`] does.
    ///
    /// # Errors
    /// As `FramePublisher::take_over`.
    pub fn take_over(
        &self,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<ForRealTime<FramePublisher<S>>, OpenError> {
        FramePublisher::take_over(&self.participant, service, layout)
            .map(FramePublisher::for_real_time)
    }

    /// Opens a service for reading, as [`FrameSubscriber::open`] does.
    ///
    /// # Errors
    /// As `FrameSubscriber::open`.
    pub fn subscriber(
        &self,
        service: &str,
        channels: usize,
        depth: Depth,
    ) -> Result<ForRealTime<FrameSubscriber<S>>, OpenError> {
        FrameSubscriber::open(&self.participant, service, channels, depth)
            .map(FrameSubscriber::for_real_time)
    }

    /// Opens a service of frames that a twin sends the other: without a layout that is announced, but with this number
    /// in its place.
    ///
    /// # Errors
    /// As `FramePublisher::open`.
    pub fn twin_publisher(
        &self,
        service: &str,
        channels: usize,
        number: u64,
    ) -> Result<ForRealTime<FramePublisher<S>>, OpenError> {
        let publisher =
            FramePublisher::open_between_twins(&self.participant, service, channels, number)?;
        Ok(publisher.for_real_time())
    }

    /// Retries failed connections, as [`Participant::tend`] does.
    pub fn tend(&self) {
        self.participant.tend();
    }

    /// The participant itself, to open ports of ordinary threads.
    pub fn ordinary(&self) -> &Participant<S> {
        &self.participant
    }
}

impl<S: Service> Participant<S> {
    /// Joins the domain again under the same name, for ports in real-time threads.
    ///
    /// # Errors
    /// As [`join`](Participant::join).
    pub fn for_real_time(self) -> Result<RealTime<S>, JoinError> {
        // This one leaves when the other is there, so that what it has made stays.
        self.rejoin_without_waiting().map(|participant| RealTime { participant })
    }
}
