//! `blocks`: the catalogue.

mod document;
mod page;
mod text;

use clap::ValueEnum;
use isochrone_blocks::{BlockType, EXPR};
use isochrone_report::Table;

use self::document::Document;
use self::text::{default, document, families, meaning, source, word_meaning};
use crate::base::failure::Failure;
use crate::base::{suggestion, terminal};

/// Show the block catalogue, or function, pins, status words and design decisions of a block
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  isochrone blocks\n  isochrone blocks SawTooth\n  isochrone blocks --format json"
)]
pub(crate) struct Args {
    /// Show this block type with all that is known of it
    block: Option<String>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    /// Output format
    #[arg(long, value_enum, default_value_t = Format::Text, conflicts_with = "json")]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Format {
    /// For the terminal: all block types by family, or one in full
    Text,
    /// The block table of the README
    Markdown,
    /// The reference page docs/blocks.md
    Page,
    /// One JSON document
    Json,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let wanted = |known: &&BlockType| args.block.as_ref().is_none_or(|name| name == known.name);
    let known = || catalogue.iter().chain([&EXPR]);
    let types: Vec<&BlockType> = known().filter(wanted).collect();
    if let (Some(name), []) = (&args.block, types.as_slice()) {
        let names = || known().map(|known| known.name);
        let question = suggestion::question(name, names());
        let known = names().collect::<Vec<_>>().join(", ");
        return Err(Failure::usage(format!(
            "there is no block type \"{name}\"; there is: {known}{question}"
        )));
    }
    match args.format {
        Format::Json => terminal::print_json(&Document::of(&types)),
        _ if args.json => terminal::print_json(&Document::of(&types)),
        Format::Text if args.block.is_none() => terminal::print(&overview(&types)),
        Format::Text => terminal::print(&types.iter().map(|known| text(known)).collect::<String>()),
        Format::Markdown => terminal::print(&markdown(&types)),
        Format::Page => terminal::print(&page::page(&types)),
    }
}

fn text(known: &BlockType) -> String {
    let mut pins = Table::default();
    for pin in known.inputs {
        pins.row([
            "in",
            pin.name,
            pin.pin_type.as_str(),
            &default(pin),
            pin.unit,
            &meaning(known, pin),
        ]);
    }
    for pin in known.outputs {
        pins.row(["out", pin.name, pin.pin_type.as_str(), "", pin.unit, &meaning(known, pin)]);
    }
    let mut text = format!("{}\n  {}\n", known.name, known.doc());
    text += &source(known).map_or_else(String::new, |source| format!("  {source}\n"));
    text += &format!("\n{}", pins.draw(2));
    let mut section = |title: &str, lines: Vec<String>| {
        if !lines.is_empty() {
            text += &format!("\n  {title}\n    {}\n", lines.join("\n    "));
        }
    };
    section("computes", known.computes.iter().map(|sentence| sentence.to_string()).collect());
    let mut status = Table::default();
    for word in known.status {
        status.row([format!("16#{:04X}", word.code), word.name.into(), word_meaning(known, word)]);
    }
    section("status", status.draw(0).lines().map(Into::into).collect());
    let decisions = known.decisions.iter();
    let silent = document(known).map(|name| format!("not specified by {name}"));
    section(
        silent.as_deref().unwrap_or("chosen"),
        decisions.map(|d| format!("{}: {}", d.silent_on, d.chosen)).collect(),
    );
    text
}

/// What each block type does, by family.
fn overview(types: &[&BlockType]) -> String {
    let of_family = |(family, blocks): (&str, Vec<&BlockType>)| {
        let mut rows = Table::default();
        blocks.iter().for_each(|known| rows.row([known.name, known.doc()]));
        format!("{family}\n{}\n", rows.draw(2))
    };
    let families: String = families(types).into_iter().map(of_family).collect();
    format!("{families}`isochrone blocks NAME` shows one with its pins.\n")
}

fn markdown(types: &[&BlockType]) -> String {
    let mut text = String::from("| follows | blocks |\n|---|---|\n");
    for (family, blocks) in families(types) {
        let names: Vec<_> = blocks.iter().map(|known| format!("`{}`", known.name)).collect();
        text += &format!("| {family} | {} |\n", names.join(", "));
    }
    text
}
