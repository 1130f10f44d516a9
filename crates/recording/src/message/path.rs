//! The way to a field: `linear.x`, `covariance[3]`, `position[]`.

use super::{BaseType, DefinitionError, Extent, FieldType, MessageType, RosValue};

/// The way to a field of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldPath {
    steps: Vec<Step>,
    /// What it leads to; of one element of an array, the type of that element.
    field_type: FieldType,
    /// Whether it leads to an element of a sequence, or into one, which may be missing.
    is_of_sequence: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Field(usize),
    Element(usize),
}

impl FieldPath {
    /// The way that a text says: names with dots, elements in brackets counted from 0. Empty brackets at the end stand
    /// for all elements and may be left out.
    ///
    /// # Errors
    /// There is no such field: the message lists those that there are.
    pub fn find(message: &MessageType, written: &str) -> Result<Self, DefinitionError> {
        let mut path = Self {
            steps: Vec::new(),
            field_type: FieldType { base: BaseType::Text(None), extent: Extent::One },
            is_of_sequence: false,
        };
        let mut inner = Some(message);
        let mut walked = String::new();
        for part in written.strip_suffix("[]").unwrap_or(written).split('.') {
            let Some(message) = inner else {
                return Err(DefinitionError(format!(
                    "{walked} is no message: there is no {written}"
                )));
            };
            let (name, mut indices) = part.find('[').map_or((part, ""), |at| part.split_at(at));
            let Some(position) = message.position(name) else {
                return Err(unknown(message, name));
            };
            walked = if walked.is_empty() { name.into() } else { format!("{walked}.{name}") };
            path.steps.push(Step::Field(position));
            path.field_type = message.fields[position].field_type.clone();
            if !indices.is_empty() {
                let (index, rest) = indices[1..].split_once(']').unwrap_or((indices, " "));
                let Ok(index) = index.parse::<usize>() else {
                    return Err(DefinitionError(format!(
                        "{part}: an element is a number in brackets"
                    )));
                };
                indices = rest;
                path.enter(index, &walked)?;
            }
            if !indices.is_empty() {
                return Err(DefinitionError(format!("{part}: {walked} has one index at most")));
            }
            inner = match (&message.fields[position].field_type.base, path.field_type.extent) {
                (BaseType::Message(inner), Extent::One) => Some(inner),
                _ => None,
            };
        }
        Ok(path)
    }

    /// Goes on to an element.
    fn enter(&mut self, index: usize, walked: &str) -> Result<(), DefinitionError> {
        let most = match self.field_type.extent {
            Extent::One => return Err(DefinitionError(format!("{walked} has no elements"))),
            Extent::Array(count) => Some(count),
            Extent::Sequence(most) => {
                self.is_of_sequence = true;
                most
            }
        };
        if most.is_some_and(|most| index >= most) {
            let most = most.unwrap_or_default();
            return Err(DefinitionError(format!(
                "{walked} has {most} elements, counted from 0: there is no {walked}[{index}]"
            )));
        }
        self.steps.push(Step::Element(index));
        self.field_type.extent = Extent::One;
        Ok(())
    }

    /// The type of what it leads to.
    pub fn field_type(&self) -> &FieldType {
        &self.field_type
    }

    /// Whether messages may lack it, as it is in a sequence.
    pub fn is_of_sequence(&self) -> bool {
        self.is_of_sequence
    }

    /// The sequence of numbers that it leads to an element of, and which.
    pub fn element_of_sequence(&self) -> Option<(Self, usize)> {
        let (Step::Element(index), above) = self.steps.split_last()? else { return None };
        let is_numbers = matches!(&self.field_type.base, BaseType::Primitive(it) if !it.is_wide());
        let is_first = !above.iter().any(|step| matches!(step, Step::Element(_)));
        if !(self.is_of_sequence && is_numbers && is_first) {
            return None;
        }
        let field_type =
            FieldType { base: self.field_type.base.clone(), extent: Extent::Sequence(None) };
        Some((Self { steps: above.to_vec(), field_type, is_of_sequence: false }, *index))
    }

    /// The number at its end, if there is one.
    pub fn number(&self, message: &RosValue) -> Option<f64> {
        let (last, above) = self.steps.split_last()?;
        match (above.iter().try_fold(message, inner)?, last) {
            (RosValue::Numbers(numbers), Step::Element(index)) => numbers.get(*index).copied(),
            (value, step) => inner(value, step)?.number(),
        }
    }

    /// The value at its end, if there is one; not of an element of several numbers.
    pub fn value<'v>(&self, message: &'v RosValue) -> Option<&'v RosValue> {
        self.steps.iter().try_fold(message, inner)
    }

    /// The elements at its end as numbers, if these are any.
    pub fn numbers<'v>(&self, message: &'v RosValue) -> Option<&'v [f64]> {
        match self.value(message)? {
            RosValue::Numbers(numbers) => Some(numbers),
            _ => None,
        }
    }

    /// Sets the number at its end, and returns whether there is one.
    pub fn set_number(&self, message: &mut RosValue, number: f64) -> bool {
        let Some((last, above)) = self.steps.split_last() else { return false };
        let Some(value) = above.iter().try_fold(message, inner_mut) else { return false };
        if let (RosValue::Numbers(numbers), Step::Element(index)) = (&mut *value, last) {
            return numbers.get_mut(*index).map(|place| *place = number).is_some();
        }
        match inner_mut(value, last) {
            Some(place @ RosValue::Number(_)) => *place = RosValue::Number(number),
            // Encoding refuses what is not whole.
            Some(place @ RosValue::Integer(_)) if number.trunc() == number => {
                *place = RosValue::Integer(number as i128);
            }
            Some(place @ RosValue::Integer(_)) => *place = RosValue::Number(number),
            _ => return false,
        }
        true
    }

    /// Sets the value at its end, and returns whether there is such a place.
    pub fn set(&self, message: &mut RosValue, value: RosValue) -> bool {
        let place = self.steps.iter().try_fold(message, inner_mut);
        place.map(|place| *place = value).is_some()
    }
}

fn inner<'v>(value: &'v RosValue, step: &Step) -> Option<&'v RosValue> {
    let (Step::Field(index) | Step::Element(index)) = step;
    value.parts().get(*index)
}

fn inner_mut<'v>(value: &'v mut RosValue, step: &Step) -> Option<&'v mut RosValue> {
    let (Step::Field(index) | Step::Element(index)) = step;
    match value {
        RosValue::Several(parts) | RosValue::Message(parts) => parts.get_mut(*index),
        _ => None,
    }
}

fn unknown(message: &MessageType, name: &str) -> DefinitionError {
    let names: Vec<&str> = message.fields.iter().map(|field| &*field.name).collect();
    DefinitionError(format!(
        "{} has no field {name:?}; it has {}",
        message.ros_name(),
        names.join(", ")
    ))
}
