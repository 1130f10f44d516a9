//! Ports for real-time threads.

use std::sync::{Mutex, PoisonError};

use crate::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, JoinError, OpenError, Participant, Repair,
    Service,
};

/// A participant whose ports belong to real-time threads: they never wait while connecting.
///
/// If a peer is still being created, or was killed while it was, the connection fails at once instead
/// of after the creation timeout. [`tend`](Self::tend), called by an ordinary thread, retries the
/// failed connections of all ports opened here. Create one with [`Participant::for_real_time`].
///
/// A real-time thread also needs [`give_up_file_override`](crate::give_up_file_override).
#[derive(Debug)]
pub struct RealTime<S: Service> {
    participant: Participant<S>,
    repairs: Mutex<Vec<Repair>>,
}

impl<S: Service> RealTime<S> {
    pub(crate) fn new(participant: Participant<S>) -> Self {
        Self { participant, repairs: Mutex::default() }
    }

    /// Opens a service for writing, as [`FramePublisher::open`] does.
    ///
    /// # Errors
    /// As `FramePublisher::open`.
    pub fn publisher(
        &self,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<FramePublisher<S>, OpenError> {
        let publisher = FramePublisher::open(&self.participant, service, layout)?;
        self.adopt(publisher.repair());
        Ok(publisher)
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
    ) -> Result<FrameSubscriber<S>, OpenError> {
        let subscriber = FrameSubscriber::open(&self.participant, service, channels, depth)?;
        self.adopt(subscriber.repair());
        Ok(subscriber)
    }

    /// Retries the failed connections of all ports that were opened here and still exist.
    ///
    /// Call it in an ordinary thread, about 50 times a second; [`Repair::tend`] states its cost.
    pub fn tend(&self) {
        // No thread of a cycle takes this lock: ports are opened before the first one.
        let mut repairs = self.repairs.lock().unwrap_or_else(PoisonError::into_inner);
        repairs.retain(Repair::has_port);
        for repair in repairs.iter_mut() {
            repair.tend(&self.participant);
        }
    }

    /// The participant itself, to open ports of ordinary threads: announcers and watchers.
    pub fn ordinary(&self) -> &Participant<S> {
        &self.participant
    }

    fn adopt(&self, repair: Repair) {
        self.repairs.lock().unwrap_or_else(PoisonError::into_inner).push(repair);
    }
}

impl<S: Service> Participant<S> {
    /// Joins the domain again under the same name, for ports in real-time threads.
    ///
    /// # Errors
    /// As [`join`](Self::join).
    pub fn for_real_time(self) -> Result<RealTime<S>, JoinError> {
        // This one leaves when the other is there, so that what it has made stays.
        self.rejoin_without_waiting().map(RealTime::new)
    }
}
