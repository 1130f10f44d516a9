//! Who writes a service here.

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::frames::following::Writer;
use crate::{FrameHeader, Service};

/// The port name by which frame publishers of this crate know each other.
pub const PUBLISHER_PORT_NAME: &str = "isochrone";
/// The port name of the publishers of two processes that stand in for each other: both are one writer.
pub const TWIN_PORT_NAME: &str = "isochrone-redundant";

/// Replaces `writers` by those that are there, and returns whether one of them may turn out to be a link: that
/// opens its other end last. iceoryx2 allocates for this.
pub(crate) fn list<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    writers: &mut Vec<Writer>,
) -> bool {
    writers.clear();
    let mut may_be_link = false;
    each(opened, |writer| {
        may_be_link |= !writer.is_ours && writer.link.is_none();
        let ServicePublisher { id, link, is_twin, .. } = writer;
        writers.push(Writer { id, is_far: link.is_some(), is_twin });
    });
    may_be_link
}

/// The node that keeps a publisher of ours from being the only writer, other than `own`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rival {
    /// It has another publisher of ours.
    Ours(UniqueNodeId),
    /// It has a publisher of another make, which is no link.
    Plain(UniqueNodeId),
}

/// Who writes the service beside `own`, one of ours first. `is_own_twin` says whether a node is the other one of two
/// that stand in for each other, if this is such a one.
pub(crate) fn rival<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    own: Option<u128>,
    is_own_twin: impl Fn(UniqueNodeId) -> bool,
) -> Option<Rival> {
    let mut rival = None;
    each(opened, |writer| match rival {
        _ if Some(writer.id) == own || writer.link.is_some() => {}
        _ if writer.is_twin && is_own_twin(writer.node) => {}
        _ if writer.is_ours => rival = Some(Rival::Ours(writer.node)),
        None => rival = Some(Rival::Plain(writer.node)),
        Some(_) => {}
    });
    rival
}

/// A publisher of a service.
pub(crate) struct ServicePublisher {
    pub(crate) id: u128,
    node: UniqueNodeId,
    is_ours: bool,
    /// Whether it is one of two that count as one.
    is_twin: bool,
    /// The node, if it is a link.
    pub(crate) link: Option<UniqueNodeId>,
}

/// A link has both ends of the service in one node. Nodes of ours have too, where they read what they write,
/// and are known by the name of their publishers.
pub(crate) fn each<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    mut note: impl FnMut(ServicePublisher),
) {
    opened.dynamic_config().list_publishers(|publisher| {
        let name = publisher.publisher_name.as_str();
        let is_twin = name == TWIN_PORT_NAME;
        let is_ours = is_twin || name == PUBLISHER_PORT_NAME;
        let mut has_both = false;
        if !is_ours {
            opened.dynamic_config().list_subscribers(|subscriber| {
                has_both |= subscriber.node_id == publisher.node_id;
                CallbackProgression::Continue
            });
        }
        let link = has_both.then_some(publisher.node_id);
        note(ServicePublisher {
            id: publisher.publisher_id.value(),
            node: publisher.node_id,
            is_ours,
            is_twin,
            link,
        });
        CallbackProgression::Continue
    });
}
