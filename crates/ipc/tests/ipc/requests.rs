//! Requests and their answers, within one process and across processes.

use std::os::unix::fs::{MetadataExt, PermissionsExt};

use crate::variants::{joined, layout};
use iceoryx2::node::NodeBuilder;
use isochrone_ipc::{
    AnswerError, Delivery, MAX_CLIENTS, MAX_MESSAGE_BYTES, MAX_SERVERS, OpenError, Participant,
    Request, RequestClient, RequestError, RequestServer, Service, ipc,
};
use isochrone_testing::Domain;

const SERVICE: &str = "isochrone/plant/control";

for_both_variants! {
    each_client_gets_the_answer_to_its_own_request
    the_longest_message_passes_both_ways_and_one_byte_more_is_refused
    an_empty_message_passes_both_ways
    a_request_that_was_given_up_before_it_was_received_never_is
    a_request_that_was_given_up_afterwards_gets_no_answer_and_the_next_one_does
    a_request_may_be_kept_while_others_are_answered
    the_requests_of_a_client_that_left_get_no_answer
    a_client_asks_thousands_of_times_and_gives_up_every_third
    a_ninth_client_is_refused_until_one_leaves
    both_servers_get_each_request_and_the_silent_one_does_no_harm
    a_third_server_is_refused
    without_a_server_there_is_no_client_and_afterwards_nobody_to_ask
    a_name_that_cannot_be_is_refused
}

/// A domain with a participant and a server.
fn served<S: Service>() -> (Domain, Participant<S>, RequestServer<S>) {
    let (domain, node) = joined::<S>();
    let server = RequestServer::open(&node, SERVICE).unwrap();
    (domain, node, server)
}

/// A domain with a participant, a server and a client.
fn asking<S: Service>() -> (Domain, Participant<S>, RequestServer<S>, RequestClient<S>) {
    let (domain, node, server) = served::<S>();
    let client = open(&node);
    (domain, node, server, client)
}

fn open<S: Service>(node: &Participant<S>) -> RequestClient<S> {
    RequestClient::open(node, SERVICE).unwrap().unwrap()
}

/// Answers whatever has arrived by itself, with a mark.
fn echo<S: Service>(server: &mut RequestServer<S>) -> usize {
    let mut answered = 0;
    while let Some(request) = server.receive() {
        let answer = [request.bytes(), b"!"].concat();
        assert_eq!(request.answer(&answer).unwrap(), Delivery::Sent);
        answered += 1;
    }
    answered
}

/// Asserts that a request of a client, and nothing else, is answered with its echo.
#[track_caller]
fn assert_answered<S: Service>(
    server: &mut RequestServer<S>,
    client: &mut RequestClient<S>,
    request: &[u8],
) {
    client.send(request).unwrap();
    assert_eq!(echo(server), 1);
    assert_eq!(client.receive().unwrap().unwrap(), [request, b"!"].concat());
}

fn each_client_gets_the_answer_to_its_own_request<S: Service>() {
    let (_domain, node, mut server) = served::<S>();
    let mut clients: Vec<_> = (0..MAX_CLIENTS).map(|_| open(&node)).collect();
    for round in 0..20 {
        for (index, client) in clients.iter_mut().enumerate() {
            client.send(format!("{index} {round}").as_bytes()).unwrap();
            assert_eq!(client.receive().unwrap(), None);
        }
        assert_eq!(echo(&mut server), MAX_CLIENTS);
        for (index, client) in clients.iter_mut().enumerate() {
            let answer = client.receive().unwrap().unwrap();
            assert_eq!(answer, format!("{index} {round}!").as_bytes());
            assert_eq!(client.receive().unwrap(), None);
        }
    }
}

fn the_longest_message_passes_both_ways_and_one_byte_more_is_refused<S: Service>() {
    let (_domain, _node, mut server, mut client) = asking::<S>();
    let longest: Vec<u8> = (0..MAX_MESSAGE_BYTES).map(|n| n as u8).collect();
    let longer = [&longest[..], b"x"].concat();
    let refused = client.send(&longer).unwrap_err();
    assert!(matches!(refused, RequestError::TooLong { bytes, .. } if bytes == longer.len()));
    assert!(refused.to_string().contains("at most 262144"), "{refused}");

    client.send(&longest).unwrap();
    let request = server.receive().unwrap();
    assert!(request.bytes() == longest);
    let refused = request.answer(&longer).unwrap_err();
    assert!(matches!(refused.error, AnswerError::TooLong { limit: MAX_MESSAGE_BYTES, .. }));
    // Too long for one answer is no reason to have none.
    assert_eq!(refused.request.answer(&longest).unwrap(), Delivery::Sent);
    assert!(client.receive().unwrap().unwrap() == longest);
}

fn an_empty_message_passes_both_ways<S: Service>() {
    let (_domain, _node, mut server, mut client) = asking::<S>();
    client.send(b"").unwrap();
    let request = server.receive().unwrap();
    assert_eq!(request.bytes(), b"");
    request.answer(b"").unwrap();
    assert_eq!(client.receive().unwrap().unwrap(), b"");
}

fn a_request_that_was_given_up_before_it_was_received_never_is<S: Service>() {
    let (_domain, _node, mut server, mut client) = asking::<S>();
    client.send(b"old").unwrap();
    client.give_up();
    assert!(server.receive().is_none());
    client.send(b"older").unwrap();
    client.send(b"new").unwrap();
    assert_eq!(server.receive().unwrap().bytes(), b"new");
    assert!(server.receive().is_none());
}

fn a_request_that_was_given_up_afterwards_gets_no_answer_and_the_next_one_does<S: Service>() {
    let (_domain, _node, mut server, mut client) = asking::<S>();
    client.send(b"old").unwrap();
    let old = server.receive().unwrap();
    assert!(old.is_awaited());
    client.give_up();
    assert!(!old.is_awaited());
    client.send(b"new").unwrap();
    assert_eq!(old.answer(b"late").unwrap(), Delivery::GivenUp);
    assert_eq!(echo(&mut server), 1);
    assert_eq!(client.receive().unwrap().unwrap(), b"new!");
}

fn a_request_may_be_kept_while_others_are_answered<S: Service>() {
    let (_domain, node, mut server) = served::<S>();
    let (mut slow, mut quick) = (open(&node), open(&node));
    slow.send(b"slow").unwrap();
    let kept = server.receive().unwrap();
    for _ in 0..100 {
        assert_answered(&mut server, &mut quick, b"quick");
    }
    assert_eq!(kept.answer(b"at last").unwrap(), Delivery::Sent);
    assert_eq!(slow.receive().unwrap().unwrap(), b"at last");
}

fn the_requests_of_a_client_that_left_get_no_answer<S: Service>() {
    let (_domain, node, mut server, mut client) = asking::<S>();
    client.send(b"received").unwrap();
    let received = server.receive().unwrap();
    drop(client);
    assert!(!received.is_awaited());
    // Another one takes its place, and asks with the same number.
    let mut next = open(&node);
    next.send(b"next").unwrap();
    assert_eq!(received.answer(b"for nobody").unwrap(), Delivery::GivenUp);
    assert_eq!(echo(&mut server), 1);
    assert_eq!(next.receive().unwrap().unwrap(), b"next!");
    assert_eq!(next.receive().unwrap(), None);
}

fn a_client_asks_thousands_of_times_and_gives_up_every_third<S: Service>() {
    let (_domain, _node, mut server, mut client) = asking::<S>();
    for n in 0..3000_u32 {
        let text = n.to_string();
        client.send(text.as_bytes()).unwrap();
        match n % 6 {
            // Before it is received, and afterwards; both leave the next one unharmed.
            0 => client.give_up(),
            3 => {
                echo(&mut server);
                client.give_up();
            }
            _ => {
                assert_eq!(echo(&mut server), 1);
                assert_eq!(client.receive().unwrap().unwrap(), format!("{n}!").as_bytes());
            }
        }
    }
}

fn a_ninth_client_is_refused_until_one_leaves<S: Service>() {
    let (_domain, node, mut server) = served::<S>();
    let mut clients: Vec<_> = (0..MAX_CLIENTS).map(|_| open(&node)).collect();
    let refused = RequestClient::open(&node, SERVICE).unwrap_err();
    assert!(matches!(refused, OpenError::Full { what: "client", limit: 8, .. }), "{refused}");
    assert!(refused.to_string().contains(SERVICE), "{refused}");
    assert!(refused.to_string().contains("end one"), "{refused}");
    clients.pop();
    let mut ninth = open(&node);
    assert_answered(&mut server, &mut ninth, b"at last");
}

fn both_servers_get_each_request_and_the_silent_one_does_no_harm<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut active = RequestServer::open(&node, SERVICE).unwrap();
    let mut client = open(&node);
    let mut standby = RequestServer::open(&node, SERVICE).unwrap();
    assert_eq!(client.living_servers().len(), MAX_SERVERS);
    assert!(client.living_servers().iter().all(|one| one.process == Some(std::process::id())));
    for n in 0..50 {
        let text = format!("{n}");
        client.send(text.as_bytes()).unwrap();
        // One that holds no node looks only now and then, and says nothing.
        if n % 7 == 0 {
            let mut dropped = 0;
            while standby.receive().is_some() {
                dropped += 1;
            }
            assert_eq!(dropped, 1, "what was given up is not for it either");
        }
        assert_eq!(echo(&mut active), 1);
        assert_eq!(client.receive().unwrap().unwrap(), format!("{n}!").as_bytes());
    }
    // It takes over.
    drop(active);
    assert_answered(&mut standby, &mut client, b"still there?");
}

fn a_third_server_is_refused<S: Service>() {
    let (_domain, node) = joined::<S>();
    let _servers: Vec<_> =
        (0..MAX_SERVERS).map(|_| RequestServer::open(&node, SERVICE).unwrap()).collect();
    let refused = RequestServer::open(&node, SERVICE).unwrap_err();
    assert!(matches!(refused, OpenError::Full { what: "server", limit: 2, .. }), "{refused}");
}

fn without_a_server_there_is_no_client_and_afterwards_nobody_to_ask<S: Service>() {
    let (_domain, node) = joined::<S>();
    assert!(RequestClient::open(&node, SERVICE).unwrap().is_none());
    let server = RequestServer::open(&node, SERVICE).unwrap();
    let mut client = open(&node);
    drop(server);
    assert!(matches!(client.send(b"hello?"), Err(RequestError::NoServer { .. })));
    assert!(RequestClient::open(&node, SERVICE).unwrap().is_none(), "a client serves nobody");
    // The same client reaches the next one.
    let mut server = RequestServer::open(&node, SERVICE).unwrap();
    assert_answered(&mut server, &mut client, b"hello?");
}

fn a_name_that_cannot_be_is_refused<S: Service>() {
    let (_domain, node) = joined::<S>();
    let refused = RequestServer::open(&node, "\u{7}").unwrap_err();
    assert!(matches!(refused, OpenError::ServiceName(_)), "{refused}");
    assert!(RequestClient::open(&node, "").is_err());
}

#[test]
fn clients_that_left_before_their_request_was_received_leave_nothing_mapped_for_long() {
    let (domain, node, mut server) = served::<ipc::Service>();
    let mapped = || {
        let map = std::fs::read_to_string("/proc/self/maps").unwrap();
        map.lines()
            .filter(|line| line.contains(&domain.prefix()) && line.contains("deleted"))
            .count()
    };
    // As the one who reads `get` on a screen for days.
    let mut constant = open(&node);
    for n in 0..300 {
        let mut client = open(&node);
        // One that is kept when its client leaves is what iceoryx2 makes room for, or panics.
        client.send(b"received").unwrap();
        let held = server.receive().unwrap();
        client.send(b"not received").unwrap();
        drop(client);
        assert!(server.receive().is_none());
        drop(held);
        server.tend(&node);
        assert_answered(&mut server, &mut constant, b"still there?");
        assert!(mapped() < 120, "{} after {n}", mapped());
    }
    drop(constant);
    for _ in 0..70 {
        let mut client = open(&node);
        assert!(server.receive().is_none());
        client.send(b"not received").unwrap();
        drop(client);
        assert!(server.receive().is_none());
        server.tend(&node);
    }
    assert!(mapped() < 70, "{}", mapped());
    assert_eq!(server.clients(), 0);
    let mut client = open(&node);
    assert_answered(&mut server, &mut client, b"again");
}

#[test]
fn a_service_of_another_type_is_refused_by_name_with_what_it_carries() {
    let domain = Domain::new();
    let foreign = NodeBuilder::new().config(domain.config());
    let foreign = foreign.create::<iceoryx2::service::ipc::Service>().unwrap();
    let name = SERVICE.try_into().unwrap();
    let _service = foreign.service_builder(&name).request_response::<u64, [u8]>().create().unwrap();
    let node = domain.join_variant::<ipc::Service>("tester");
    for refused in [
        RequestServer::open(&node, SERVICE).unwrap_err(),
        RequestClient::open(&node, SERVICE).unwrap_err(),
    ] {
        assert!(matches!(refused, OpenError::OtherTypes { .. }), "{refused}");
        let text = refused.to_string();
        assert!(text.contains(SERVICE) && text.contains("requests that are u64"), "{text}");
    }
}

#[test]
fn clients_of_another_make_that_keep_their_answers_hold_up_others_until_they_let_go() {
    let (domain, _node, mut server) = served::<ipc::Service>();
    let foreign = NodeBuilder::new().config(domain.config());
    let foreign = foreign.create::<iceoryx2::service::ipc::Service>().unwrap();
    let name = SERVICE.try_into().unwrap();
    let service = foreign.service_builder(&name).request_response::<[u8], [u8]>().open().unwrap();
    let clients: Vec<_> = (0..MAX_CLIENTS)
        .map(|_| service.client_builder().initial_max_slice_len(8).create().unwrap())
        .collect();
    let mut kept = Vec::new();
    let mut refused = None;
    'asking: for _ in 0..4 {
        for client in &clients {
            let request = client.loan_slice_uninit(1).unwrap().write_from_slice(b"x");
            let pending = request.send().unwrap();
            let received = server.receive().unwrap();
            match received.answer(b"y") {
                Ok(delivery) => assert_eq!(delivery, Delivery::Sent),
                Err(unanswered) => {
                    refused = Some((unanswered, pending));
                    break 'asking;
                }
            }
            kept.push(pending.receive().unwrap().unwrap());
        }
    }
    let (unanswered, pending) = refused.expect("there are not as many");
    assert!(matches!(unanswered.error, AnswerError::NoRoom { .. }), "{}", unanswered.error);
    assert_eq!(kept.len(), 25, "all answers that there is memory for");
    // It is tried again and again.
    let mut request = unanswered.request;
    for _ in 0..100 {
        request = request.answer(b"z").unwrap_err().request;
    }
    kept.pop();
    assert_eq!(request.answer(b"z").unwrap(), Delivery::Sent);
    assert_eq!(pending.receive().unwrap().unwrap().payload(), b"z");
}

#[test]
fn a_service_of_frames_may_have_the_same_name() {
    let (_domain, node) = joined::<ipc::Service>();
    let layout = layout(&["a:LREAL"]);
    let _frames = isochrone_ipc::FramePublisher::open(&node, SERVICE, &layout).unwrap();
    let mut server = RequestServer::open(&node, SERVICE).unwrap();
    open(&node).send(b"x").unwrap();
    assert_eq!(server.receive().map(|request: Request<_>| request.bytes().len()), None);
}

#[test]
fn ports_claim_what_they_need_and_only_their_owner_may_write_to_it() {
    let (domain, node) = joined::<ipc::Service>();
    let segments = || {
        let files = domain.files().into_iter();
        let data = files.filter(|file| file.to_string_lossy().ends_with(".data"));
        let mut found: Vec<_> = data.map(|file| std::fs::metadata(file).unwrap()).collect();
        found.sort_by_key(|file| std::cmp::Reverse(file.len()));
        found
    };
    let _server = RequestServer::open(&node, SERVICE).unwrap();
    let _client = open(&node);
    let [server, client] = &segments()[..] else { panic!("{:?}", domain.files()) };
    for (segment, messages) in [(server, 25), (client, 3)] {
        let needed = messages * MAX_MESSAGE_BYTES as u64;
        assert!((needed..needed + 16_384).contains(&segment.len()), "{}", segment.len());
        // What a page that nobody claimed needs is found out at its first touch, by SIGBUS.
        assert!(segment.blocks() * 512 >= segment.len());
    }
    for file in domain.files() {
        let mode = std::fs::metadata(&file).unwrap().permissions().mode();
        assert_eq!(mode & 0o077, 0, "{} has {mode:o}", file.display());
    }
}
