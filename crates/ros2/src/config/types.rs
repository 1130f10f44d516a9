//! Types of messages by their names in the file or on the command line, and what there is to name in one.

use std::sync::Arc;

use isochrone_engine::KnownNames;
use isochrone_recording::message::{
    DefinitionError, Definitions, FieldPath, MessageNumbers, MessageType,
};

use crate::mapping::{Takes, takes};

/// Why there is no type of a name, and the way out.
pub(crate) struct NoType {
    pub(crate) error: DefinitionError,
    pub(crate) help: String,
}

/// The type of a name.
pub(crate) fn find_type(definitions: &Definitions, name: &str) -> Result<Arc<MessageType>, NoType> {
    definitions.find(name).map_err(|error| {
        let own = "--show lists all types; --msg-path or msg_path names a folder with .msg files of your own";
        let help = match nearest_type(definitions, name) {
            Some(nearest) => format!("did you mean \"{nearest}\"? {own}"),
            None => own.to_owned(),
        };
        NoType { error, help }
    })
}

/// The type that is meant: of the same package or, if there is no such package, of the same or the nearest name.
fn nearest_type(definitions: &Definitions, written: &str) -> Option<String> {
    let written = written.replacen("/msg/", "/", 1);
    let (package, name) = written.rsplit_once('/').unwrap_or(("", &written));
    let names = || names(definitions).filter_map(|known| known.split_once('/'));
    let of_package = KnownNames::new(names().filter(|it| it.0 == package).map(|it| it.1));
    let (package, name) = match of_package.nearest(name) {
        Some(nearest) => (package, nearest),
        None => {
            let same = names().find(|it| it.1 == name);
            let nearest = || KnownNames::new(names().map(|it| it.1)).nearest(name);
            same.or_else(|| nearest().and_then(|name| names().find(|it| it.1 == name)))?
        }
    };
    Some(format!("{package}/msg/{name}"))
}

/// The names of all types of messages, without the halves of services.
pub(crate) fn names(definitions: &Definitions) -> impl Iterator<Item = &str> {
    let is_half = |name: &str| name.ends_with("_Request") || name.ends_with("_Response");
    definitions.names().filter(move |name| !is_half(name))
}

/// An entry of `fields` for the first number of a message, or its first sequence of numbers; `None` if nothing of it can
/// be a signal.
pub(crate) fn example(message: &MessageType, signal: &str) -> Option<String> {
    let numbers = MessageNumbers::of(message).ok()?;
    if let Some(path) = numbers.paths.first() {
        return Some(format!("\"{path}\" = \"{signal}\""));
    }
    let paths = numbers.others.iter().filter_map(|other| other.split(": ").next());
    let is_of_numbers = |path: &&str| {
        FieldPath::find(message, path).is_ok_and(|found| takes(&found) == Takes::Numbers)
    };
    let path = paths.into_iter().find(is_of_numbers)?;
    Some(format!("\"{path}[]\" = [\"{signal}\"]"))
}

/// What is said of a type that has none.
pub(crate) fn no_signal(message: &MessageType) -> String {
    format!("nothing of {} can be a signal: it has no number to name", message.ros_name())
}
