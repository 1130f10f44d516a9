//! The JSON Schema of a configuration file, from the keys that the parser knows and the pins of the block types, so
//! that editors complete and explain them.
//!
//! It says less than `check`: what several keys mean together, and the ranges of numbers, stand there in words.

use isochrone_blocks::{BlockType, EXPR, Pin, PinDefault, PinType};
use serde_json::{Map, Value, json};

use crate::keys::{Absent, Form, Key, TABLES, TableKeys};

/// The schema of a file whose blocks are of these types.
pub fn schema(catalogue: &[BlockType]) -> Value {
    let [file, tables @ ..] = &TABLES;
    let is_below_another = |table: &&&TableKeys| path(table).contains('.');
    let mut schema = table_schema(file, "", catalogue);
    schema["$schema"] = json!("http://json-schema.org/draft-07/schema#");
    schema["title"] = json!("Configuration of an isochrone node");
    for table in tables.iter().filter(|table| !is_below_another(table)) {
        let path = path(table);
        let below = table_schema(table, path, catalogue);
        let described = table.doc();
        schema["properties"][path] = if table.title.starts_with("[[") {
            json!({ "description": described, "type": "array", "items": below })
        } else {
            below
        };
    }
    schema
}

/// Where a table stands: `task.follow`.
fn path(table: &TableKeys) -> &'static str {
    table.title.trim_matches(['[', ']'])
}

fn table_schema(table: &TableKeys, path: &str, catalogue: &[BlockType]) -> Value {
    let properties =
        table.keys.iter().map(|key| (key.name.to_owned(), value_schema(key, path, catalogue)));
    let is_required = |key: &&&Key| matches!(key.absent, Absent::Required(_));
    let required: Vec<_> = table.keys.iter().filter(is_required).map(|key| key.name).collect();
    let mut schema = json!({ "description": table.doc(), "type": "object" });
    if table.keys.is_empty() {
        // Its keys are names.
        if path == "block.out" {
            schema["additionalProperties"] = json!({ "type": "string" });
        }
        return schema;
    }
    schema["properties"] = properties.collect::<Map<_, _>>().into();
    schema["additionalProperties"] = json!(false);
    if !required.is_empty() {
        schema["required"] = json!(required);
    }
    if path == "block" {
        schema["allOf"] = catalogue.iter().chain([&EXPR]).map(of_type).collect();
    }
    schema
}

fn value_schema(key: &Key, path: &str, catalogue: &[BlockType]) -> Value {
    let below = || {
        let wanted = format!("{path}.{}", key.name);
        let table = TABLES.iter().find(|table| self::path(table) == wanted);
        table.map_or(json!({ "type": "object" }), |table| table_schema(table, &wanted, catalogue))
    };
    let mut schema = match &key.form {
        Form::Word(words) => json!({ "enum": words }),
        Form::WordOrTable(words, _) => json!({ "anyOf": [{ "enum": words }, below()] }),
        Form::WordOrInteger(words, _) => {
            json!({ "anyOf": [{ "enum": words }, { "type": "integer" }] })
        }
        Form::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        Form::Truth => json!({ "type": "boolean" }),
        Form::Integer(_) => json!({ "type": "integer" }),
        Form::Number(_) => json!({ "type": "number" }),
        Form::Value => json!({ "type": ["number", "boolean", "string"] }),
        Form::Bounds => {
            json!({ "type": "array", "items": { "type": ["number", "string"] }, "minItems": 2, "maxItems": 2 })
        }
        Form::Table => below(),
        Form::Tables => json!({ "type": "array" }),
        Form::Name(_) | Form::Text | Form::Line(_) | Form::Duration(_) => {
            json!({ "type": "string" })
        }
    };
    let mut described = vec![key.doc().to_owned()];
    let range = key.range();
    let is_listed = matches!(key.form, Form::Word(_));
    described.extend((!range.is_empty() && !is_listed).then(|| format!("Range: {range}.")));
    described.extend((!key.unit.is_empty()).then(|| format!("Unit: {}.", key.unit)));
    match key.absent {
        Absent::Required(example) => described.push(format!("Required, such as {example}.")),
        Absent::Default(value) => described.push(format!("Default: {value}.")),
        Absent::Means(what) => described.push(format!("If left out: {what}.")),
    }
    schema["description"] = json!(described.join("\n"));
    if (path, key.name) == ("block", "type") {
        let types = catalogue.iter().chain([&EXPR]);
        schema["enum"] = types.map(|block_type| block_type.name).collect();
    }
    schema
}

/// What a block of this type may have as pins.
fn of_type(block_type: &BlockType) -> Value {
    let pins = block_type.inputs.iter().map(|pin| (pin.name.to_owned(), pin_schema(pin)));
    let required = block_type.inputs.iter().filter(|pin| pin.default == PinDefault::Required);
    let required: Vec<_> = required.map(|pin| pin.name).collect();
    let of_instance = json!({ "type": "object" });
    let mut pins = json!({
        "description": block_type.doc(),
        "properties": pins.collect::<Map<_, _>>(),
        // Pins of one instance alone.
        "patternProperties": { "^[0-9]+$": of_instance },
        "additionalProperties": false,
    });
    let mut then = json!({ "properties": {} });
    if block_type.formulas().is_some() {
        pins = json!(false);
        then["required"] = json!(["out"]);
    }
    if !required.is_empty() {
        pins["required"] = json!(required);
        then["required"] = json!(["in"]);
    }
    then["properties"]["in"] = pins;
    json!({
        "if": { "properties": { "type": { "const": block_type.name } }, "required": ["type"] },
        "then": then,
    })
}

/// A constant, or a wire as text.
fn pin_schema(pin: &Pin) -> Value {
    let constant = if pin.pin_type == PinType::Bool { "boolean" } else { "number" };
    let unit = if pin.unit.is_empty() { String::new() } else { format!(" [{}]", pin.unit) };
    let description = format!("{}{unit}: {}", pin.pin_type, pin.doc());
    json!({ "description": description, "type": [constant, "string"] })
}
