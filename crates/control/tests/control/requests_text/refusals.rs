//! Texts that are no request.

use isochrone_control::{ApplyParams, Code, MAX_ID_BYTES, parse, request};
use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde_json::json;

use super::{asking, parsed, refused};

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
