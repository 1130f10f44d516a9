//! A frame as one JSON object, for scripts.

use isochrone_control::Value;
use isochrone_ipc::Receipt;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use super::channel::Channel;
use crate::base::numbers::type_of;

/// A frame and the signals of it that are wanted.
#[derive(Serialize)]
pub(super) struct Object<'a> {
    sequence: u64,
    cycle: u64,
    publish_ns: u64,
    /// `None` where the stamps are of another clock.
    age_ns: Option<u64>,
    flags: Vec<String>,
    values: Values<'a>,
}

impl<'a> Object<'a> {
    pub(super) fn new(receipt: &Receipt, values: &'a [f64], channels: &'a [Channel]) -> Self {
        let header = &receipt.header;
        Self {
            sequence: header.sequence,
            cycle: header.cycle,
            publish_ns: header.publish_ns,
            age_ns: receipt.age_ns(),
            flags: header.flags().words().collect(),
            values: Values { channels, values },
        }
    }
}

/// Values by name, in the order of the signals.
struct Values<'a> {
    channels: &'a [Channel],
    values: &'a [f64],
}

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.channels.len()))?;
        for channel in self.channels {
            let value = self.values.get(channel.place);
            let value = value.map(|value| typed(*value, &channel.value_type));
            map.serialize_entry(&channel.name, &value)?;
        }
        map.end()
    }
}

/// A value as its type has it. What the type cannot hold stands as the number that it is.
fn typed(value: f64, value_type: &str) -> Value {
    match type_of(value_type) {
        value_type if value_type.holds(value) => Value::of(value, value_type),
        _ => Value::Number(value),
    }
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::{Flags, FrameHeader, Stamps};

    use super::*;

    #[test]
    fn a_frame_is_an_object_with_what_it_is_worth() {
        let flags = (Flags::STALE | Flags::STOPPED).bits();
        let header =
            FrameHeader { sequence: 7, cycle: 9, publish_ns: 800, flags, ..FrameHeader::default() };
        let channel = |place, name: &str, value_type: &str| {
            let (name, value_type) = (name.to_owned(), value_type.to_owned());
            Channel { place, name, value_type, unit: String::new() }
        };
        let channels = [
            channel(1, "b", "BOOL"),
            channel(0, "x", "LREAL"),
            channel(2, "i", "INT"),
            channel(3, "broken", "INT"),
            channel(9, "missing", "LREAL"),
        ];
        let values = [f64::NAN, 1.0, -5.0, 1.5];
        let mut receipt = Receipt { header, received_ns: 900, ..Receipt::default() };
        let text = |receipt: &Receipt| {
            serde_json::to_string(&Object::new(receipt, &values, &channels)).unwrap()
        };
        assert_eq!(
            text(&receipt),
            r#"{"sequence":7,"cycle":9,"publish_ns":800,"age_ns":100,"flags":["STALE","STOPPED"],"values":{"b":true,"x":"NaN","i":-5,"broken":1.5,"missing":null}}"#
        );
        receipt.stamps = Stamps::Foreign;
        assert!(text(&receipt).contains(r#""age_ns":null"#), "another clock");
    }
}
