//! What is a request and what is answered to everything else.

use isochrone_ipc::MAX_MESSAGE_BYTES;
use isochrone_runtime::control::{
    ApplyParams, Call, Code, DescribeParams, Failure, Finding, ForceParams, GetParams, Hold,
    JournalParams, MAX_ID_BYTES, Method, Params, Parsed, ReleaseParams, Reply, Room, SetParams,
    SignalsParams, SignalsResult, UndoParams, Unparsed, Value, Values, answer, parse, request,
};
use proptest::prelude::*;
use serde_json::{Value as Json, json};

fn parsed(text: &str) -> Parsed {
    parse(text.as_bytes()).unwrap_or_else(|unparsed| panic!("{text}: {unparsed:?}"))
}

fn refused(text: &str) -> Unparsed {
    parse(text.as_bytes()).expect_err(text)
}

/// A request for a method, with the id "7".
fn asking(method: &str, params: Json) -> String {
    json!({"jsonrpc": "2.0", "id": "7", "method": method, "params": params}).to_string()
}

fn findings(unparsed: &Unparsed) -> Vec<(&str, &str)> {
    unparsed.failure.findings.iter().map(|one| (&*one.name, &*one.message)).collect()
}

#[test]
fn a_request_has_an_id_a_method_and_its_parameters() {
    let text = r#"{"jsonrpc": "2.0", "id": "a-1", "method": "describe"}"#;
    assert_eq!(parsed(text).id, "a-1");
    assert_eq!(parsed(text).call, Call::Describe(DescribeParams {}));
    let text = r#" {"params": {"names": ["a.*"]}, "method": "get", "id": "é", "jsonrpc": "2.0"} "#;
    let names = vec!["a.*".to_owned()];
    let get = GetParams { names, offset: None, limit: None };
    assert_eq!(parsed(text), Parsed { id: "é".to_owned(), call: Call::Get(get) });
}

#[test]
fn what_a_client_writes_is_what_a_node_reads() {
    fn check<P: Params>(params: P, call: Call) {
        let text = request("x", &params).unwrap();
        assert_eq!(parse(&text), Ok(Parsed { id: "x".to_owned(), call }));
        assert_eq!(parse(&text).unwrap().call.method(), P::METHOD);
    }
    let values: Values = [("a", Value::from(0.1)), ("b", Value::from(true))].into_iter().collect();
    let set = SetParams { values: values.clone(), at: Some(u64::MAX), ..SetParams::default() };
    check(set.clone(), Call::Set(set));
    let force = ForceParams { values, seconds: Hold::Seconds(2.5), ..ForceParams::default() };
    check(force.clone(), Call::Force(force.clone()));
    let held = ForceParams { seconds: Hold::UntilReleased, comment: Some("x".into()), ..force };
    check(held.clone(), Call::Force(held));
    let signals = SignalsParams { pattern: Some("*.ok".into()), offset: Some(1), limit: Some(2) };
    check(signals.clone(), Call::Signals(signals));
    let journal = JournalParams { since: Some(u64::MAX), limit: None };
    check(journal.clone(), Call::Journal(journal));
    let undo = UndoParams { transaction: 3, client: Some("anna".into()) };
    check(undo.clone(), Call::Undo(undo));
    let release = ReleaseParams { names: vec!["*".into()], client: Some("anna".into()) };
    check(release.clone(), Call::Release(release));
    let apply = ApplyParams { configuration: "[node]\n".into(), ..ApplyParams::default() };
    check(apply.clone(), Call::Apply(apply));
}

#[test]
fn until_released_is_written_as_null_and_what_was_left_out_is_not_written() {
    let text = request("x", &ForceParams::default()).unwrap();
    let text: Json = serde_json::from_slice(&text).unwrap();
    assert_eq!(text["params"], json!({"values": {}, "seconds": null}));
}

#[test]
fn each_method_is_known_by_its_name() {
    let names = [
        "describe", "signals", "get", "set", "force", "release", "forces", "undo", "journal",
        "alarms", "save", "apply",
    ];
    assert_eq!(Method::ALL.map(Method::as_str), names);
    let unparsed = refused(&asking("descibe", json!({})));
    assert_eq!((unparsed.id.as_deref(), unparsed.failure.code), (Some("7"), Code::UnknownMethod));
    assert!(unparsed.failure.message.contains("did you mean \"describe\"?"), "{unparsed:?}");
    let unparsed = refused(&asking("\u{1b}[2J", json!({})));
    assert!(unparsed.failure.message.contains("there is: describe, signals"), "{unparsed:?}");
    assert!(!unparsed.failure.message.contains('\u{1b}'));
}

#[test]
fn every_fault_of_the_parameters_is_found_and_none_is_passed_over() {
    let params = json!({"values": {"a": null, "b": [1], "c": 1, "d": "on"}, "att": 3, "at": -1,
        "comment": 7});
    let unparsed = refused(&asking("set", params));
    assert_eq!(unparsed.failure.code, Code::InvalidParams);
    assert_eq!(unparsed.id.as_deref(), Some("7"));
    assert_eq!(
        findings(&unparsed),
        [
            ("a", "\"a\" cannot be null"),
            ("b", "\"b\" cannot be [1]"),
            ("d", "\"d\" cannot be \"on\""),
            ("at", "\"at\" cannot be -1"),
            ("comment", "\"comment\" cannot be 7"),
            ("att", "there is no parameter \"att\""),
        ]
    );
    let help = |index: usize| unparsed.failure.findings[index].help.as_deref().unwrap();
    assert!(help(0).contains("give true, false, a number"), "{}", help(0));
    assert_eq!(help(3), "give a whole number from 0 on, without a decimal point");
    assert_eq!(help(5), "did you mean \"at\"?");
    assert!(unparsed.failure.message.ends_with("(and 5 more)"), "{}", unparsed.failure.message);
}

#[test]
fn values_that_no_signal_can_have_are_wrong_values() {
    let unparsed = refused(&asking("set", json!({"values": {"a": {"b": 1}}})));
    assert_eq!(unparsed.failure.code, Code::WrongValue);
    // JSON has the number; an LREAL does not.
    let text = r#"{"jsonrpc":"2.0","id":"7","method":"set","params":{"values":{"a":1e999}}}"#;
    assert_eq!(refused(text).failure.code, Code::WrongValue);
    assert_eq!(findings(&refused(text)), [("a", "\"a\" cannot be 1e999")]);
}

#[test]
fn parameters_that_are_missing_or_of_another_kind_are_named() {
    for (method, params, name) in [
        ("set", json!({}), "values"),
        ("get", json!({"names": "a"}), "names"),
        ("get", json!({"names": [1]}), "names"),
        ("force", json!({"values": {}}), "seconds"),
        ("force", json!({"values": {}, "seconds": "2"}), "seconds"),
        ("undo", json!({"transaction": 1.5}), "transaction"),
        ("signals", json!({"limit": 18446744073709551616.0}), "limit"),
        ("apply", json!({"configuration": null}), "configuration"),
        ("describe", json!({"verbose": true}), "verbose"),
        ("release", json!({"values": {}, "names": []}), "values"),
    ] {
        let unparsed = refused(&asking(method, params));
        assert_eq!(unparsed.failure.code, Code::InvalidParams, "{method}");
        assert_eq!(findings(&unparsed)[0].0, name, "{method}: {unparsed:?}");
    }
    for params in [json!([1]), json!("a"), json!(null), json!(1)] {
        let unparsed = refused(&asking("get", params));
        assert!(unparsed.failure.message.contains("no object"), "{unparsed:?}");
        assert_eq!(unparsed.id.as_deref(), Some("7"));
    }
}

#[test]
fn a_parameter_that_is_given_twice_is_refused_and_a_name_that_is_comes_twice() {
    let text =
        r#"{"jsonrpc":"2.0","id":"7","method":"undo","params":{"transaction":1,"transaction":2}}"#;
    assert_eq!(findings(&refused(text)), [("transaction", "\"transaction\" is given twice")]);
    let text = r#"{"jsonrpc":"2.0","id":"7","method":"set","params":{"values":{"a":1,"a":2}}}"#;
    let Call::Set(set) = parsed(text).call else { unreachable!() };
    assert_eq!(set.values, [("a", 1), ("a", 2)].into_iter().collect());
}

#[test]
fn integers_and_numbers_come_through_exactly() {
    let text = r#"{"jsonrpc":"2.0","id":"7","method":"set","params":{"at":18446744073709551615,
        "values":{"a":9223372036854775807,"b":-9223372036854775808,"c":0.1,
        "d":4.9e-324,"e":1.7976931348623157e308,"f":9007199254740993,"g":-0.0}}}"#;
    let Call::Set(set) = parsed(text).call else { unreachable!() };
    assert_eq!(set.at, Some(u64::MAX));
    assert_eq!(set.values.get("a"), Some(Value::Integer(i64::MAX)));
    assert_eq!(set.values.get("b"), Some(Value::Integer(i64::MIN)));
    assert_eq!(set.values.get("d"), Some(Value::Number(f64::from_bits(1))));
    assert_eq!(set.values.get("e"), Some(Value::Number(f64::MAX)));
    assert_eq!(set.values.get("f"), Some(Value::Integer(9_007_199_254_740_993)));
    let Some(Value::Number(zero)) = set.values.get("g") else { unreachable!() };
    assert!(zero == 0.0 && zero.is_sign_negative());
}

#[test]
fn whatever_is_no_request_is_answered_with_its_id_where_one_can_be_known() {
    use Code::{InvalidRequest, Parse};
    for (text, id, code, part) in [
        ("", None, Parse, "no JSON"),
        ("nonsense", None, Parse, "no JSON"),
        ("{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"met", Some("7"), Parse, "no JSON"),
        ("{\"id\":\"7\"", Some("7"), Parse, "no JSON"),
        ("{\"id\":\"7", None, Parse, "no JSON"),
        ("{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"get\"} x", Some("7"), Parse, "trailing"),
        ("[]", None, InvalidRequest, "batches"),
        (
            "[{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"describe\"}]",
            None,
            InvalidRequest,
            "batches",
        ),
        ("3", None, InvalidRequest, "a request is an object"),
        ("null", None, InvalidRequest, "a request is an object"),
        ("{}", None, InvalidRequest, "\"jsonrpc\" must be \"2.0\""),
        ("{\"id\":\"7\",\"method\":\"describe\"}", Some("7"), InvalidRequest, "\"jsonrpc\""),
        (
            "{\"jsonrpc\":\"1.0\",\"id\":\"7\",\"method\":\"describe\"}",
            Some("7"),
            InvalidRequest,
            "\"jsonrpc\"",
        ),
        (
            "{\"jsonrpc\":2.0,\"id\":\"7\",\"method\":\"describe\"}",
            Some("7"),
            InvalidRequest,
            "\"jsonrpc\"",
        ),
        ("{\"jsonrpc\":\"2.0\",\"method\":\"describe\"}", None, InvalidRequest, "\"id\""),
        ("{\"jsonrpc\":\"2.0\",\"id\":7,\"method\":\"describe\"}", None, InvalidRequest, "\"id\""),
        (
            "{\"jsonrpc\":\"2.0\",\"id\":null,\"method\":\"describe\"}",
            None,
            InvalidRequest,
            "\"id\"",
        ),
        (
            "{\"jsonrpc\":\"2.0\",\"id\":\"\",\"method\":\"describe\"}",
            None,
            InvalidRequest,
            "\"id\"",
        ),
        ("{\"jsonrpc\":\"2.0\",\"id\":\"7\"}", Some("7"), InvalidRequest, "\"method\""),
        (
            "{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":1}",
            Some("7"),
            InvalidRequest,
            "\"method\"",
        ),
        (
            "{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"id\":\"8\",\"method\":\"describe\"}",
            Some("7"),
            InvalidRequest,
            "\"id\" is given twice",
        ),
        (
            "{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"release\",\"parms\":{}}",
            Some("7"),
            InvalidRequest,
            "no member \"parms\"",
        ),
    ] {
        let unparsed = refused(text);
        assert_eq!(unparsed.id.as_deref(), id, "{text}");
        assert_eq!(unparsed.failure.code, code, "{text}: {unparsed:?}");
        assert!(unparsed.failure.message.contains(part), "{text}: {}", unparsed.failure.message);
    }
}

#[test]
fn an_id_has_at_most_128_bytes() {
    let asking = |id: &str| json!({"jsonrpc": "2.0", "id": id, "method": "describe"}).to_string();
    let longest = "é".repeat(MAX_ID_BYTES / 2);
    assert_eq!(parsed(&asking(&longest)).id, longest);
    assert_eq!(refused(&asking(&(longest + "x"))).failure.code, Code::InvalidRequest);
}

#[test]
fn bytes_that_are_no_text_are_answered() {
    let mut bytes = asking("get", json!({"names": ["aXb"]})).into_bytes();
    let place = bytes.iter().position(|byte| *byte == b'X').unwrap();
    bytes[place] = 0xff;
    let unparsed = parse(&bytes).unwrap_err();
    assert_eq!((unparsed.id.as_deref(), unparsed.failure.code), (Some("7"), Code::Parse));
    assert_eq!(unparsed.failure.message, format!("byte {place} is no UTF-8 text"));
    // Half a surrogate is no text either, though its escape is.
    let text = r#"{"jsonrpc":"2.0","id":"7","method":"get","params":{"names":["\ud800"]}}"#;
    assert_eq!(refused(text).failure.code, Code::InvalidParams);
}

#[test]
fn deep_nesting_is_refused_with_the_id() {
    for (open, close) in [("[", "]"), ("{\"a\":", "}")] {
        let deep = open.repeat(40_000) + "1" + &close.repeat(40_000);
        let text =
            format!("{{\"jsonrpc\":\"2.0\",\"id\":\"7\",\"method\":\"get\",\"params\":{deep}}}");
        assert!(text.len() < MAX_MESSAGE_BYTES);
        assert_eq!(refused(&text).id.as_deref(), Some("7"));
        let text = asking("set", json!({"values": {"a": 0}})).replace('0', "X");
        let text = text.replace("2.X", "2.0").replace('X', &deep);
        let unparsed = refused(&text);
        assert_eq!((unparsed.id.as_deref(), unparsed.failure.code), (Some("7"), Code::WrongValue));
        // Not even what is around them.
        assert!(refused(&deep).failure.message.len() < 1000);
    }
}

#[test]
fn a_request_may_have_256_kib_and_no_byte_more() {
    let around = asking("apply", json!({"configuration": ""})).len();
    let sized =
        |length: usize| asking("apply", json!({"configuration": "x".repeat(length - around)}));
    assert_eq!(parsed(&sized(MAX_MESSAGE_BYTES)).id, "7");
    let unparsed = refused(&sized(MAX_MESSAGE_BYTES + 1));
    assert_eq!(unparsed.id.as_deref(), Some("7"));
    assert!(unparsed.failure.message.contains("262145 bytes; at most 262144"), "{unparsed:?}");
    let much = "x".repeat(4 * MAX_MESSAGE_BYTES);
    assert_eq!(refused(&much).failure.code, Code::InvalidRequest);
    let params = ApplyParams { configuration: much, ..ApplyParams::default() };
    assert!(request("7", &params).unwrap_err().message.contains("divide it"));
}

#[test]
fn an_answer_has_the_id_and_a_result_or_an_error_with_all_findings() {
    let result = SignalsResult { total: 0, signals: Vec::new() };
    let text: Json = serde_json::from_slice(&answer(Some("7"), Ok(&result))).unwrap();
    let expected = json!({"jsonrpc": "2.0", "id": "7", "result": {"total": 0, "signals": []}});
    assert_eq!(text, expected);
    // A reply is the result of its method, with nothing around it.
    assert_eq!(answer(Some("7"), Ok(&Reply::Signals(result))), text.to_string().into_bytes());
    let failure = Failure::of(
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
    let failure = Failure::of(Code::UnknownName, (0..10_000).map(finding).collect());
    let text = answer::<Reply>(Some("7"), Err(&failure));
    assert!(text.len() <= MAX_MESSAGE_BYTES);
    let text: Json = serde_json::from_slice(&text).unwrap();
    let shown = text["error"]["data"].as_array().unwrap().len();
    assert!((3000..10_000).contains(&shown), "{shown}");
    let message = text["error"]["message"].as_str().unwrap();
    assert!(message.ends_with(&format!("of 10000 findings the first {shown} are in this answer")));

    let failure = Failure::new(Code::Internal, "x".repeat(MAX_MESSAGE_BYTES));
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_bytes_whatever_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        check(&bytes);
    }

    #[test]
    fn no_text_of_json_signs_makes_it_panic(text in "[\\[\\]{}:,\"0-9eE.+-truefalsn \\\\u]{0,200}") {
        check(text.as_bytes());
    }

    /// A request of which bytes are lost, changed or doubled.
    #[test]
    fn a_damaged_request_is_a_request_or_has_an_answer(
        which in 0..DAMAGED.len(),
        cut in any::<prop::sample::Index>(),
        end in any::<prop::sample::Index>(),
        byte in any::<u8>(),
        how in 0..4,
    ) {
        let mut bytes = DAMAGED[which].as_bytes().to_vec();
        let place = cut.index(bytes.len());
        match how {
            0 => bytes.truncate(place),
            1 => bytes[place] = byte,
            2 => bytes.insert(place, byte),
            _ => {
                let (from, to) = (place.min(end.index(bytes.len())), place.max(end.index(bytes.len())));
                let doubled = bytes[from..to].to_vec();
                bytes.splice(to..to, doubled);
            }
        }
        check(&bytes);
        // The id comes first: a text that goes on after it tells whom to answer.
        if how == 0 && place > DAMAGED[which].find("\"7\"").unwrap() + 3 {
            let unparsed = parse(&bytes).unwrap_err();
            prop_assert_eq!(unparsed.id.as_deref(), Some("7"));
        }
    }

    #[test]
    fn every_json_document_is_a_request_or_has_an_answer(document in documents()) {
        check(document.to_string().as_bytes());
        for method in Method::ALL {
            let text = asking(method.as_str(), document.clone());
            check(text.as_bytes());
            if let Err(unparsed) = parse(text.as_bytes()) {
                prop_assert_eq!(unparsed.id.as_deref(), Some("7"));
            }
        }
    }

    #[test]
    fn every_number_comes_through_as_it_is(bits in any::<u64>(), integer in any::<i64>()) {
        let number = f64::from_bits(bits);
        let values: Values =
            [("a", Value::Number(number)), ("b", Value::Integer(integer))].into_iter().collect();
        let text = request("7", &SetParams { values, ..SetParams::default() }).unwrap();
        let Call::Set(set) = parse(&text).unwrap().call else { unreachable!() };
        prop_assert_eq!(set.values.get("b"), Some(Value::Integer(integer)));
        let Some(Value::Number(read)) = set.values.get("a") else { unreachable!() };
        prop_assert!(read.to_bits() == bits || (read.is_nan() && number.is_nan()));
    }
}

const DAMAGED: [&str; 3] = [
    r#"{"id":"7","jsonrpc":"2.0","method":"set","params":{"values":{"a.b":1.5,"c":true},"at":12,"comment":"é\n"}}"#,
    r#"{"id":"7","jsonrpc":"2.0","method":"get","params":{"names":["a.*","b"],"offset":0,"limit":10}}"#,
    r#"{"id":"7","jsonrpc":"2.0","method":"force","params":{"values":{"a":"-inf"},"seconds":null}}"#,
];

/// Any JSON, with the names that the protocol knows among its keys.
fn documents() -> impl Strategy<Value = Json> {
    let key = prop_oneof![
        prop::sample::select(vec![
            "id",
            "jsonrpc",
            "method",
            "params",
            "values",
            "names",
            "at",
            "seconds",
            "limit",
            "offset",
            "match",
            "transaction",
            "configuration",
            "dry_run",
            "since",
            "comment",
        ])
        .prop_map(str::to_owned),
        ".{0,8}",
    ];
    let leaf = prop_oneof![
        Just(Json::Null),
        any::<bool>().prop_map(Json::from),
        any::<i64>().prop_map(Json::from),
        any::<u64>().prop_map(Json::from),
        any::<f64>().prop_map(Json::from),
        ".{0,12}".prop_map(Json::from),
    ];
    leaf.prop_recursive(4, 32, 6, move |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..6).prop_map(Json::from),
            prop::collection::vec((key.clone(), inner), 0..6)
                .prop_map(|entries| Json::Object(entries.into_iter().collect())),
        ]
    })
}

/// Whatever the bytes are: a request, or a refusal that can be answered.
fn check(bytes: &[u8]) {
    match parse(bytes) {
        Ok(parsed) => assert!(!parsed.id.is_empty()),
        Err(unparsed) => {
            assert!(!unparsed.failure.message.is_empty());
            let text = answer::<Reply>(unparsed.id.as_deref(), Err(&unparsed.failure));
            assert!(text.len() <= MAX_MESSAGE_BYTES);
            let text: Json = serde_json::from_slice(&text).unwrap();
            assert_eq!(text["jsonrpc"], "2.0");
            assert_eq!(text["id"], unparsed.id.map_or(Json::Null, Json::from));
            assert!(text["error"]["code"].is_i64());
        }
    }
}
