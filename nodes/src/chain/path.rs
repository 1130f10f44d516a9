//! The check that services are a chain: each is published by a process that reads the one before.

use std::collections::{BTreeMap, VecDeque};

use isochrone_ipc::{ListedNode, ListedService, Participant, ipc};

use crate::base::failure::Failure;
use crate::list;

/// The nodes between the services of a chain: who reads each and publishes the next.
pub(super) fn nodes(
    participant: &Participant<ipc::Service>,
    services: &[String],
) -> Result<Vec<String>, Failure> {
    let listed = participant.frame_services().map_err(Failure::found)?;
    for (index, service) in services.iter().enumerate() {
        if services.iter().take(index).any(|before| before == service) {
            let message = format!("\"{service}\" is named twice; a chain passes each service once");
            return Err(Failure::usage(message));
        }
        match listed.iter().find(|listed| listed.name == *service) {
            None => {
                let way_out = match list::similar(participant, service) {
                    Some(similar) => format!("did you mean \"{similar}\"?"),
                    None => "`isochrone list` shows those that there are".into(),
                };
                let message = format!("there is no service \"{service}\"; {way_out}");
                return Err(Failure::nobody(message));
            }
            Some(found) if found.publishers.is_empty() => {
                let message =
                    format!("nobody publishes \"{service}\" now; start the node that does");
                return Err(Failure::nobody(message));
            }
            Some(_) => {}
        }
    }
    let pairs = services.iter().zip(services.iter().skip(1));
    pairs
        .map(|(from, to)| match between(&listed, from, to) {
            Some(node) => Ok(shown(&node.name).to_owned()),
            None => Err(Failure::usage(no_chain(&listed, from, to))),
        })
        .collect()
}

/// The name of a node without what all nodes of isochrone begin with.
fn shown(node: &str) -> &str {
    node.strip_prefix("isochrone/").unwrap_or(node)
}

fn find<'a>(listed: &'a [ListedService], name: &str) -> Option<&'a ListedService> {
    listed.iter().find(|service| service.name == name)
}

/// Who reads one service and publishes the other.
fn between<'a>(listed: &'a [ListedService], from: &str, to: &str) -> Option<&'a ListedNode> {
    let readers = &find(listed, from)?.subscribers;
    let writers = &find(listed, to)?.publishers;
    writers.iter().find(|writer| readers.iter().any(|reader| reader.pid == writer.pid))
}

/// Why two services do not follow each other, and which ones do.
fn no_chain(listed: &[ListedService], from: &str, to: &str) -> String {
    if let Some(path) = shortest_path(listed, from, to) {
        let path = path.join(" ");
        return format!(
            "\"{to}\" is not computed from \"{from}\" by one node, but by several: isochrone chain {path}"
        );
    }
    let writers = find(listed, to).map(|service| service.publishers.as_slice()).unwrap_or_default();
    if let Some(program) = writers.iter().find(|writer| writer.name.is_empty()) {
        return format!(
            "these services are no chain: \"{to}\" is published by {} (pid {}), which is no node of isochrone: \
             through a link it comes from another machine, whose clock does not compare with the one here. \
             Begin the chain with it, or measure there the part that runs there",
            program.program, program.pid
        );
    }
    let who = writers.first().map_or("nobody", |writer| shown(&writer.name));
    let is_theirs = |reader: &ListedNode| writers.iter().any(|writer| writer.pid == reader.pid);
    let read: Vec<_> = listed
        .iter()
        .filter(|service| service.subscribers.iter().any(is_theirs))
        .map(|service| format!("\"{}\"", service.name))
        .collect();
    let reads = match read.as_slice() {
        [] => "it reads no service".to_owned(),
        read => format!("it reads {}", read.join(", ")),
    };
    format!(
        "these services are no chain: \"{to}\" is published by {who}, which does not read \"{from}\"; \
         {reads}. Name the services in their order, the source first"
    )
}

/// The services on the way from one to another.
fn shortest_path(listed: &[ListedService], from: &str, to: &str) -> Option<Vec<String>> {
    let mut before: BTreeMap<&str, &str> = BTreeMap::new();
    let mut open = VecDeque::from([from]);
    while let Some(service) = open.pop_front() {
        for next in listed.iter().map(|next| next.name.as_str()) {
            let is_new = next != from && !before.contains_key(next);
            if is_new && between(listed, service, next).is_some() {
                before.insert(next, service);
                open.push_back(next);
            }
        }
    }
    let mut path = vec![to.to_owned()];
    let mut at = to;
    while at != from {
        at = before.get(at)?;
        path.push(at.to_owned());
    }
    path.reverse();
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(pid: u32) -> ListedNode {
        ListedNode { name: format!("isochrone/n{pid}"), pid, program: String::new() }
    }

    fn service(name: &str, publisher: u32, subscribers: &[u32]) -> ListedService {
        ListedService {
            name: name.into(),
            publishers: vec![node(publisher)],
            subscribers: subscribers.iter().copied().map(node).collect(),
        }
    }

    #[test]
    fn whoever_leaves_out_a_service_is_told_the_whole_chain() {
        let listed = [service("a", 1, &[2, 9]), service("b", 2, &[3]), service("c", 3, &[])];
        assert_eq!(between(&listed, "a", "b"), Some(&node(2)));
        assert_eq!(between(&listed, "a", "c"), None);
        assert!(no_chain(&listed, "a", "c").ends_with("isochrone chain a b c"));
        assert_eq!(
            no_chain(&listed, "c", "b"),
            "these services are no chain: \"b\" is published by n2, which does not read \"c\"; it reads \
             \"a\". Name the services in their order, the source first"
        );
        assert!(no_chain(&listed, "c", "a").contains("it reads no service"));
    }

    #[test]
    fn what_the_program_of_a_link_publishes_is_said_to_come_from_another_machine() {
        let mut link = node(7);
        (link.name, link.program) = (String::new(), "iox2-link".into());
        let mut far = service("far", 7, &[]);
        far.publishers = vec![link];
        let said = no_chain(&[service("a", 1, &[2]), far], "a", "far");
        let begins = "these services are no chain: \"far\" is published by iox2-link (pid 7), which is no node";
        assert!(said.starts_with(begins), "{said}");
        assert!(said.contains("comes from another machine"), "{said}");
    }

    #[test]
    fn a_loop_of_nodes_ends_the_search() {
        let listed = [service("a", 1, &[2]), service("b", 2, &[1]), service("c", 3, &[])];
        assert_eq!(shortest_path(&listed, "a", "c"), None);
    }
}
