//! Who and what is in a domain.

use crate::variants::layout;
use iceoryx2::prelude::{NodeBuilder, ServiceName};
use isochrone_ipc::{
    Depth, FramePublisher, FrameSubscriber, LayoutAnnouncer, Participant, Service,
};
use isochrone_testing::Domain;

for_both_variants! {
    the_nodes_of_a_domain_are_listed_with_name_and_process
    services_of_frames_are_listed_with_who_writes_and_reads_them
    what_carries_no_frames_is_not_listed
}

fn the_nodes_of_a_domain_are_listed_with_name_and_process<S: Service>() {
    let domain = Domain::new();
    let looker = domain.join_variant::<S>("tester");
    assert_eq!(looker.nodes().unwrap(), []);
    let second = Participant::<S>::join_variant("b", &domain).unwrap();
    let first = Participant::<S>::join_variant("a", &domain).unwrap();
    let nodes = looker.nodes().unwrap();
    assert_eq!(nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    assert!(nodes.iter().all(|node| node.pid == std::process::id()), "{nodes:?}");
    assert!(nodes.iter().all(|node| node.program.starts_with("ipc-")), "{nodes:?}");
    drop((first, second));
    assert_eq!(looker.nodes().unwrap(), []);
}

fn services_of_frames_are_listed_with_who_writes_and_reads_them<S: Service>() {
    let domain = Domain::new();
    let looker = domain.join_variant::<S>("tester");
    let writer = Participant::<S>::join_variant("writer", &domain).unwrap();
    let reader = Participant::<S>::join_variant("reader", &domain).unwrap();
    let publisher = FramePublisher::open(&writer, "plant/x", &layout(&["a:LREAL"])).unwrap();
    let _subscribers = ["plant/x", "plant/unwritten"]
        .map(|service| FrameSubscriber::open(&reader, service, 1, Depth::Newest).unwrap());
    assert_eq!(looker.frame_service_names().unwrap(), ["plant/unwritten", "plant/x"]);
    let names = |nodes: &[isochrone_ipc::ListedNode]| {
        nodes.iter().map(|node| node.name.clone()).collect::<Vec<_>>()
    };
    let services = looker.frame_services().unwrap();
    let [unwritten, written] = services.as_slice() else { panic!("{services:?}") };
    assert_eq!(
        (names(&written.publishers), names(&written.subscribers)),
        (vec!["writer".into()], vec!["reader".into()])
    );
    assert_eq!((names(&unwritten.publishers).len(), names(&unwritten.subscribers).len()), (0, 1));
    drop(publisher);
    assert_eq!(looker.frame_services().unwrap()[1].publishers, []);
}

fn what_carries_no_frames_is_not_listed<S: Service>() {
    let domain = Domain::new();
    let looker = domain.join_variant::<S>("tester");
    let _layouts = LayoutAnnouncer::open(&looker, "plant/x", "me", &layout(&["a:LREAL"])).unwrap();
    let other = NodeBuilder::new().config(domain.config()).create::<S>().unwrap();
    let service = ServiceName::new("others").unwrap();
    let _numbers = other.service_builder(&service).publish_subscribe::<u64>().create().unwrap();
    let _events = other.service_builder(&service).event().create().unwrap();
    assert_eq!(looker.frame_service_names().unwrap(), Vec::<String>::new());
}
