//! Requests for each method, with parameters that fit and that do not.

use isochrone_control::{
    ApplyParams, At, Call, Code, DescribeParams, ForceParams, GetParams, Hold, JournalParams,
    Method, Params, Parsed, ReleaseParams, SetParams, SignalsParams, TraceParams, UndoParams,
    Value, Values, Written, parse, request,
};
use serde_json::{Value as Json, json};

use super::{asking, findings, parsed, refused};

#[test]
fn a_request_has_an_id_a_method_and_its_parameters() {
    let text = r#"{"jsonrpc": "2.0", "id": "a-1", "method": "describe"}"#;
    assert_eq!(parsed(text).id, "a-1");
    assert_eq!(parsed(text).call, Call::Describe(DescribeParams {}));
    let text = r#" {"params": {"names": ["a.*"]}, "method": "get", "id": "é", "jsonrpc": "2.0"} "#;
    let names = vec!["a.*".to_owned()];
    let get = GetParams { names, ..GetParams::default() };
    assert_eq!(parsed(text), Parsed { id: "é".to_owned(), call: Call::Get(get) });
}

#[test]
fn what_a_client_writes_is_what_a_node_reads() {
    fn check<P: Params>(params: P, call: Call) {
        let text = request("x", &params).unwrap();
        assert_eq!(parse(&text), Ok(Parsed { id: "x".to_owned(), call }));
        assert_eq!(parse(&text).unwrap().call.method(), P::METHOD);
    }
    let values: Values<Written> =
        [("a", Written::from(0.1)), ("b", true.into()), ("c", "16#8F00".into())]
            .into_iter()
            .collect();
    let at = Some(u64::MAX.into());
    let set = SetParams { values: values.clone(), at, ..SetParams::default() };
    check(set.clone(), Call::Set(set.clone()));
    let ahead = SetParams { at: Some(At::In(500)), ..set };
    check(ahead.clone(), Call::Set(ahead));
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
    let trace = TraceParams { signals: Some(vec!["a.*".into()]), ..TraceParams::default() };
    check(trace.clone(), Call::Trace(trace));
    let end = TraceParams { id: Some("0-1".into()), end: Some(true), ..TraceParams::default() };
    check(end.clone(), Call::Trace(end));
}

#[test]
fn until_released_is_written_as_null_and_what_was_left_out_is_not_written() {
    let text = request("x", &ForceParams::default()).unwrap();
    let text: Json = serde_json::from_slice(&text).unwrap();
    assert_eq!(text["params"], json!({"values": {}, "seconds": null}));
}

#[test]
fn each_method_is_known_by_its_name() {
    for method in Method::ALL {
        // Some lack a parameter.
        match parse(asking(method.as_str(), json!({})).as_bytes()) {
            Ok(parsed) => assert_eq!(parsed.call.method(), method),
            Err(unparsed) => assert_eq!(unparsed.failure.code, Code::InvalidParams, "{method:?}"),
        }
    }
    let unparsed = refused(&asking("descibe", json!({})));
    assert_eq!((unparsed.id.as_deref(), unparsed.failure.code), (Some("7"), Code::UnknownMethod));
    assert!(unparsed.failure.message.contains("did you mean \"describe\"?"), "{unparsed:?}");
    let unparsed = refused(&asking("\u{1b}[2J", json!({})));
    let all = format!("there is: {}", Method::ALL.map(Method::as_str).join(", "));
    assert!(unparsed.failure.message.contains(&all), "{unparsed:?}");
    assert!(!unparsed.failure.message.contains('\u{1b}'));
}

#[test]
fn every_fault_of_the_parameters_is_found_and_none_is_passed_over() {
    let params = json!({"values": {"a": null, "b": [1], "c": 1, "d": "on", "e": {}}, "att": 3, "at": -1,
        "comment": 7});
    let unparsed = refused(&asking("set", params));
    assert_eq!(unparsed.failure.code, Code::InvalidParams);
    assert_eq!(unparsed.id.as_deref(), Some("7"));
    assert_eq!(
        findings(&unparsed),
        [
            ("a", "\"a\" cannot be null"),
            ("b", "\"b\" cannot be [1]"),
            ("e", "\"e\" cannot be {}"),
            ("at", "\"at\" cannot be -1"),
            ("comment", "\"comment\" cannot be 7"),
            ("att", "there is no parameter \"att\""),
        ]
    );
    let help = |index: usize| unparsed.failure.findings[index].help.as_deref().unwrap();
    assert!(help(0).contains("give true, false, a number"), "{}", help(0));
    assert!(help(3).contains("give a whole number, the cycle"), "{}", help(3));
    assert_eq!(help(5), "did you mean \"at\"?");
    assert!(unparsed.failure.message.ends_with("(and 5 more)"), "{}", unparsed.failure.message);
}

#[test]
fn a_string_is_a_value_as_it_is_written_and_the_node_that_has_the_signal_reads_it() {
    let params = json!({"values": {"a": "on", "b": "NaN", "c": "10ms", "d": 5}, "at": "+50"});
    let Call::Set(set) = parsed(&asking("set", params)).call else { unreachable!() };
    let written = |name: &str| set.values.get(name).unwrap();
    assert_eq!(["a", "b", "c"].map(written), ["on", "NaN", "10ms"].map(Written::from));
    assert_eq!((written("d"), set.at), (5.into(), Some(At::In(50))));
    let unparsed = refused(&asking("set", json!({"values": {}, "at": "soon"})));
    assert_eq!(findings(&unparsed), [("at", "\"at\" cannot be \"soon\"")]);
    let help = unparsed.failure.findings[0].help.as_deref();
    let expected = "give a whole number, the cycle, or a string such as \"+500\": in 500 cycles";
    assert_eq!(help, Some(expected));
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
    assert_eq!(set.at, Some(u64::MAX.into()));
    assert_eq!(set.values.get("a"), Some(Value::Integer(i64::MAX).into()));
    assert_eq!(set.values.get("b"), Some(Value::Integer(i64::MIN).into()));
    assert_eq!(set.values.get("d"), Some(Value::Number(f64::from_bits(1)).into()));
    assert_eq!(set.values.get("e"), Some(Value::Number(f64::MAX).into()));
    assert_eq!(set.values.get("f"), Some(Value::Integer(9_007_199_254_740_993).into()));
    let Some(Written::Value(Value::Number(zero))) = set.values.get("g") else { unreachable!() };
    assert!(zero == 0.0 && zero.is_sign_negative());
}
