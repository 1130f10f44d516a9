//! Answers, which are never longer than a message.

use isochrone_control::{Code, Finding, Refusal, Reply, Room, SignalsResult, answer};
use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde_json::{Value as Json, json};

#[test]
fn an_answer_has_the_id_and_a_result_or_an_error_with_all_findings() {
    let result = SignalsResult { total: 0, signals: Vec::new() };
    let text: Json = serde_json::from_slice(&answer(Some("7"), Ok(&result))).unwrap();
    let expected = json!({"jsonrpc": "2.0", "id": "7", "result": {"total": 0, "signals": []}});
    assert_eq!(text, expected);
    // A reply is the result of its method, with nothing around it.
    assert_eq!(answer(Some("7"), Ok(&Reply::Signals(result))), text.to_string().into_bytes());
    let failure = Refusal::of(
        Code::UnknownName,
        vec![
            Finding::new("a", "there is no signal \"a\"").with_help("did you mean \"b\"?"),
            Finding::new("c", "there is no signal \"c\""),
        ],
    );
    let text: Json = serde_json::from_slice(&answer::<Reply>(None, Err(&failure))).unwrap();
    assert_eq!(
        text,
        json!({"jsonrpc": "2.0", "id": null, "error": {
            "code": 1,
            "message": "there is no signal \"a\"; did you mean \"b\"? (and 1 more)",
            "data": [
                {"name": "a", "message": "there is no signal \"a\"", "help": "did you mean \"b\"?"},
                {"name": "c", "message": "there is no signal \"c\""},
            ],
        }})
    );
}

#[test]
fn no_answer_is_longer_than_a_message_and_a_longer_one_says_what_is_missing() {
    let finding = |n: usize| Finding::new(format!("name{n}"), "there is no such signal");
    let failure = Refusal::of(Code::UnknownName, (0..10_000).map(finding).collect());
    let text = answer::<Reply>(Some("7"), Err(&failure));
    assert!(text.len() <= MAX_MESSAGE_BYTES);
    let text: Json = serde_json::from_slice(&text).unwrap();
    let shown = text["error"]["data"].as_array().unwrap().len();
    assert!((3000..10_000).contains(&shown), "{shown}");
    let message = text["error"]["message"].as_str().unwrap();
    assert!(message.ends_with(&format!("of 10000 findings the first {shown} are in this answer")));

    let failure = Refusal::new(Code::Internal, "x".repeat(MAX_MESSAGE_BYTES));
    assert!(answer::<Reply>(Some("7"), Err(&failure)).len() <= MAX_MESSAGE_BYTES);
    let much = vec!["x".repeat(1000); 300];
    let text = answer(Some("7"), Ok(&much));
    let text: Json = serde_json::from_slice(&text).unwrap();
    assert_eq!(text["error"]["code"], -32603);
    assert!(text["error"]["message"].as_str().unwrap().contains("\"limit\""), "{text}");
}

#[test]
fn a_page_ends_where_the_answer_is_full() {
    let mut room = Room::of_answer();
    let item = "x".repeat(997);
    let taken = std::iter::repeat_n(&item, 1000).take_while(|item| room.takes(*item)).count();
    let page = vec![&item; taken];
    let text = answer(Some("7"), Ok(&page));
    assert!(serde_json::from_slice::<Json>(&text).unwrap()["result"].is_array());
    assert!(taken > 250, "{taken}");
    assert!(room.takes(&1) && !room.takes_entry(&item, &1), "a small one still fits");
}
