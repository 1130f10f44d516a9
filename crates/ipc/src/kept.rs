//! Services that exist before there is a writer or a reader.

use iceoryx2::service::port_factory::PortFactory as _;

use crate::service::{self, FrameService, LayoutService, Quality};
use crate::{OpenError, Participant, Service};

/// How many frames the link lets wait before it drops any.
const LINK_FRAMES: usize = 64;

/// Keeps a service of frames and the service of their layouts in existence, with the usual buffers and without a
/// port.
///
/// A link between machines finds them when it starts. Those that it creates itself have iceoryx2's default
/// buffer of two frames, and lose whatever arrives in a burst.
#[derive(Debug)]
pub struct KeptService<S: Service> {
    frames: FrameService<S>,
    _layouts: LayoutService<S>,
}

impl<S: Service> KeptService<S> {
    /// Opens the services of `service` as they are, and creates those that are missing.
    ///
    /// # Errors
    /// The name is not possible, or a service exists that carries something else or has no place left.
    pub fn open(participant: &Participant<S>, service: &str) -> Result<Self, OpenError> {
        let frames = service::open_or_create(participant, service, quality())?;
        let layouts = service::open_or_create_layouts(participant, service)?;
        Ok(Self { frames, _layouts: layouts })
    }

    /// The process id of another participant that has the service open under the name of `participant`, which
    /// has opened this one.
    ///
    /// # Errors
    /// The domain cannot be locked, or its nodes cannot be listed.
    pub fn other_of_name(&self, participant: &Participant<S>) -> Result<Option<u32>, OpenError> {
        let service = self.frames.name().as_str();
        let _held = participant.lock(service)?;
        let own = *participant.node().id();
        service::holders::other_of_name(&*self.frames, own, participant.name())
            .map_err(|cause| service::failed(participant, service, cause))
    }

    /// Where a service that another program created has less room than a link needs for the frames that it receives
    /// at once.
    pub fn shortfall(&self) -> Option<String> {
        Quality::of_burst(LINK_FRAMES).shortfall(&self.frames)
    }
}

/// The number of channels is not known before there is a writer: few are assumed.
fn quality() -> Quality {
    Quality::of_frames(1)
}
