//! Values of a frame as a message.

use std::sync::Arc;

use isochrone_recording::CdrError;
use isochrone_recording::message::{
    BaseType, DefinitionError, Extent, FieldPath, MessageType, Primitive, RosValue, encode,
    stamp_of,
};

/// How messages are made of the values of signals.
#[derive(Debug, Clone)]
pub(crate) struct Outgoing {
    pub(crate) message: Arc<MessageType>,
    /// The signals in the order in which their values are given.
    pub(crate) signals: Vec<String>,
    places: Vec<Place>,
    stamp: Option<FieldPath>,
    /// The message with its constants.
    template: RosValue,
}

/// Where values go.
#[derive(Debug, Clone)]
enum Place {
    /// One value to one field.
    One(FieldPath, usize),
    /// Several to a sequence.
    Several(FieldPath, Vec<usize>),
}

impl Outgoing {
    pub(crate) fn new(message: Arc<MessageType>) -> Self {
        let template = RosValue::of(&message);
        let stamp = stamp_of(&message);
        Self { message, signals: Vec::new(), places: Vec::new(), stamp, template }
    }

    /// A field that always has this value.
    pub(crate) fn constant(&mut self, path: &str, value: RosValue) -> Result<(), DefinitionError> {
        let path = FieldPath::find(&self.message, path)?;
        self.make_room(&path);
        let is_set = match value {
            RosValue::Number(number) => path.set_number(&mut self.template, number),
            value => path.set(&mut self.template, value),
        };
        debug_assert!(is_set, "{path:?}");
        Ok(())
    }

    /// A field that has the value of a signal.
    pub(crate) fn signal(&mut self, path: &str, signal: &str) -> Result<(), DefinitionError> {
        let path = FieldPath::find(&self.message, path)?;
        self.make_room(&path);
        let index = self.index(signal);
        self.places.push(Place::One(path, index));
        Ok(())
    }

    /// A sequence that has the values of several signals.
    pub(crate) fn signals<'s>(
        &mut self,
        path: &str,
        signals: impl IntoIterator<Item = &'s str>,
    ) -> Result<(), DefinitionError> {
        let path = FieldPath::find(&self.message, path)?;
        let indices = signals.into_iter().map(|signal| self.index(signal)).collect();
        self.places.push(Place::Several(path, indices));
        Ok(())
    }

    fn index(&mut self, signal: &str) -> usize {
        let known = self.signals.iter().position(|known| known == signal);
        known.unwrap_or_else(|| {
            self.signals.push(signal.to_owned());
            self.signals.len() - 1
        })
    }

    /// Makes a sequence as long as its highest element that is named.
    fn make_room(&mut self, path: &FieldPath) {
        if let Some((whole, index)) = path.element_of_sequence() {
            let mut numbers = whole.numbers(&self.template).unwrap_or_default().to_vec();
            if numbers.len() <= index {
                numbers.resize(index + 1, 0.0);
                whole.set(&mut self.template, RosValue::Numbers(numbers));
            }
        }
    }

    /// The message of these values, with this Unix time in its header.
    pub(crate) fn encode(&self, values: &[f64], unix_ns: u64) -> Result<Vec<u8>, CdrError> {
        let mut value = self.template.clone();
        let of = |index: &usize| values.get(*index).copied().unwrap_or(f64::NAN);
        for place in &self.places {
            match place {
                Place::One(path, index) => {
                    path.set_number(&mut value, of(index));
                }
                Place::Several(path, indices) => {
                    path.set(&mut value, RosValue::Numbers(indices.iter().map(of).collect()));
                }
            }
        }
        if let Some(stamp) = &self.stamp {
            stamp.set(&mut value, time(unix_ns));
        }
        encode(&self.message, &value)
    }
}

/// A `builtin_interfaces/Time`.
pub(crate) fn time(unix_ns: u64) -> RosValue {
    let [seconds, nanoseconds] = [unix_ns / 1_000_000_000, unix_ns % 1_000_000_000];
    RosValue::Message(vec![RosValue::Number(seconds as f64), RosValue::Number(nanoseconds as f64)])
}

/// What may be put into a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Takes {
    Number(Primitive),
    Text,
    Numbers,
    Texts,
    Nothing,
}

/// What a path's field takes from the configuration.
pub(crate) fn takes(path: &FieldPath) -> Takes {
    let field = path.field_type();
    if path.is_of_sequence() && path.element_of_sequence().is_none() {
        return Takes::Nothing;
    }
    match (&field.base, field.extent) {
        (BaseType::Primitive(primitive), Extent::One) => Takes::Number(*primitive),
        (BaseType::Text(_), Extent::One) => Takes::Text,
        (BaseType::Primitive(Primitive::Int64 | Primitive::UInt64), _) => Takes::Nothing,
        (BaseType::Primitive(_), _) => Takes::Numbers,
        (BaseType::Text(_), _) => Takes::Texts,
        _ => Takes::Nothing,
    }
}
