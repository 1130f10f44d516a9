//! Messages of ROS 2: the text of a definition, a zero, the order of the bytes, and the body of a message.

use isochrone_recording::ByteOrder;
use isochrone_recording::message::{Definitions, MessageNumbers, RosValue, decode, encode};

use crate::{Target, assert_sentence};

/// A body takes some dozen times its length, and a definition a message with the default of each field.
pub(crate) const TARGET: Target = Target { name: "messages", max_bytes: 4096, max_mib: 256, read };

fn read(bytes: &[u8]) {
    let (text, body) =
        bytes.split_at(bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len()));
    let Ok(text) = std::str::from_utf8(text) else { return };
    let definitions = match Definitions::of_schema("fuzz_msgs/msg/Fuzz", text) {
        Ok(definitions) => definitions,
        Err(refused) => return assert_sentence(&refused.to_string()),
    };
    let message = match definitions.find("fuzz_msgs/Fuzz") {
        Ok(message) => message,
        Err(refused) => return assert_sentence(&refused.to_string()),
    };
    let numbers = MessageNumbers::of(&message);
    let check = |value: &RosValue| {
        let Ok(numbers) = &numbers else { return };
        let mut values = Vec::new();
        match numbers.read(value, &mut values) {
            Ok(()) => assert_eq!(values.len(), numbers.paths.len()),
            Err(refused) => assert_sentence(&refused.to_string()),
        }
        assert_eq!(numbers.signals().len(), numbers.paths.len());
        let _ = numbers.stamp_unix_ns(value);
    };
    if let Err(refused) = &numbers {
        assert_sentence(&refused.to_string());
    }
    let empty = RosValue::of(&message);
    check(&empty);
    if let Ok(body) = encode(&message, &empty) {
        assert_same(&decode(&message, &body, ByteOrder::Little).expect("what it wrote"), &empty);
    }
    let [_, order, body @ ..] = body else { return };
    let order = if *order % 2 == 0 { ByteOrder::Little } else { ByteOrder::Big };
    match decode(&message, body, order) {
        Ok(value) => {
            check(&value);
            let again = encode(&message, &value).expect("what was read can be written");
            let again = decode(&message, &again, ByteOrder::Little).expect("what it wrote");
            assert_same(&again, &value);
        }
        Err(refused) => assert_sentence(&refused.to_string()),
    }
}

/// A NaN is itself here.
fn assert_same(a: &RosValue, b: &RosValue) {
    assert!(a == b || format!("{a:?}") == format!("{b:?}"), "{a:?} was {b:?}");
}
