//! Removing what dead processes left.
//!
//! iceoryx2 removes what a process leaves that was killed while running. If a process is killed while starting or
//! ending, iceoryx2 takes what it leaves for unfinished work, for ever: segments without size or permissions,
//! services without a readable description, without ports or marked for destruction, folders of nodes that are not
//! monitored.
//!
//! These remains can be distinguished from files in use without guessing: processes of this crate work on such files
//! under the domain's [lock](super::lock) only, and a port's tag exists in the folder of a living node for as long as
//! any of its segments does. Other programs do not know the lock; a file that they may be creating is given [some
//! time](super::segment) first.

use std::collections::HashSet;
use std::fs::{self, DirBuilder, File};
use std::os::unix::fs::DirBuilderExt as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::{DeadNodeView, Node, NodeState, NodeView};
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::service_hash::ServiceHash;
use iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;

use super::lock::LockGuard;
use super::segment::{self, Content, is_abandoned};
use super::services::names;
use super::{roots, services};
use crate::{Service, give_up_file_override};

/// Removes what dead processes left in a domain.
pub(crate) fn sweep<S: Service>(config: &Config, held: &LockGuard) {
    if !S::CROSSES_PROCESSES {
        return;
    }
    // Root can open a file that has no permissions yet, and iceoryx2 would then wait for it for ever.
    let _given_up = give_up_file_override();
    // Everything is listed before the living nodes are: a file that appears later is in use.
    let segments = segment::list(config);
    let traces = Traces::list(config);
    let Some(nodes) = Nodes::<S>::list(config) else { return };
    // If another root path has the same prefix, unknown segments may belong to it.
    let is_alone = roots::is_alone(config);
    let is_lost = |port: u128| !nodes.ports.contains(&port);
    for segment in segments.iter().filter(|segment| segment.is_half_made) {
        let is_dead = match segment.content {
            Content::Data(port) if is_alone => is_lost(port),
            Content::Connection(sender, receiver) if is_alone => {
                is_lost(sender) || is_lost(receiver)
            }
            // The service's file says more about the dynamic ones; it is looked at below.
            _ => segment.is_abandoned,
        };
        if is_dead {
            segment.remove();
        }
    }
    services::remove_locked(config);
    nodes.dead.iter().for_each(remove_node);
    traces.remove_unknown(config, &nodes, held);
    let services = services::remove_deserted::<S>(config);
    if !is_alone {
        return;
    }
    for segment in &segments {
        let is_dead = match segment.content {
            Content::Data(port) => is_lost(port),
            // While one end lives, iceoryx2 lets it notice the other's death by this segment.
            Content::Connection(sender, receiver) => is_lost(sender) && is_lost(receiver),
            Content::Dynamic(service) => services.as_ref().is_some_and(|s| !s.contains(&service)),
            Content::Other => false,
        };
        if is_dead {
            segment.remove();
        }
    }
}

/// The nodes of a domain.
struct Nodes<S: Service> {
    /// Nodes that died while working.
    dead: Vec<DeadNodeView<S>>,
    /// All other monitored nodes.
    living: HashSet<u128>,
    /// Ports of living nodes.
    ports: HashSet<u128>,
}

impl<S: Service> Nodes<S> {
    /// `None`: iceoryx2 cannot tell.
    fn list(config: &Config) -> Option<Self> {
        let mut nodes = Self { dead: Vec::new(), living: HashSet::new(), ports: HashSet::new() };
        let listed = Node::<S>::list(config, |state| {
            let id = state.node_id().value();
            match state {
                NodeState::Dead(dead) => nodes.dead.push(dead),
                // A node that cannot be examined may be alive.
                NodeState::Alive(_) | NodeState::Inaccessible(_) | NodeState::Undefined(_) => {
                    nodes.living.insert(id);
                }
            }
            CallbackProgression::Continue
        });
        listed.ok()?;
        let global = &config.global;
        let folder = PathBuf::from(global.node_dir().to_string());
        let (prefix, suffix) = (global.prefix.to_string(), global.node.port_tag_suffix.to_string());
        for id in &nodes.living {
            let tags = names(&folder.join(id.to_string()));
            nodes.ports.extend(tags.filter_map(|tag| id_in(&tag, &prefix, &suffix)));
        }
        Some(nodes)
    }
}

/// Lets iceoryx2 remove a dead node from its services, and its ports with it.
fn remove_node<S: Service>(dead: &DeadNodeView<S>) {
    // Without the details iceoryx2 would look in another domain. A node gives them up last, when it
    // is in no service any more; what is left of it goes with the traces.
    if dead.details().is_none() {
        return;
    }
    // iceoryx2 panics when it meets a node that is between "created" and "alive"
    // (eclipse-iceoryx/iceoryx2#1880). That node is not dead, so there is nothing to do.
    let _ = catch_unwind(AssertUnwindSafe(|| dead.clone().try_remove_stale_resources()));
}

/// The files of nodes: a folder each, and the files by which they are monitored.
struct Traces {
    paths: Vec<(u128, PathBuf)>,
}

impl Traces {
    fn list(config: &Config) -> Self {
        let global = &config.global;
        let folder = PathBuf::from(global.node_dir().to_string());
        let (prefix, suffix) = (global.prefix.to_string(), global.node.monitor_suffix.to_string());
        let id = |name: &str| {
            let monitor = || {
                let (id, _) = name.strip_prefix(&prefix)?.split_once(&suffix)?;
                id.parse().ok()
            };
            name.parse().ok().or_else(monitor)
        };
        let found = names(&folder).filter_map(|name| Some((id(&name)?, folder.join(name))));
        let mut paths: Vec<_> = found.collect();
        // The order in which iceoryx2 removes them. Whoever is killed in between leaves what the next
        // one still finds: a monitored file without an owner would be one that iceoryx2 cannot judge.
        let last = ["_owner_lock", "_context"];
        paths.sort_by_key(|(_, path): &(u128, PathBuf)| {
            let name = path.to_string_lossy();
            last.iter().position(|end| name.ends_with(end)).map(|place| place + 1)
        });
        Self { paths }
    }

    /// Removes files that belong to no node that could still use a service.
    fn remove_unknown<S: Service>(&self, config: &Config, nodes: &Nodes<S>, held: &LockGuard) {
        let details = |id: u128| {
            let global = &config.global;
            let name = format!("{}node{}", global.prefix, global.node.static_config_suffix);
            Path::new(&global.node_dir().to_string()).join(id.to_string()).join(name)
        };
        // A node has details until it has left all services. Those of whom iceoryx2 could not remove
        // everything have them still, and are tried again.
        let (kept, gone): (HashSet<u128>, HashSet<u128>) =
            nodes.dead.iter().map(|dead| dead.id().value()).partition(|id| details(*id).exists());
        let of_nobody = |id: &u128| !nodes.living.contains(id) && !kept.contains(id);
        // What nobody monitors is about to be, or its maker was killed before. Those who had the
        // lock before us are about nothing.
        let is_of_holder = |id: u128| {
            let process = UniqueSystemId::from(id).pid().value();
            u32::try_from(process).is_ok_and(|process| held.was_held_by(process))
        };
        let is_quiet = |id: &u128| {
            let mut paths = self.paths.iter().filter(|(of, _)| of == id);
            paths.all(|(_, path)| is_quiet(path))
        };
        for (id, path) in self.paths.iter().filter(|(id, _)| of_nobody(id)) {
            if gone.contains(id) || is_of_holder(*id) || is_quiet(id) {
                let _ =
                    if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            }
        }
    }
}

/// Whether a file, or a folder and its contents, has not changed for a while. One that is gone counts as unchanged.
fn is_quiet(path: &Path) -> bool {
    let quiet = |path: &Path| fs::symlink_metadata(path).map_or(true, |file| is_abandoned(&file));
    quiet(path) && names(path).all(|name| quiet(&path.join(name)))
}

/// Removes from a service those `ports` whose node does not exist.
///
/// iceoryx2 removes a dead node's port by its tag, and then takes it out of the service. Whoever is killed
/// in between leaves a port that iceoryx2 skips ever after, because it has no tag. So it gets one.
pub(crate) fn remove_strangers<S: Service>(
    config: &Config,
    hash: &ServiceHash,
    ports: &[(UniqueNodeId, u128)],
    _held: &LockGuard,
) {
    if !S::CROSSES_PROCESSES {
        return;
    }
    let _given_up = give_up_file_override();
    let Some(nodes) = Nodes::<S>::list(config) else { return };
    let global = &config.global;
    for (owner, port) in ports.iter().filter(|(owner, _)| !nodes.living.contains(&owner.value())) {
        let folder = Path::new(&global.node_dir().to_string()).join(owner.value().to_string());
        let tag = folder.join(format!("{}{port}{}", global.prefix, global.node.port_tag_suffix));
        let made = DirBuilder::new().recursive(true).mode(0o700).create(&folder);
        if made.and_then(|()| File::create(tag)).is_ok() {
            let _ = S::__internal_remove_node_from_service(owner, hash, config);
        }
        // Of a node that is dead, and no stranger, the rest is still needed.
        let _ = fs::remove_dir(folder);
    }
}

fn id_in(name: &str, prefix: &str, suffix: &str) -> Option<u128> {
    name.strip_prefix(prefix)?.strip_suffix(suffix)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use crate::IsolatedDomain;

    use super::*;

    #[test]
    fn the_file_without_which_iceoryx2_sees_no_node_is_removed_last() {
        let domain = IsolatedDomain::new("isotest").unwrap();
        let folder = PathBuf::from(domain.config().global.node_dir().to_string());
        fs::create_dir_all(&folder).unwrap();
        let monitor = format!("{}7{}", domain.prefix(), domain.config().global.node.monitor_suffix);
        let order = [monitor.clone(), monitor.clone() + "_owner_lock", monitor + "_context"];
        order.iter().rev().for_each(|name| fs::write(folder.join(name), "").unwrap());
        let expected: Vec<_> = order.iter().map(|name| (7, folder.join(name))).collect();
        assert_eq!(Traces::list(domain.config()).paths, expected);
    }
}
