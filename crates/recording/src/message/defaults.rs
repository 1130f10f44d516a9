//! Messages before anything is put into them.

use super::{BaseType, Extent, FieldType, MessageField, MessageType, RosValue};

impl RosValue {
    /// A message with the defaults of its definition.
    pub fn of(message: &MessageType) -> Self {
        let of_field = |field: &MessageField| {
            field.default.clone().unwrap_or_else(|| Self::of_field(&field.field_type))
        };
        Self::Message(message.fields.iter().map(of_field).collect())
    }

    /// Zero, an empty text, no element.
    fn of_field(field: &FieldType) -> Self {
        let count = match field.extent {
            Extent::One => return Self::of_base(&field.base),
            Extent::Array(count) => count,
            Extent::Sequence(_) => 0,
        };
        match &field.base {
            BaseType::Primitive(primitive) if !primitive.is_wide() => {
                Self::Numbers(vec![0.0; count])
            }
            base => Self::Several(vec![Self::of_base(base); count]),
        }
    }

    /// The same of one element.
    pub(crate) fn of_base(base: &BaseType) -> Self {
        match base {
            BaseType::Primitive(primitive) if primitive.is_wide() => Self::Integer(0),
            BaseType::Primitive(_) => Self::Number(0.0),
            BaseType::Text(_) => Self::Text(String::new()),
            BaseType::Message(message) => Self::of(message),
        }
    }
}
