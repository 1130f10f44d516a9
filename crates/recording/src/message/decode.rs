//! Values from CDR, whatever the bytes are.

use super::{BaseType, Extent, FieldType, MessageType, Primitive, RosValue};
use crate::cdr::{ByteOrder, CdrError, CdrReader};

/// Most bytes behind the last field: some writers fill up to a multiple of four.
const MOST_FILLING: usize = 3;

/// The value of a message from its body, without its encapsulation.
///
/// # Errors
/// It is none of this type: the field, and what is wrong. What a length claims is compared with the bytes that are
/// there before any memory is taken for it.
pub fn decode(message: &MessageType, body: &[u8], order: ByteOrder) -> Result<RosValue, CdrError> {
    let mut from = CdrReader::new(body, order);
    let value = read_message(message, &mut from)?;
    match from.rest().len() {
        0..=MOST_FILLING => Ok(value),
        left => Err(CdrError::new(format!("{left} bytes more than a {} has", message.name))),
    }
}

fn read_message(message: &MessageType, from: &mut CdrReader<'_>) -> Result<RosValue, CdrError> {
    let mut fields = Vec::with_capacity(message.fields.len());
    for field in &message.fields {
        fields
            .push(read_field(&field.field_type, from).map_err(|error| error.within(&field.name))?);
    }
    if fields.is_empty() {
        from.number::<1>()?;
    }
    Ok(RosValue::Message(fields))
}

fn read_field(field: &FieldType, from: &mut CdrReader<'_>) -> Result<RosValue, CdrError> {
    let least = field.base.least_bytes();
    let count = match field.extent {
        Extent::One => return read_element(&field.base, from),
        Extent::Array(count) if count > from.rest().len() / least.max(1) => {
            let left = from.rest().len();
            return Err(CdrError::new(format!("{count} elements do not fit into {left} bytes")));
        }
        Extent::Array(count) => count,
        Extent::Sequence(most) => {
            let count = from.count(least)?;
            if most.is_some_and(|most| count > most) {
                return Err(CdrError::new(format!("{count} elements are no {field}")));
            }
            count
        }
    };
    let at = |index: usize, error: CdrError| error.within(&format!("[{index}]"));
    match &field.base {
        BaseType::Primitive(primitive) if !primitive.is_wide() => {
            let number = |index| read_number(*primitive, from).map_err(|error| at(index, error));
            (0..count).map(number).collect::<Result<_, _>>().map(RosValue::Numbers)
        }
        base => {
            let element = |index| read_element(base, from).map_err(|error| at(index, error));
            (0..count).map(element).collect::<Result<_, _>>().map(RosValue::Several)
        }
    }
}

fn read_element(base: &BaseType, from: &mut CdrReader<'_>) -> Result<RosValue, CdrError> {
    match base {
        BaseType::Primitive(Primitive::Int64) => {
            from.u64().map(|number| RosValue::Integer(number.cast_signed().into()))
        }
        BaseType::Primitive(Primitive::UInt64) => {
            from.u64().map(|number| RosValue::Integer(number.into()))
        }
        BaseType::Primitive(primitive) => read_number(*primitive, from).map(RosValue::Number),
        BaseType::Text(most) => {
            let text = from.text()?;
            if text.contains('\0') {
                return Err(CdrError::new("a zero stands within the text"));
            }
            if most.is_some_and(|most| text.len() > most) {
                return Err(CdrError::new(format!("{} bytes are no {base}", text.len())));
            }
            Ok(RosValue::Text(text.to_owned()))
        }
        BaseType::Message(message) => read_message(message, from),
    }
}

fn read_number(primitive: Primitive, from: &mut CdrReader<'_>) -> Result<f64, CdrError> {
    Ok(match primitive {
        Primitive::Bool => match from.number()? {
            [0] => 0.0,
            [1] => 1.0,
            [other] => return Err(CdrError::new(format!("{other} is no bool"))),
        },
        Primitive::Int8 => i8::from_le_bytes(from.number()?).into(),
        Primitive::UInt8 => u8::from_le_bytes(from.number()?).into(),
        Primitive::Int16 => i16::from_le_bytes(from.number()?).into(),
        Primitive::UInt16 => u16::from_le_bytes(from.number()?).into(),
        Primitive::Int32 => i32::from_le_bytes(from.number()?).into(),
        Primitive::UInt32 => u32::from_le_bytes(from.number()?).into(),
        Primitive::Int64 => from.u64()?.cast_signed() as f64,
        Primitive::UInt64 => from.u64()? as f64,
        Primitive::Float32 => f32::from_le_bytes(from.number()?).into(),
        Primitive::Float64 => f64::from_le_bytes(from.number()?),
    })
}
