//! `blocks`: the catalogue.

use clap::ValueEnum;
use isochrone_blocks::{BlockType, CATALOGUE, Pin};
use serde_json::json;

use crate::failure::Failure;
use crate::table::Table;
use crate::{numbers, terminal};

/// Show the block catalogue: pins, types, defaults and status words
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone blocks\n  isochrone blocks SawTooth\n  isochrone blocks --format json"
)]
pub(crate) struct Args {
    /// Show only this block type
    block: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Form of the output
    #[arg(long, value_enum, default_value_t = Format::Text, conflicts_with = "json")]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Format {
    /// Tables for the terminal
    Text,
    /// The block table of the README
    Markdown,
    /// One JSON document
    Json,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let wanted = |known: &&BlockType| args.block.as_ref().is_none_or(|name| name == known.name);
    let types: Vec<&BlockType> = CATALOGUE.iter().filter(wanted).collect();
    if let (Some(name), []) = (&args.block, types.as_slice()) {
        let known = CATALOGUE.iter().map(|known| known.name).collect::<Vec<_>>().join(", ");
        return Err(Failure::usage(format!(
            "there is no block type \"{name}\"; there is: {known}"
        )));
    }
    match args.format {
        Format::Json => print_json(&types),
        _ if args.json => print_json(&types),
        Format::Text => {
            let texts: Vec<String> = types.iter().map(|known| text(known)).collect();
            terminal::print(&texts.join("\n"))
        }
        Format::Markdown => terminal::print(&markdown(&types)),
    }
}

fn text(known: &BlockType) -> String {
    let mut pins = Table::default();
    for pin in known.inputs {
        pins.row(["in", pin.name, pin.pin_type.as_str(), &default(pin), pin.unit, pin.doc()]);
    }
    for pin in known.outputs {
        pins.row(["out", pin.name, pin.pin_type.as_str(), "", pin.unit, pin.doc()]);
    }
    let mut status = Table::default();
    for (code, meaning) in known.status {
        status.row([format!("16#{code:04X}"), (*meaning).to_owned()]);
    }
    let mut text = format!("{}\n  {}\n\n{}", known.name, known.doc(), pins.draw(2));
    if status.len() > 0 {
        text += &format!("\n{}", status.draw(2));
    }
    text
}

fn markdown(types: &[&BlockType]) -> String {
    let pins = |pins: &[Pin]| {
        let names = pins.iter().map(|pin| format!("`{}` {}", pin.name, pin.pin_type));
        names.collect::<Vec<_>>().join(", ")
    };
    let mut text = String::from("| block | does | inputs | outputs |\n|---|---|---|---|\n");
    for known in types {
        let (inputs, outputs) = (pins(known.inputs), pins(known.outputs));
        text += &format!("| `{}` | {} | {inputs} | {outputs} |\n", known.name, known.doc());
    }
    text
}

fn print_json(types: &[&BlockType]) -> Result<(), Failure> {
    let pin = |pin: &Pin| json!({ "name": pin.name, "type": pin.pin_type.as_str(), "unit": pin.unit, "doc": pin.doc() });
    let input = |input: &Pin| {
        let mut value = pin(input);
        // `required` tells a pin without a default from callOB, whose default is no number.
        value["required"] = json!(input.default.is_none());
        value["default"] = match input.default {
            Some(slot) if !slot.is_nan() => numbers::json(slot, input.pin_type),
            _ => json!(null),
        };
        value
    };
    let blocks = types.iter().map(|known| {
        json!({
            "name": known.name,
            "doc": known.doc(),
            "inputs": known.inputs.iter().map(input).collect::<Vec<_>>(),
            "outputs": known.outputs.iter().map(pin).collect::<Vec<_>>(),
            "status": known.status.iter().map(|(code, meaning)| {
                json!({ "code": code, "word": format!("16#{code:04X}"), "meaning": meaning })
            }).collect::<Vec<_>>(),
        })
    });
    terminal::print_json(&json!({ "blocks": blocks.collect::<Vec<_>>() }))
}

fn default(pin: &Pin) -> String {
    match pin.default {
        None => "required".into(),
        Some(slot) if slot.is_nan() => "calling task".into(),
        Some(slot) => numbers::literal(slot, pin.pin_type),
    }
}
