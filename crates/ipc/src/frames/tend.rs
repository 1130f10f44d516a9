//! Retrying failed connections.

use crate::frames::repair::Peer;
use crate::frames::service;
use crate::{OpenError, Participant, Service, give_up_file_override, space};

impl<S: Service> Participant<S> {
    /// Retries the failed connections of all ports that were opened on this participant.
    ///
    /// Call it in an ordinary thread, about 50 times a second. It loads two atomics per port as long as
    /// nothing fails, and otherwise takes some hundred microseconds for file operations. Without it, a
    /// failed connection waits for the next peer that joins or leaves. If connecting keeps failing for
    /// more than a second, one warning is logged.
    pub fn tend(&self) {
        self.repairs().tend(|service, peer| self.show_a_peer(service, peer));
    }

    /// Adds a peer to the list of a service and takes it away.
    fn show_a_peer(&self, name: &str, peer: Peer) -> Result<(), OpenError> {
        let Some(opened) = service::open_existing_at_once(self, name)? else {
            return Ok(());
        };
        // In full shared memory the attempt would kill the process that it is to help.
        space::require(0).map_err(|shortage| shortage.of_service(name))?;
        let failed = |cause: String| service::failed(self, name, cause);
        match peer {
            Peer::Publisher => {
                let port = {
                    let _given_up = give_up_file_override();
                    opened.publisher_builder().initial_max_slice_len(1).create()
                };
                port.map(drop).map_err(|cause| failed(cause.to_string()))
            }
            Peer::Subscriber => {
                let port = {
                    let _given_up = give_up_file_override();
                    opened.subscriber_builder().buffer_size(1).create()
                };
                port.map(drop).map_err(|cause| failed(cause.to_string()))
            }
        }
    }
}
