//! The nodes and services in a domain.

use iceoryx2::node::{Node, NodeState, NodeView};
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::static_config::StaticConfig;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};
use iceoryx2::service::static_config::messaging_pattern::MessagingPattern;

use crate::error::EVERYTHING;
use crate::exhausted;
use crate::frames::service;
use crate::requests::process_of;
use crate::{FrameHeader, ListedNode, OpenError, Participant, Service, give_up_file_override};

/// A service that carries frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedService {
    /// Its name.
    pub name: String,
    /// Nodes that publish on it.
    pub publishers: Vec<ListedNode>,
    /// Nodes that subscribe to it.
    pub subscribers: Vec<ListedNode>,
}

impl<S: Service> Participant<S> {
    /// The other live nodes in the domain, sorted by name.
    ///
    /// Touches many files and waits for the domain's lock; never call it in a cycle.
    ///
    /// # Errors
    /// The domain cannot be locked or read.
    pub fn nodes(&self) -> Result<Vec<ListedNode>, OpenError> {
        let mut nodes: Vec<ListedNode> = self
            .living()?
            .into_iter()
            .filter(|(id, _)| *id != self.node().id().value())
            .map(|(_, node)| node)
            .collect();
        nodes.sort_by(|a, b| (&a.name, a.pid).cmp(&(&b.name, b.pid)));
        Ok(nodes)
    }

    /// The names of the services that carry frames of this version.
    ///
    /// Touches many files and waits for the domain's lock; never call it in a cycle.
    ///
    /// # Errors
    /// The domain cannot be locked or read.
    pub fn frame_service_names(&self) -> Result<Vec<String>, OpenError> {
        let mut names = Vec::new();
        let _held = self.lock(EVERYTHING)?;
        // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
        let _given_up = give_up_file_override();
        let listed = S::list(self.node().config(), |details| {
            if carries_frames(&details.static_details) {
                names.push(details.static_details.name().to_string());
            }
            CallbackProgression::Continue
        });
        listed.map_err(|cause| service::failed(self, EVERYTHING, cause))?;
        names.sort();
        Ok(names)
    }

    /// The services that carry frames, with their publishers and subscribers. A service that ends
    /// during the call, or that this participant may not open, is left out.
    ///
    /// Briefly opens each service, but no port, so its publishers and subscribers are not disturbed.
    /// Waits for the domain's lock; never call it in a cycle.
    ///
    /// # Errors
    /// The domain cannot be locked or read, or this process has too few descriptors or too little memory to open the
    /// services.
    pub fn frame_services(&self) -> Result<Vec<ListedService>, OpenError> {
        let names = self.frame_service_names()?;
        let living = self.living()?;
        let node = |wanted: u128| {
            living.iter().find(|(id, _)| *id == wanted).map(|(_, node)| node.clone())
        };
        let listed = names.into_iter().filter_map(|name| {
            let opened = match service::open_existing(self, &name) {
                Ok(opened) => opened?,
                // The next one could not be opened either, and a list without them would be wrong.
                Err(error) if exhausted::limit().is_some() => return Some(Err(error)),
                Err(_) => return None,
            };
            let (mut publishers, mut subscribers) = (Vec::new(), Vec::new());
            opened.dynamic_config().list_publishers(|port| {
                publishers.extend(node(port.node_id.value()));
                CallbackProgression::Continue
            });
            opened.dynamic_config().list_subscribers(|port| {
                subscribers.extend(node(port.node_id.value()));
                CallbackProgression::Continue
            });
            Some(Ok(ListedService { name, publishers, subscribers }))
        });
        listed.collect()
    }

    /// The processes that publish frames on a service, as far as iceoryx2 knows them; none if there is no such
    /// service.
    ///
    /// Briefly opens the service, but no port, and may wait for the domain's lock; never call it in a cycle.
    ///
    /// # Errors
    /// The service cannot be opened.
    pub fn publishing_processes(&self, service: &str) -> Result<Vec<u32>, OpenError> {
        let Some(opened) = service::open_existing(self, service)? else { return Ok(Vec::new()) };
        let mut processes = Vec::new();
        opened.dynamic_config().list_publishers(|port| {
            processes.extend(process_of::<S>(port.node_id));
            CallbackProgression::Continue
        });
        Ok(processes)
    }

    /// The nodes of a service's publishers, as far as iceoryx2 knows them; `None` if another process is starting or
    /// ending, so that they cannot be determined yet.
    ///
    /// Briefly opens the service, but no port. For ordinary threads of running processes: never waits for others that
    /// start.
    pub fn publishers_at_once(&self, service: &str) -> Option<Vec<ListedNode>> {
        let opened = match service::open_existing_at_once(self, service) {
            Ok(Some(opened)) => opened,
            Err(OpenError::Locked { .. }) => return None,
            Ok(None) | Err(_) => return Some(Vec::new()),
        };
        let mut owners = Vec::new();
        opened.dynamic_config().list_publishers(|port| {
            owners.push(port.node_id);
            CallbackProgression::Continue
        });
        let _given_up = give_up_file_override();
        let details = |owner| service::holders::details(&*opened, owner);
        Some(owners.into_iter().filter_map(details).collect())
    }

    /// The living nodes, each with its identity.
    fn living(&self) -> Result<Vec<(u128, ListedNode)>, OpenError> {
        let mut nodes = Vec::new();
        let _held = self.lock(EVERYTHING)?;
        let _given_up = give_up_file_override();
        let listed = Node::<S>::list(self.node().config(), |state| {
            if let NodeState::Alive(view) = &state
                && let Some(details) = view.details()
            {
                nodes.push((view.id().value(), ListedNode::of(details)));
            }
            CallbackProgression::Continue
        });
        listed.map_err(|cause| service::failed(self, EVERYTHING, cause))?;
        Ok(nodes)
    }
}

/// Whether a service is one of frames of this version.
fn carries_frames(config: &StaticConfig) -> bool {
    let MessagingPattern::PublishSubscribe(config) = config.messaging_pattern() else {
        return false;
    };
    let types = config.message_type_details();
    let is_same = |found: &TypeDetail, wanted: &TypeDetail| {
        found.type_name() == wanted.type_name()
            && found.size() == wanted.size()
            && found.variant() == wanted.variant()
    };
    is_same(&types.payload, &TypeDetail::new::<f64>(TypeVariant::Dynamic))
        && is_same(&types.user_header, &TypeDetail::new::<FrameHeader>(TypeVariant::FixedSize))
}
