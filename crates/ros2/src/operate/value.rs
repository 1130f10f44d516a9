//! Values of a node as parameters of ROS.

use isochrone_control::{SignalDescription, Value, Written};
use isochrone_recording::message::RosValue;

use crate::shown::with_article;

/// The types of parameters, as `rcl_interfaces/ParameterType` has them.
pub(super) const NOT_SET: u8 = 0;
pub(super) const BOOL: u8 = 1;
pub(super) const INTEGER: u8 = 2;
pub(super) const DOUBLE: u8 = 3;
pub(super) const STRING: u8 = 4;

/// The type of the parameter of a signal.
pub(super) fn type_of(signal: &SignalDescription) -> u8 {
    match &*signal.value_type {
        "BOOL" => BOOL,
        "LREAL" => DOUBLE,
        _ if signal.can_be_unset => STRING,
        _ => INTEGER,
    }
}

/// A `ParameterValue` of a signal's type.
pub(super) fn parameter(signal: &SignalDescription, value: Option<Value>) -> RosValue {
    let number = |value: &Value| match value {
        Value::Bool(truth) => Some(f64::from(*truth)),
        Value::Integer(integer) => Some(*integer as f64),
        Value::Number(number) => Some(*number),
        _ => None,
    };
    match (value, type_of(signal)) {
        (Some(Value::Bool(truth)), BOOL) => of(BOOL, truth, 0, 0.0, ""),
        (Some(Value::Integer(integer)), INTEGER) => of(INTEGER, false, integer, 0.0, ""),
        (Some(value), DOUBLE) => {
            number(&value).map_or_else(not_set, |number| of(DOUBLE, false, 0, number, ""))
        }
        (Some(value), STRING) => of(STRING, false, 0, 0.0, &value.to_string()),
        _ => not_set(),
    }
}

/// A `ParameterValue` of nothing.
pub(super) fn not_set() -> RosValue {
    of(NOT_SET, false, 0, 0.0, "")
}

fn of(kind: u8, truth: bool, integer: i64, double: f64, text: &str) -> RosValue {
    let (numbers, several) = (RosValue::Numbers(Vec::new()), RosValue::Several(Vec::new()));
    RosValue::Message(vec![
        RosValue::Number(kind.into()),
        RosValue::Number(truth.into()),
        RosValue::Integer(integer.into()),
        RosValue::Number(double),
        RosValue::Text(text.to_owned()),
        numbers.clone(),
        numbers.clone(),
        several.clone(),
        numbers,
        several,
    ])
}

/// What a `ParameterValue` gives to a signal. An integer is taken for a double.
pub(super) fn given(signal: &SignalDescription, value: &RosValue) -> Result<Written, String> {
    let parts = value.parts();
    let number = |index: usize| parts.get(index).and_then(RosValue::number);
    let kind = number(0).map_or(NOT_SET, |kind| kind as u8);
    let name = &signal.name;
    let integer = || match parts.get(2) {
        Some(RosValue::Integer(integer)) => i64::try_from(*integer).ok(),
        _ => None,
    };
    let given = match (type_of(signal), kind) {
        (BOOL, BOOL) => number(1).map(|truth| Value::Bool(truth == 1.0).into()),
        (INTEGER | DOUBLE | STRING, INTEGER) => integer().map(|it| Value::Integer(it).into()),
        (DOUBLE, DOUBLE) => number(3).map(|number| Value::Number(number).into()),
        (STRING, STRING) => parts.get(4).and_then(RosValue::text).map(Written::from),
        (_, NOT_SET) => {
            return Err(format!("{name} cannot be deleted: it is a parameter of a node"));
        }
        (wanted, got) => {
            let [wanted, got] = [wanted, got].map(word);
            let wanted = with_article(&wanted);
            return Err(format!("{name} is {wanted}, got a value of type {got}"));
        }
    };
    given.ok_or_else(|| format!("{name} got no value"))
}

fn word(kind: u8) -> &'static str {
    match kind {
        BOOL => "bool",
        INTEGER => "integer",
        DOUBLE => "double",
        STRING => "string",
        _ => "list",
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::Role;

    use super::*;

    fn signal(value_type: &str) -> SignalDescription {
        SignalDescription {
            name: "ramp.rate".into(),
            value_type: value_type.into(),
            unit: None,
            comment: None,
            role: Role::Parameter,
            task: String::new(),
            forced: false,
            protected: None,
            limits: None,
            can_be_unset: false,
            doc: String::new(),
        }
    }

    #[test]
    fn a_value_goes_to_ros_and_back() {
        for (value_type, value) in [
            ("BOOL", Value::Bool(true)),
            ("INT", Value::Integer(-5)),
            ("LREAL", Value::Number(0.5)),
        ] {
            let parameter = parameter(&signal(value_type), Some(value));
            assert_eq!(given(&signal(value_type), &parameter), Ok(value.into()));
        }
    }

    #[test]
    fn a_task_is_given_by_its_name() {
        let task = SignalDescription { can_be_unset: true, ..signal("INT") };
        let calling = parameter(&task, Some(Value::CallingTask));
        assert_eq!(given(&task, &calling), Ok(Written::from("calling task")));
    }

    #[test]
    fn an_integer_is_taken_for_a_double_and_nothing_else_for_anything() {
        let integer = of(INTEGER, false, 5, 0.0, "");
        assert_eq!(given(&signal("LREAL"), &integer), Ok(Value::Integer(5).into()));
        let refused = |value_type: &str, value| given(&signal(value_type), &value).unwrap_err();
        assert_eq!(refused("BOOL", integer), "ramp.rate is a bool, got a value of type integer");
        assert_eq!(
            refused("INT", of(DOUBLE, false, 0, 1.0, "")),
            "ramp.rate is an integer, got a value of type double"
        );
        assert!(refused("INT", not_set()).contains("cannot be deleted"));
    }
}
