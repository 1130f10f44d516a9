//! Texts that chance wrote.

use proptest::prelude::*;

use isochrone_control::{Call, Method, Reply, SetParams, Value, Written, answer, parse, request};
use isochrone_ipc::MAX_MESSAGE_BYTES;
use serde_json::Value as Json;

use super::asking;

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
        let values =
            [("a", Value::Number(number)), ("b", Value::Integer(integer))].into_iter().collect();
        let text = request("7", &SetParams { values, ..SetParams::default() }).unwrap();
        let Call::Set(set) = parse(&text).unwrap().call else { unreachable!() };
        prop_assert_eq!(set.values.get("b"), Some(Value::Integer(integer).into()));
        let read = match set.values.get("a") {
            Some(Written::Value(Value::Number(read))) => read,
            // What JSON has no number for.
            Some(Written::Text(text)) => text.parse().unwrap(),
            other => panic!("{other:?}"),
        };
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
