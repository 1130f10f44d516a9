//! Values as CDR.

use super::{BaseType, Extent, FieldType, MessageType, Primitive, RosValue};
use crate::cdr::{CdrError, CdrWriter};

/// The body of a message in CDR, little-endian, without its encapsulation.
///
/// # Errors
/// The value is none of this type: the field, and what is wrong.
pub fn encode(message: &MessageType, value: &RosValue) -> Result<Vec<u8>, CdrError> {
    let mut bytes = Vec::with_capacity(message.least_bytes);
    write_message(message, value, &mut CdrWriter::new(&mut bytes))?;
    Ok(bytes)
}

fn write_message(
    message: &MessageType,
    value: &RosValue,
    to: &mut CdrWriter<'_>,
) -> Result<(), CdrError> {
    let fields = match value {
        RosValue::Message(fields) if fields.len() == message.fields.len() => fields,
        _ => return Err(CdrError::new(format!("it is no {}", message.name))),
    };
    for (field, value) in message.fields.iter().zip(fields) {
        write_field(&field.field_type, value, to).map_err(|error| error.within(&field.name))?;
    }
    if fields.is_empty() {
        // IDL has no empty structures.
        to.number([0]);
    }
    Ok(())
}

fn write_field(
    field: &FieldType,
    value: &RosValue,
    to: &mut CdrWriter<'_>,
) -> Result<(), CdrError> {
    let count = match value {
        RosValue::Numbers(numbers) => numbers.len(),
        RosValue::Several(elements) => elements.len(),
        _ => 1,
    };
    match field.extent {
        Extent::One => return write_element(&field.base, value, to),
        Extent::Array(exactly) if exactly == count => {}
        Extent::Sequence(most) if most.is_none_or(|most| count <= most) => to.count(count),
        _ => return Err(CdrError::new(format!("{count} elements are no {field}"))),
    }
    let at = |index: usize, error: CdrError| error.within(&format!("[{index}]"));
    match (value, &field.base) {
        (RosValue::Numbers(numbers), BaseType::Primitive(primitive)) => {
            for (index, number) in numbers.iter().enumerate() {
                write_number(*primitive, *number, to).map_err(|error| at(index, error))?;
            }
        }
        (RosValue::Several(elements), base) => {
            for (index, element) in elements.iter().enumerate() {
                write_element(base, element, to).map_err(|error| at(index, error))?;
            }
        }
        _ => return Err(CdrError::new(format!("it is no {field}"))),
    }
    Ok(())
}

fn write_element(
    base: &BaseType,
    value: &RosValue,
    to: &mut CdrWriter<'_>,
) -> Result<(), CdrError> {
    match (base, value) {
        (BaseType::Primitive(primitive), RosValue::Number(number)) => {
            write_number(*primitive, *number, to)
        }
        (BaseType::Primitive(primitive), RosValue::Integer(integer)) => {
            write_integer(*primitive, *integer, to)
        }
        (BaseType::Text(most), RosValue::Text(text)) => {
            if most.is_some_and(|most| text.len() > most) || text.contains('\0') {
                return Err(CdrError::new(format!("{text:?} is no {base}")));
            }
            to.text(text);
            Ok(())
        }
        (BaseType::Message(message), value) => write_message(message, value, to),
        _ => Err(CdrError::new(format!("it is no {base}"))),
    }
}

fn write_number(primitive: Primitive, number: f64, to: &mut CdrWriter<'_>) -> Result<(), CdrError> {
    match primitive {
        Primitive::Float64 => to.f64(number),
        Primitive::Float32 if number.is_finite() && (number as f32).is_infinite() => {
            return Err(unfit(primitive, &number));
        }
        Primitive::Float32 => to.number((number as f32).to_le_bytes()),
        _ if number.trunc() == number => return write_integer(primitive, number as i128, to),
        _ => return Err(unfit(primitive, &number)),
    }
    Ok(())
}

fn write_integer(
    primitive: Primitive,
    integer: i128,
    to: &mut CdrWriter<'_>,
) -> Result<(), CdrError> {
    let Some((least, most)) = primitive.range() else {
        return write_number(primitive, integer as f64, to);
    };
    if !(least..=most).contains(&integer) {
        return Err(unfit(primitive, &integer));
    }
    // Within its range, the lower bytes are the number.
    let bytes = integer.to_le_bytes();
    match primitive.bytes() {
        1 => to.number([bytes[0]]),
        2 => to.number([bytes[0], bytes[1]]),
        4 => to.number([bytes[0], bytes[1], bytes[2], bytes[3]]),
        _ => to.u64((integer & i128::from(u64::MAX)) as u64),
    }
    Ok(())
}

fn unfit(primitive: Primitive, number: &dyn std::fmt::Display) -> CdrError {
    CdrError::new(format!("{number} is no {}", primitive.name()))
}
