//! The definitions in a schema of a recording: that of a message, and behind it all that it needs.

use super::definitions::MOST_TEXT_BYTES;
use super::{DefinitionError, Definitions};

/// Stands before each definition but the first.
const NAME: &str = "MSG: ";

impl Definitions {
    /// The definitions in a schema `ros2msg` of a message of this name.
    ///
    /// # Errors
    /// The text is too long for one.
    pub fn of_schema(name: &str, text: &str) -> Result<Self, DefinitionError> {
        if text.len() as u64 > MOST_TEXT_BYTES {
            return Err(DefinitionError(format!(
                "{name} has a definition of {} bytes",
                text.len()
            )));
        }
        let mut definitions = Self::default();
        // Some writers leave out what every ROS has.
        for name in ["builtin_interfaces/Time", "builtin_interfaces/Duration"] {
            definitions.add(name, "int32 sec\nuint32 nanosec\n");
        }
        let (mut name, mut body) = (name, String::new());
        let mut lines = text.lines().peekable();
        while let Some(line) = lines.next() {
            let next = lines.peek().and_then(|next| next.strip_prefix(NAME));
            match next.filter(|_| is_separator(line)) {
                Some(next) => {
                    definitions.add(name, &std::mem::take(&mut body));
                    name = next.trim();
                    lines.next();
                }
                None => {
                    body += line;
                    body.push('\n');
                }
            }
        }
        definitions.add(name, &body);
        Ok(definitions)
    }
}

fn is_separator(line: &str) -> bool {
    let line = line.trim();
    line.len() >= 3 && line.chars().all(|c| c == '=')
}
