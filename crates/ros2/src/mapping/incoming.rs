//! A message as values of a frame.

use std::sync::Arc;

use isochrone_ipc::SignalSpec;
use isochrone_recording::message::{
    BaseType, DefinitionError, Extent, FieldPath, MessageNumbers, MessageType, RosValue, decode,
    stamp_of, stamped_unix_ns, value_type,
};
use isochrone_recording::{ByteOrder, CdrError};

/// How a frame is made of a message.
#[derive(Debug, Clone)]
pub(crate) struct Incoming {
    pub(crate) message: Arc<MessageType>,
    /// The channels of the frame.
    pub(crate) signals: Vec<SignalSpec>,
    places: Vec<Place>,
    /// The fields as they were written.
    fields: Vec<String>,
    stamp: Option<FieldPath>,
    /// Elements are found by these names in this field.
    names: Option<(FieldPath, Vec<String>)>,
}

/// Where a value comes from.
#[derive(Debug, Clone)]
enum Place {
    Field(FieldPath),
    /// Of the element with the name of this index.
    Named(FieldPath, usize),
}

/// Why a message becomes no frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Misfit {
    /// Its bytes are none of its type.
    Encoding(CdrError),
    /// A value is NaN.
    NotANumber(Value),
    /// It lacks an element, or one of a name.
    Missing(Value),
}

impl std::fmt::Display for Misfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Encoding(error) => write!(f, "it is none of its type: {error}"),
            Self::NotANumber(value) => write!(f, "{value} is NaN"),
            Self::Missing(value) => write!(f, "it has no {value}"),
        }
    }
}

/// A value as people know it: by its field in the message, and by its signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Value {
    field: String,
    signal: String,
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (signal {})", self.field, self.signal)
    }
}

/// What a message says.
pub(crate) struct Read {
    pub(crate) values: Vec<f64>,
    /// The time in its header, in Unix ns.
    pub(crate) stamp_unix_ns: Option<u64>,
}

impl Incoming {
    pub(crate) fn new(message: Arc<MessageType>) -> Self {
        let stamp = stamp_of(&message);
        Self {
            message,
            signals: Vec::new(),
            places: Vec::new(),
            fields: Vec::new(),
            stamp,
            names: None,
        }
    }

    /// A channel for each single number of the message.
    pub(crate) fn of_all(message: Arc<MessageType>) -> Result<Self, DefinitionError> {
        let mut incoming = Self::new(message);
        let numbers = MessageNumbers::of(&incoming.message)?;
        for (path, signal) in numbers.paths.iter().zip(numbers.signals()) {
            incoming.field(path, &signal.name)?;
        }
        Ok(incoming)
    }

    /// Elements are found by names in `name`, `names` or `joint_names`, whichever the message has.
    pub(crate) fn name_elements(&mut self, names: Vec<String>) -> bool {
        let found = ["name", "names", "joint_names"].iter().find_map(|field| {
            let path = FieldPath::find(&self.message, field).ok()?;
            let field = path.field_type();
            let is_texts = matches!(field.base, BaseType::Text(_)) && field.extent != Extent::One;
            is_texts.then_some(path)
        });
        self.names = found.map(|path| (path, names));
        self.names.is_some()
    }

    /// Whether elements are found by names.
    pub(crate) fn finds_by_name(&self) -> bool {
        self.names.is_some()
    }

    /// A channel with the value of a field.
    pub(crate) fn field(&mut self, path: &str, signal: &str) -> Result<(), DefinitionError> {
        let field = path.to_owned();
        let path = FieldPath::find(&self.message, path)?;
        self.add(&path, field, signal);
        self.places.push(Place::Field(path));
        Ok(())
    }

    /// A channel with the value of a sequence's element of a name, by the index of that.
    pub(crate) fn named(
        &mut self,
        path: &str,
        name: usize,
        signal: &str,
    ) -> Result<(), DefinitionError> {
        let names = self.names.as_ref().map(|(_, names)| &names[..]).unwrap_or_default();
        let of_name = names.get(name).map_or("", String::as_str);
        let field = format!("{} of {of_name:?}", path.trim_end_matches("[]"));
        let path = FieldPath::find(&self.message, path)?;
        self.add(&path, field, signal);
        self.places.push(Place::Named(path, name));
        Ok(())
    }

    fn add(&mut self, path: &FieldPath, field: String, signal: &str) {
        self.fields.push(field);
        self.signals.push(SignalSpec::new(signal, value_type(path)));
    }

    /// What the body of a message says.
    pub(crate) fn read(&self, body: &[u8], order: ByteOrder) -> Result<Read, Misfit> {
        let message = decode(&self.message, body, order).map_err(Misfit::Encoding)?;
        let positions = self.positions(&message);
        let mut values = Vec::with_capacity(self.places.len());
        for (index, place) in self.places.iter().enumerate() {
            let value = match place {
                Place::Field(path) => path.number(&message),
                Place::Named(path, name) => positions
                    .get(*name)
                    .copied()
                    .flatten()
                    .and_then(|position| path.numbers(&message)?.get(position).copied()),
            };
            match value {
                None => return Err(Misfit::Missing(self.value(index))),
                Some(value) if value.is_nan() => return Err(Misfit::NotANumber(self.value(index))),
                Some(value) => values.push(value),
            }
        }
        let stamp = self.stamp.as_ref().and_then(|stamp| stamp.value(&message));
        Ok(Read { values, stamp_unix_ns: stamp.and_then(stamped_unix_ns) })
    }

    fn value(&self, index: usize) -> Value {
        Value { field: self.fields[index].clone(), signal: self.signals[index].name.clone() }
    }

    /// Where the named elements stand in this message.
    fn positions(&self, message: &RosValue) -> Vec<Option<usize>> {
        let Some((path, names)) = &self.names else { return Vec::new() };
        let given = path.value(message).map(RosValue::parts).unwrap_or_default();
        let position = |name: &String| given.iter().position(|given| given.text() == Some(&**name));
        names.iter().map(position).collect()
    }
}
