//! The keys of an iceoryx2 configuration. iceoryx2 ignores those that it does not know, so a slip in
//! `prefix` would silently lead into the domain of the default.

use iceoryx2::config::Config;
use serde_json::{Map, Value};
use toml::de::DeTable;

/// A key that iceoryx2 does not know.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct UnknownKey {
    /// As it is written.
    pub(crate) key: String,
    /// The table that it stands in, as it is written: `[global]`, or `the file`.
    pub(crate) table: String,
    /// Where it stands, in bytes.
    pub(crate) at: usize,
    /// What would be right.
    pub(crate) remedy: String,
}

/// The first key of a file that iceoryx2 does not know.
pub(crate) fn unknown_key(file: &DeTable<'_>) -> Option<UnknownKey> {
    let known = known_keys();
    let mut unknown = Vec::new();
    collect(&Table { keys: file, known: &known, path: Vec::new() }, &known, &mut unknown);
    unknown.into_iter().min_by_key(|unknown| unknown.at)
}

/// All keys of iceoryx2's own configuration, as tables of tables. (In JSON also those have a place
/// that have no value by default; TOML would leave them out.)
fn known_keys() -> Map<String, Value> {
    match serde_json::to_value(Config::default()) {
        Ok(Value::Object(keys)) => keys,
        // A derived serialization of plain structures is an object.
        _ => Map::new(),
    }
}

/// A table of the file, and what it may hold.
struct Table<'a> {
    keys: &'a DeTable<'a>,
    known: &'a Map<String, Value>,
    path: Vec<&'a str>,
}

fn collect(table: &Table<'_>, all: &Map<String, Value>, unknown: &mut Vec<UnknownKey>) {
    for (key, value) in table.keys {
        let name = key.get_ref().as_ref();
        let Some(known) = table.known.get(name) else {
            unknown.push(UnknownKey {
                key: name.to_owned(),
                table: title(&table.path),
                at: key.span().start,
                remedy: remedy(name, table.known, all),
            });
            continue;
        };
        // Whether a value is of the right type is for iceoryx2 to say.
        if let (Some(keys), Value::Object(known)) = (value.get_ref().as_table(), known) {
            let path = [table.path.as_slice(), &[name]].concat();
            collect(&Table { keys, known, path }, all, unknown);
        }
    }
}

fn title(path: &[&str]) -> String {
    match path {
        [] => "the file".to_owned(),
        path => format!("[{}]", path.join(".")),
    }
}

fn remedy(key: &str, known: &Map<String, Value>, all: &Map<String, Value>) -> String {
    const NEAR: f64 = 0.85;
    let nearness = |name: &String| (strsim::jaro_winkler(&key.to_lowercase(), name), name.clone());
    let nearest = known.keys().map(nearness).max_by(|(a, _), (b, _)| a.total_cmp(b));
    if let Some((_, name)) = nearest.filter(|(nearness, _)| *nearness > NEAR) {
        return format!("did you mean {name:?}?");
    }
    let mut elsewhere = Vec::new();
    tables_with(key, all, &[], &mut elsewhere);
    if elsewhere.is_empty() {
        format!("there is: {}", known.keys().cloned().collect::<Vec<_>>().join(", "))
    } else {
        format!("it belongs in {}", elsewhere.join(" or "))
    }
}

/// The tables that know a key.
fn tables_with(key: &str, table: &Map<String, Value>, path: &[&str], found: &mut Vec<String>) {
    if table.contains_key(key) {
        found.push(title(path));
    }
    for (name, value) in table {
        if let Value::Object(inner) = value {
            tables_with(key, inner, &[path, &[name]].concat(), found);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknown(text: &str) -> Option<UnknownKey> {
        unknown_key(DeTable::parse(text).unwrap().get_ref())
    }

    #[test]
    fn every_key_of_iceoryx2_is_known_also_those_without_a_value() {
        let defaults = toml::to_string(&Config::default()).unwrap();
        assert_eq!(unknown(&defaults), None);
        let optional = "[global.service]\nflatbuffer-schema-path = \"/x\"\n[defaults.event]\n\
            notifier-created-event = 1\nnotifier-dropped-event = 2\nnotifier-dead-event = 3\n\
            [defaults.event.deadline]\nsecs = 1\nnanos = 2\n";
        assert_eq!(unknown(optional), None);
        let config: Config = toml::from_str(optional).unwrap();
        assert_eq!(config.defaults.event.notifier_dead_event, Some(3));
        assert!(config.defaults.event.deadline.is_some());
        assert!(config.global.service.flatbuffer_schema_path.is_some());
    }

    #[test]
    fn a_key_that_is_not_known_is_named_with_what_was_meant() {
        for (text, table, key, at, remedy) in [
            ("[global]\nprefx = \"x\"", "[global]", "prefx", 9, "did you mean \"prefix\"?"),
            (
                "[global]\nroot_path = \"/x\"",
                "[global]",
                "root_path",
                9,
                "did you mean \"root-path\"?",
            ),
            ("[globl]\nprefix = \"x\"", "the file", "globl", 1, "did you mean \"global\"?"),
            ("prefix = \"x\"", "the file", "prefix", 0, "it belongs in [global]"),
            ("[global.node]\nzebra = 1", "[global.node]", "zebra", 14, "there is: directory, "),
            (
                "global = { node = { Monitor-Suffix = 1 } }",
                "[global.node]",
                "Monitor-Suffix",
                20,
                "did you mean \"monitor-suffix\"?",
            ),
            (
                "[defaults]\nmax-readers = 1",
                "[defaults]",
                "max-readers",
                11,
                "it belongs in [defaults.blackboard]",
            ),
            ("[global]\nzzz = 1\naaa = 1", "[global]", "zzz", 9, "there is: "),
        ] {
            let found = unknown(text).unwrap();
            assert_eq!((found.table.as_str(), found.key.as_str(), found.at), (table, key, at));
            assert!(found.remedy.starts_with(remedy), "{}", found.remedy);
        }
    }
}
