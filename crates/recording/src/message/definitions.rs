//! The definitions that are at hand, and the types that they make.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::definition::{WrittenBase, fields};
use super::{BaseType, DefinitionError, Extent, FieldType, MessageField, MessageType};

/// Most bytes that a message may have at least: one with the default of a field for each.
const MOST_LEAST_BYTES: usize = 1 << 20;
/// How deep messages stand in each other.
const MOST_DEPTH: usize = 32;
/// How deep folders of definitions stand in each other.
const MOST_FOLDERS: usize = 6;
/// Longest file of a definition.
pub(super) const MOST_TEXT_BYTES: u64 = 1 << 20;

/// Definitions of messages by their names.
#[derive(Debug, Clone, Default)]
pub struct Definitions {
    texts: BTreeMap<String, String>,
}

impl Definitions {
    /// Adds a definition under its package and name, `geometry_msgs/Twist`; it replaces one of this name.
    pub fn add(&mut self, name: &str, text: &str) {
        self.texts.insert(short(name), text.to_owned());
    }

    /// Adds the two halves of a service, `rcl_interfaces/GetParameters_Request` and `…_Response`.
    pub fn add_service(&mut self, name: &str, text: &str) {
        let mut halves = [String::new(), String::new()];
        let mut half = 0;
        for line in text.lines() {
            if line.trim() == "---" {
                half = 1;
            } else {
                halves[half] += line;
                halves[half].push('\n');
            }
        }
        let [request, response] = halves;
        self.add(&format!("{name}_Request"), &request);
        self.add(&format!("{name}_Response"), &response);
    }

    /// Adds all `.msg` files of a folder and those in it, and returns how many. The package of a file is the name of
    /// its folder; if that is `msg`, the name of the one above: `my_msgs/msg/Pump.msg` is `my_msgs/Pump`.
    ///
    /// # Errors
    /// A folder or file cannot be read.
    pub fn add_folder(&mut self, folder: &Path) -> Result<usize, DefinitionError> {
        let folder = folder.canonicalize().map_err(|cause| unreadable(folder, &cause))?;
        self.add_folder_within(&folder, MOST_FOLDERS)
    }

    fn add_folder_within(&mut self, folder: &Path, depth: usize) -> Result<usize, DefinitionError> {
        let entries = fs::read_dir(folder).map_err(|cause| unreadable(folder, &cause))?;
        let mut added = 0;
        for entry in entries {
            let path = entry.map_err(|cause| unreadable(folder, &cause))?.path();
            if path.is_dir() {
                if depth > 0 {
                    added += self.add_folder_within(&path, depth - 1)?;
                }
            } else if path.extension().is_some_and(|end| end == "msg") && path.is_file() {
                let length = fs::metadata(&path).map_err(|cause| unreadable(&path, &cause))?.len();
                if length > MOST_TEXT_BYTES {
                    let path = path.display();
                    return Err(DefinitionError(format!(
                        "{path} has {length} bytes: no definition"
                    )));
                }
                let text = fs::read_to_string(&path).map_err(|cause| unreadable(&path, &cause))?;
                if let Some(name) = name_of(&path) {
                    self.add(&name, &text);
                    added += 1;
                }
            }
        }
        Ok(added)
    }

    /// The names of all messages.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.texts.keys().map(String::as_str)
    }

    /// The type of a message, by `geometry_msgs/msg/Twist` or `geometry_msgs/Twist`.
    ///
    /// # Errors
    /// There is no such definition, or it or one that it needs is wrong.
    pub fn find(&self, name: &str) -> Result<Arc<MessageType>, DefinitionError> {
        Resolver { definitions: self, found: HashMap::new() }.find(&short(name), MOST_DEPTH)
    }
}

/// A name without the folder `msg`.
fn short(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

fn name_of(path: &Path) -> Option<String> {
    let name = path.file_stem()?.to_str()?;
    let folders = path.ancestors().skip(1).filter_map(Path::file_name);
    let package = folders.filter_map(|name| name.to_str()).find(|name| *name != "msg")?;
    Some(format!("{package}/{name}"))
}

fn unreadable(path: &Path, cause: &std::io::Error) -> DefinitionError {
    DefinitionError(format!("cannot read {}: {cause}", path.display()))
}

/// Finds what types a definition needs.
struct Resolver<'a> {
    definitions: &'a Definitions,
    found: HashMap<String, Arc<MessageType>>,
}

impl Resolver<'_> {
    fn find(&mut self, name: &str, depth: usize) -> Result<Arc<MessageType>, DefinitionError> {
        if let Some(found) = self.found.get(name) {
            return Ok(found.clone());
        }
        let Some(text) = self.definitions.texts.get(name) else {
            return Err(DefinitionError(format!("there is no definition of {name}")));
        };
        if depth == 0 {
            return Err(DefinitionError(format!(
                "{name} stands in more than {MOST_DEPTH} messages, perhaps in itself"
            )));
        }
        let package = name.split('/').next().unwrap_or_default();
        let mut message = MessageType { name: name.to_owned(), fields: Vec::new(), least_bytes: 0 };
        for field in fields(name, text)? {
            let base = match field.base {
                WrittenBase::Primitive(primitive) => BaseType::Primitive(primitive),
                WrittenBase::Text(most) => BaseType::Text(most),
                WrittenBase::Message(written) => {
                    let inner = match &*written {
                        "Header" => "std_msgs/Header".to_owned(),
                        full if full.contains('/') => short(full),
                        near => format!("{package}/{near}"),
                    };
                    let found = self.find(&inner, depth - 1);
                    let place = |DefinitionError(cause)| {
                        DefinitionError(format!("{name}, line {}: {cause}", field.line))
                    };
                    BaseType::Message(found.map_err(place)?)
                }
            };
            let field_type = FieldType { base, extent: field.extent };
            message.least_bytes = message.least_bytes.saturating_add(field_type.least_bytes());
            message.fields.push(MessageField {
                name: field.name,
                field_type,
                default: field.default,
            });
        }
        // One without fields takes a byte.
        message.least_bytes = message.least_bytes.max(1);
        if message.least_bytes > MOST_LEAST_BYTES {
            return Err(DefinitionError(format!(
                "{name} has {} bytes or more; at most {MOST_LEAST_BYTES} are possible",
                message.least_bytes
            )));
        }
        let message = Arc::new(message);
        self.found.insert(name.to_owned(), message.clone());
        Ok(message)
    }
}

impl Extent {
    /// Whether the field always has the same number of elements.
    pub fn is_fixed(self) -> bool {
        matches!(self, Self::One | Self::Array(_))
    }
}
