//! Refusals that several kinds of request share.

use isochrone_blocks::PinType;
use isochrone_engine::escaped;
use isochrone_model::{Code, Refusal, Value};

/// There is no signal of this name. `help` suggests one, or lists those that exist.
pub(super) fn unknown(name: &str, help: impl Into<String>) -> Refusal {
    let message = format!("there is no signal \"{}\"", shortened(name));
    Refusal::one(Code::UnknownName, name, message, help)
}

/// The request names nothing.
pub(super) fn empty() -> Refusal {
    Refusal::one(Code::WrongValue, "", "the request names no signal", "name at least one")
}

/// A type does not have a value.
pub(super) fn wrong_value(name: &str, value: Value, value_type: PinType) -> Refusal {
    let help = match (value_type, value_type.range(), value) {
        (PinType::Int, _, Value::Task { .. }) => {
            "write a number, or the period of one of the node's tasks at a callOB".into()
        }
        (PinType::Bool, ..) => "write true or false".into(),
        (PinType::Time, Some((min, max)), _) => {
            format!("write whole milliseconds from {min} to {max}")
        }
        (_, Some((min, max)), _) => format!("write a whole number from {min} to {max}"),
        (_, None, _) => "write a number".into(),
    };
    let message = format!("{value} is no {value_type}, as \"{name}\" is");
    Refusal::one(Code::WrongValue, name, message, help)
}

/// A `[[protect]]` of the configuration names a signal.
pub(super) fn protected(name: &str, pattern: &str) -> Refusal {
    let message = format!("\"{name}\" is protected by [[protect]] \"{pattern}\"");
    let help = "take it out of [[protect]] and start the node again";
    Refusal::one(Code::Forbidden, name, message, help)
}

/// A request waits for its cycle, and this one cannot overtake it.
pub(super) fn waiting(transaction: u64) -> Refusal {
    let message = format!("transaction {transaction} is still to come");
    Refusal::one(Code::Busy, "", message, "ask again when it has")
}

/// There is no such transaction, or none that wrote values.
pub(super) fn unknown_transaction(transaction: u64) -> Refusal {
    let message =
        format!("there is no transaction {transaction} that set values and that is still known");
    Refusal::one(Code::UnknownName, "", message, "the journal lists those that can be undone")
}

/// A journal says that the configuration changed, and that cannot be repeated.
pub(super) fn not_repeated(transaction: u64, why: &str) -> Refusal {
    let message = format!("transaction {transaction} changed the configuration, and {why}");
    Refusal::one(Code::CannotChange, "", message, "repeat what was done before it")
}

/// A name, shortened to fit into a sentence.
fn shortened(name: &str) -> String {
    const SHOWN: usize = 100;
    match name.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", escaped(name.get(..end).unwrap_or_default())),
        None => escaped(name).into_owned(),
    }
}
