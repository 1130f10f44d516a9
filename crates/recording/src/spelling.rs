//! Names of signals as fields of a ROS message.

use std::collections::{HashMap, HashSet};

use isochrone_ipc::{FrameLayout, SignalSpec};

/// The package of all messages.
pub(crate) const PACKAGE: &str = "isochrone";
/// Deeper names are folded into one field, so that one name is not a hundred messages.
const MAX_DEPTH: usize = 6;
/// What stands between the definitions of a schema.
const SEPARATOR: &str =
    "================================================================================";

/// The field that every message begins with, which is no signal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    /// Its name.
    pub(crate) field: &'static str,
    /// The name of its message.
    pub(crate) message: &'static str,
    /// The definition of that.
    pub(crate) definition: &'static str,
}

/// The message that carries the frames of one layout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Spelling {
    /// Name of the message, such as `isochrone/msg/PlantLevel9f8c1fe4b321758d`.
    pub(crate) schema_name: String,
    /// Its definition, with those of the messages in it.
    pub(crate) definition: String,
    /// The field of each channel of a frame.
    pub(crate) fields: Vec<Field>,
}

/// The field of one channel of a frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Field {
    /// Its name, with the messages that it is in: `ramp.delayed_value`.
    pub(crate) path: String,
    /// How many values stand before it in the message.
    pub(crate) place: usize,
}

/// A part of a name: a field with a value, a message of such, or both.
#[derive(Default)]
struct Part {
    name: String,
    channel: Option<usize>,
    children: Vec<usize>,
    /// The children by their names as they were given.
    known: HashMap<String, usize>,
    taken: HashSet<String>,
}

/// All parts; the first is the message itself.
struct Tree(Vec<Part>);

impl Spelling {
    /// Spells the signals of `service`.
    pub(crate) fn new(service: &str, signals: &[SignalSpec], head: Head) -> Self {
        let root = Part { taken: [head.field.to_owned()].into(), ..Part::default() };
        let mut tree = Tree(vec![root]);
        for (channel, signal) in signals.iter().enumerate() {
            tree.insert(&signal.name, channel);
        }
        let mut fields = vec![Field { path: String::new(), place: 0 }; signals.len()];
        tree.place(0, "", &mut 0, &mut fields);

        let paths = fields.iter().map(|field| SignalSpec::new(field.path.clone(), ""));
        let number = FrameLayout { signals: paths.collect(), period_ns: None }.number();
        let type_name = format!("{}{number:016x}", camel(service));
        let mut types = Types {
            root: &type_name,
            by_body: HashMap::new(),
            taken: HashSet::new(),
            sections: String::new(),
        };
        let Head { field, message, definition } = head;
        let body = format!("{PACKAGE}/{message} {field}\n{}", types.body(&tree, 0));
        let sections = types.sections;
        Self {
            schema_name: format!("{PACKAGE}/msg/{type_name}"),
            definition: format!("{body}{}{sections}", section(message, definition)),
            fields,
        }
    }
}

impl Tree {
    fn insert(&mut self, name: &str, channel: usize) {
        let unnamed = format!("ch{channel}");
        let parts = parts(if name.is_empty() { &unnamed } else { name });
        let (last, above) =
            parts.split_last().map_or(("", &[][..]), |(last, above)| (last.as_str(), above));
        let mut at = 0;
        for part in above {
            at = self.child(at, part);
        }
        let mut leaf = self.child(at, last);
        if self.0[leaf].channel.is_some() {
            leaf = self.add(at, last);
        }
        self.0[leaf].channel = Some(channel);
    }

    fn child(&mut self, at: usize, part: &str) -> usize {
        match self.0[at].known.get(part) {
            Some(child) => *child,
            None => {
                let child = self.add(at, part);
                self.0[at].known.insert(part.to_owned(), child);
                child
            }
        }
    }

    /// Adds a child with a name of its own.
    fn add(&mut self, at: usize, part: &str) -> usize {
        let child = self.0.len();
        let name = unique(snake(part), "_", &mut self.0[at].taken);
        self.0.push(Part { name, ..Part::default() });
        self.0[at].children.push(child);
        child
    }

    /// Numbers the values in the order of the message. A name that has a value and others below it becomes
    /// a message with a field `value`.
    fn place(&mut self, at: usize, path: &str, next: &mut usize, fields: &mut [Field]) {
        if let Some(channel) = self.0[at].channel
            && !self.0[at].children.is_empty()
        {
            self.0[at].channel = None;
            let leaf = self.add(at, "value");
            self.0[leaf].channel = Some(channel);
            self.0[at].children.rotate_right(1);
        }
        for child in self.0[at].children.clone() {
            let name = &self.0[child].name;
            let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            match self.0[child].channel {
                Some(channel) if self.0[child].children.is_empty() => {
                    fields[channel] = Field { path, place: *next };
                    *next += 1;
                }
                _ => self.place(child, &path, next, fields),
            }
        }
    }
}

/// The definitions of the messages in a message. Equal ones are one.
struct Types<'a> {
    root: &'a str,
    by_body: HashMap<String, String>,
    taken: HashSet<String>,
    sections: String,
}

impl Types<'_> {
    fn body(&mut self, tree: &Tree, at: usize) -> String {
        let mut body = String::new();
        for child in &tree.0[at].children {
            let part = &tree.0[*child];
            let type_name = if part.children.is_empty() {
                "float64".to_owned()
            } else {
                let inner = self.body(tree, *child);
                format!("{PACKAGE}/{}", self.name(&part.name, inner))
            };
            body += &format!("{type_name} {}\n", part.name);
        }
        body
    }

    fn name(&mut self, field: &str, body: String) -> String {
        if let Some(known) = self.by_body.get(&body) {
            return known.clone();
        }
        let name = unique(format!("{}{}", self.root, camel(field)), "V", &mut self.taken);
        self.sections += &section(&name, &body);
        self.by_body.insert(body, name.clone());
        name
    }
}

fn section(name: &str, body: &str) -> String {
    format!("{SEPARATOR}\nMSG: {PACKAGE}/{name}\n{body}")
}

/// The parts of a name between its dots. A number belongs to what stands before it: instance 17 of a block
/// is `ramp_17`.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for part in name.split('.') {
        let is_number = part.starts_with(|c: char| c.is_ascii_digit());
        let is_full = parts.len() == MAX_DEPTH;
        match parts.last_mut() {
            Some(last) if is_number || is_full || part.is_empty() => *last += &format!(".{part}"),
            _ => parts.push(part.to_owned()),
        }
    }
    parts
}

/// A name as ROS writes fields: `delayedValue` is `delayed_value`, `callOB` is `call_ob`.
fn snake(name: &str) -> String {
    let chars: Vec<char> = name.chars().collect();
    let mut snake = String::new();
    for (index, c) in chars.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| chars[before]);
        let begins_word = c.is_ascii_uppercase()
            && before.is_some_and(|before| {
                let next_is_lower = chars.get(index + 1).is_some_and(char::is_ascii_lowercase);
                before.is_ascii_lowercase()
                    || before.is_ascii_digit()
                    || before.is_ascii_uppercase() && next_is_lower
            });
        let separates = begins_word || !c.is_ascii_alphanumeric();
        if separates && !snake.is_empty() && !snake.ends_with('_') {
            snake.push('_');
        }
        if c.is_ascii_alphanumeric() {
            snake.push(c.to_ascii_lowercase());
        }
    }
    let snake = snake.trim_end_matches('_');
    if snake.starts_with(|c: char| c.is_ascii_lowercase()) {
        snake.to_owned()
    } else {
        format!("x{snake}")
    }
}

/// A name as ROS writes messages: `plant/level` is `PlantLevel`.
fn camel(name: &str) -> String {
    let mut camel = String::new();
    for word in name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()) {
        let (first, rest) = word.split_at(1);
        camel += &first.to_ascii_uppercase();
        camel += rest;
    }
    if camel.starts_with(|c: char| c.is_ascii_uppercase()) { camel } else { format!("X{camel}") }
}

/// The name, with a number if it is taken: `limit_2`, or `Limit2` for a message.
pub(crate) fn unique(name: String, between: &str, taken: &mut HashSet<String>) -> String {
    let mut number = 1;
    let mut unique = name.clone();
    while !taken.insert(unique.clone()) {
        number += 1;
        unique = format!("{name}{between}{number}");
    }
    unique
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const HEAD: Head =
        Head { field: "frame", message: "FrameHeader", definition: "uint64 sequence\n" };

    fn paths(names: &[&str]) -> Vec<String> {
        let signals: Vec<SignalSpec> =
            names.iter().map(|name| SignalSpec::new(*name, "")).collect();
        Spelling::new("plant/level", &signals, HEAD).fields.into_iter().map(|it| it.path).collect()
    }

    #[test]
    fn names_are_spelled_as_ros_spells_fields() {
        for (name, spelled) in [
            ("ramp.delayedValue", "ramp.delayed_value"),
            ("ramp.17.callOB", "ramp_17.call_ob"),
            ("limit-2.enDefaultOutValue", "limit_2.en_default_out_value"),
            ("OBFlag", "ob_flag"),
            ("x1Y", "x1_y"),
            ("17", "x17"),
            ("", "ch0"),
            ("\u{fc}", "x"),
            ("a..b__c_", "a.b_c"),
            ("a.b.c.d.e.f.g.h", "a.b.c.d.e.f_g_h"),
        ] {
            assert_eq!(paths(&[name]), [spelled], "{name}");
        }
    }

    #[test]
    fn names_that_would_be_spelled_alike_get_a_number() {
        assert_eq!(paths(&["a-b", "a_b", "aB"]), ["a_b", "a_b_2", "a_b_3"]);
        assert_eq!(paths(&["a-b.x", "a_b.x", "a-b.y"]), ["a_b.x", "a_b_2.x", "a_b.y"]);
        assert_eq!(paths(&["frame", "frame"]), ["frame_2", "frame_3"]);
        assert_eq!(paths(&["ch1", ""]), ["ch1", "ch1_2"]);
    }

    #[test]
    fn a_value_with_others_below_it_is_a_message_with_a_field_value() {
        let spelled = ["level.value", "level.ok", "level.age"];
        assert_eq!(paths(&["level", "level.ok", "level.age"]), spelled);
        assert_eq!(paths(&["a.value", "a"]), ["a.value", "a.value_2"]);
    }

    #[test]
    fn the_definition_names_every_message_once() {
        let names = ["ramp.1.value", "x", "ramp.2.value", "ramp.1.error", "ramp.2.error"];
        let signals: Vec<SignalSpec> =
            names.iter().map(|name| SignalSpec::new(*name, "")).collect();
        let spelling = Spelling::new("plant/level", &signals, HEAD);
        let name = spelling.schema_name.strip_prefix("isochrone/msg/").unwrap();
        let expected = format!(
            "isochrone/FrameHeader frame\nisochrone/{name}Ramp1 ramp_1\nfloat64 x\n\
             isochrone/{name}Ramp1 ramp_2\n{SEPARATOR}\nMSG: isochrone/FrameHeader\nuint64 sequence\n\
             {SEPARATOR}\nMSG: isochrone/{name}Ramp1\nfloat64 value\nfloat64 error\n"
        );
        assert_eq!(spelling.definition, expected);
        let places: Vec<usize> = spelling.fields.iter().map(|field| field.place).collect();
        assert_eq!(places, [0, 2, 3, 1, 4]);
    }

    proptest! {
        #[test]
        fn whatever_names_there_are_every_channel_has_a_field_and_a_place_of_its_own(
            names in prop::collection::vec("[aAbB_.\\-1\u{fc} ]{0,12}", 0..40)
        ) {
            let signals: Vec<SignalSpec> =
                names.iter().map(|name| SignalSpec::new(name.clone(), "")).collect();
            let fields = Spelling::new("x", &signals, HEAD).fields;
            let paths: HashSet<&str> = fields.iter().map(|field| field.path.as_str()).collect();
            prop_assert_eq!(paths.len(), names.len());
            let mut places: Vec<usize> = fields.iter().map(|field| field.place).collect();
            places.sort_unstable();
            prop_assert_eq!(places, (0..names.len()).collect::<Vec<_>>());
            for part in paths.iter().flat_map(|path| path.split('.')) {
                prop_assert!(part.starts_with(|c: char| c.is_ascii_lowercase()), "{}", part);
                prop_assert!(!part.contains("__") && !part.ends_with('_'), "{}", part);
            }
        }
    }
}
