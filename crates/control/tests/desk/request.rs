//! What is refused of a request before anything is sent to a task.

use isochrone_control::desk::*;
use isochrone_model::*;

use crate::hand::Hand;
use crate::level::{NODE, messages};

#[test]
fn a_request_is_answered_with_all_that_is_wrong_with_it() {
    let hand = Hand::new(NODE);
    let values: [(&str, Value); 13] = [
        ("free.value", 1.0.into()),
        ("free.value", 2.0.into()),
        ("fre.value", 1.0.into()),
        ("scale.x", 1.0.into()),
        ("scale.y", 1.0.into()),
        ("raw", 1.into()),
        ("raw.ok", true.into()),
        ("guard.value", 1.0.into()),
        ("ramp.1.setChangeRate", 51.0.into()),
        ("scale.x1", f64::NAN.into()),
        ("free.enDefaultOutValue", 1.into()),
        ("free.callOB", 1.5.into()),
        ("free.callOB", 40_000.into()),
    ];
    let found = messages(hand.operator.set(values, RequestTerms::default(), &[0, 0]));
    let expected = [
        "\"free.value\" is given twice",
        "there is no signal \"fre.value\"; did you mean \"free.value\"?",
        "\"scale.x\" is wired to \"raw\"",
        "\"scale.y\" is an output pin",
        "\"raw\" is an input, which is read from service \"plant/raw\"; publish",
        "\"raw.ok\" tells what the value of an input is worth",
        "\"guard.value\" is protected by [[protect]] \"guard.*\"",
        "51.0 is outside the limits of \"ramp.1.setChangeRate\", 0.0 to 50.0",
        "NaN is no LREAL",
        "1 is no BOOL, as \"free.enDefaultOutValue\" is; write true or false",
        "1.5 is no INT, as \"free.callOB\" is; write a whole number from -32768 to 32767",
        "\"free.callOB\" is given twice",
    ];
    assert_eq!(found.len(), expected.len(), "{found:#?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(expected), "{found} is not {expected}");
    }
}

#[test]
fn ten_thousand_unknown_names_are_refused_one_by_one() {
    let hand = Hand::new(NODE);
    let names: Vec<String> = (0..10_000).map(|n| format!("nobody{n}.x")).collect();
    let values = names.iter().map(|name| (name.as_str(), Value::from(1.0)));
    assert_eq!(messages(hand.operator.set(values, RequestTerms::default(), &[0, 0])).len(), 10_000);
}

#[test]
fn a_request_for_nothing_is_refused() {
    let hand = Hand::new(NODE);
    let none: [(&str, Value); 0] = [];
    let empty = ["the request names no signal; name at least one"];
    assert_eq!(messages(hand.operator.set(none, RequestTerms::default(), &[0, 0])), empty);
    assert_eq!(messages(hand.prepare_release([])), empty);
}

#[test]
fn what_the_configuration_does_not_allow_is_refused_with_what_would() {
    for (control, may_set) in [("off", false), ("read", false), ("set", true)] {
        let hand = Hand::new(&NODE.replace("\"force\"", &format!("\"{control}\"")));
        let values = [("free.value", Value::from(1.0))];
        let set = hand.operator.set(values, RequestTerms::default(), &[0, 0]);
        assert_eq!(set.is_ok(), may_set, "{control}");
        let force =
            hand.operator.force(values, Hold::UntilReleased, RequestTerms::default(), &[0, 0]);
        assert_eq!(force.as_ref().unwrap_err().code, Code::Forbidden);
        let found = messages(force);
        let sentence = format!("[node] control = \"{control}\" does not allow forcing a signal");
        assert!(
            found[0].starts_with(&sentence) && found[0].contains("control = \"force\""),
            "{found:?}"
        );
    }
}

#[test]
fn a_cycle_that_nothing_can_wait_for_is_refused() {
    let hand = Hand::new(NODE);
    let next = [500, 50];
    let why = |values: &[(&str, Value)], at: u64| {
        let request = RequestTerms { at: Some(at.into()), ..RequestTerms::default() };
        let refused = hand.operator.set(values.iter().copied(), request, &next);
        let refused = messages(refused);
        assert_eq!(refused.len(), 1, "{refused:?}");
        refused[0].split_once(": ").unwrap().1.to_owned()
    };
    let fast = ("scale.y1", Value::from(1.0));
    let slow = ("free.value", Value::from(1.0));
    assert_eq!(why(&[fast], 499), "it has begun; name a later cycle, or none");
    let too_far = "it is more than 10 s ahead; ask again when it is near";
    assert_eq!(why(&[fast], 601), too_far);
    assert_eq!(why(&[fast], u64::MAX), too_far);
    assert!(why(&[fast, slow], 510).starts_with("the values are of several tasks (fast, slow), "));
    let request = RequestTerms { at: Some(600.into()), ..RequestTerms::default() };
    assert!(hand.operator.set([fast], request, &next).is_ok());
}

/// A request of a client for a later cycle.
fn later(client: &str, process: u32, at: u64) -> RequestTerms {
    let by = AskedBy { client: Some(client.into()), process: Some(process), comment: None };
    RequestTerms { at: Some(at.into()), by, is_remote: true }
}

#[test]
fn requests_of_one_client_for_later_cycles_leave_others_some_room() {
    let mut hand = Hand::new(NODE);
    let value = [("scale.y1", Value::from(1.0))];
    // Each run of a verb is a process of its own.
    for process in 0..32 {
        let request = later("anna", process, 50 + u64::from(process));
        let prepared = hand.operator.set(value, request, &hand.next);
        hand.send(prepared);
    }
    let refused = hand.operator.set(value, later("anna", 99, 90), &hand.next);
    assert_eq!(refused.as_ref().unwrap_err().code, Code::Busy);
    assert_eq!(
        messages(refused),
        [
            "task \"fast\" keeps at most 32 requests of one client for later cycles, and has 32 of \"anna\"; \
          ask without a cycle, or again after cycle 50, when the first of them has come"
        ]
    );
    let now = RequestTerms { at: None, ..later("anna", 99, 0) };
    assert!(
        hand.operator.set(value, now, &hand.next).is_ok(),
        "what is to happen at once has room"
    );
    for at in 60..76 {
        let prepared = hand.operator.set(value, later("ben", 7, at), &hand.next);
        hand.send(prepared);
    }
    let full = messages(hand.operator.set(value, later("carl", 8, 90), &hand.next));
    assert!(
        full[0].starts_with(
            "task \"fast\" keeps at most 48 requests for later cycles, and has 32 of \"anna\" and 16 of \"ben\""
        ),
        "{full:?}"
    );
    assert_eq!(hand.operator.waiting_for(0), "32 of \"anna\" and 16 of \"ben\"");
    while hand.next[0] <= 50 {
        hand.step(0);
    }
    let request = later("anna", 99, 90);
    assert!(hand.operator.set(value, request, &hand.next).is_ok(), "the first has come");
}
