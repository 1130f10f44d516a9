//! Units and comments: what the file says of blocks and signals for people.

use std::collections::HashMap;

use isochrone_blocks::{BlockType, Pin, PinType};

use super::InputPart;
use super::names::{Entry, Names};
use super::pins::unknown_pin;
use super::wires::{Origin, Signal, Wiring};
use crate::Diagnostic;
use crate::config::{BlockEntry, Config, Output};
use crate::diagnostic::Problem;
use crate::parse::line::{NO_UNIT, has_unit};

/// What the file says of a block for people; of several instances, it is the same.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct BlockLabels {
    /// What it is for; empty without one.
    pub comment: String,
    /// Units of pins by their index: inputs first, then outputs.
    pub units: Vec<(usize, String)>,
}

impl BlockLabels {
    /// The unit of a pin by its index, which is the block type's unless the file gives one; empty for none.
    pub fn unit<'a>(&'a self, index: usize, pin: &'a Pin) -> &'a str {
        let given = self.units.iter().find(|(of, _)| *of == index);
        given.map_or(pin.unit, |(_, unit)| unit)
    }

    /// The units by the names of the pins, which are those of `block_type`.
    pub fn by_pin<'a>(
        &'a self,
        block_type: &BlockType,
    ) -> impl Iterator<Item = (&'static str, &'a str)> + use<'a> {
        let (inputs, outputs) = (block_type.inputs, block_type.outputs);
        let name = move |pin: usize| inputs.iter().chain(outputs).nth(pin).map(|pin| pin.name);
        self.units.iter().filter_map(move |(pin, unit)| Some((name(*pin)?, unit.as_str())))
    }
}

/// The labels of a configuration.
pub(super) struct Labels<'a> {
    config: &'a Config,
    /// In file order.
    blocks: Vec<BlockLabels>,
}

impl<'a> Labels<'a> {
    /// Reports units of pins that do not exist or cannot have one, and outputs whose unit is nobody's.
    pub(super) fn resolve(
        config: &'a Config,
        names: &Names<'_>,
        wiring: &Wiring,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let entries = config.blocks.iter().zip(&names.entries);
        let blocks = entries.map(|(block, entry)| of_block(block, entry, diagnostics)).collect();
        let labels = Self { config, blocks };
        for (output, signals) in config.outputs.iter().zip(&wiring.signals) {
            // A signal that could not be resolved is another diagnostic.
            if signals.len() == output.signals.len() {
                diagnostics.extend(labels.misfit(output, signals, names));
            }
        }
        labels
    }

    /// Those of blocks that have any, by name.
    pub(super) fn by_block(self, names: &Names<'_>) -> HashMap<String, BlockLabels> {
        let blocks = names.entries.iter().map(|entry| entry.name.to_owned()).zip(self.blocks);
        blocks.filter(|(_, labels)| *labels != BlockLabels::default()).collect()
    }

    /// The unit of a signal of an output.
    pub(super) fn unit<'b>(
        &'b self,
        output: &'b Output,
        signal: &Signal,
        names: &Names<'_>,
    ) -> &'b str {
        match self.own_unit(signal.from, names) {
            "" if has_unit(signal.value_type) => {
                output.unit.as_ref().map_or("", |unit| unit.get_ref())
            }
            own => own,
        }
    }

    /// The unit of a value where it comes from.
    fn own_unit(&self, origin: Origin, names: &Names<'_>) -> &str {
        let unit = match origin {
            Origin::Input { part: InputPart::Ok, .. } => None,
            Origin::Input { part: InputPart::Age, .. } => Some("s"),
            Origin::Input { input, part: InputPart::Value } => {
                self.config.inputs.get(input).and_then(|input| input.unit.as_deref())
            }
            Origin::Variable(variable) => {
                self.config.variables.get(variable).and_then(|known| known.unit.as_deref())
            }
            Origin::Pin { instance, pin } => self.unit_of_pin(instance, pin, names),
        };
        unit.unwrap_or_default()
    }

    fn unit_of_pin(&self, instance: usize, output: usize, names: &Names<'_>) -> Option<&str> {
        let block_type = names.entry_of(instance)?.block_type?;
        let entry = names.entries.partition_point(|entry| entry.first <= instance) - 1;
        let pin = block_type.outputs.get(output)?;
        let given = self.blocks.get(entry)?.unit(block_type.inputs.len() + output, pin);
        Some(announced(pin.pin_type, given))
    }

    /// Whether a value is that of an input in whatever unit its publisher announces.
    fn is_announced(&self, origin: Origin) -> bool {
        let Origin::Input { input, part: InputPart::Value } = origin else { return false };
        let input = self.config.inputs.get(input);
        input.is_some_and(|input| input.unit.is_none() && input.service.is_some())
    }

    /// Why the unit of an output is wrong for its signals.
    fn misfit(&self, output: &Output, signals: &[Signal], names: &Names<'_>) -> Option<Diagnostic> {
        let unit = output.unit.as_ref()?;
        let takers = signals.iter().zip(&output.signals);
        let takers: Vec<_> = takers.filter(|(signal, _)| has_unit(signal.value_type)).collect();
        let diagnostic = |message| Diagnostic::new(Problem::Conflict, unit.span(), message);
        if let Some((_, name)) = takers.iter().find(|(signal, _)| self.is_announced(signal.from)) {
            let (unit, name) = (unit.get_ref(), name.get_ref());
            return Some(
                diagnostic(format!(
                    "[[output]] unit \"{unit}\" would also be that of input {name}, whose publisher may announce \
                     another"
                ))
                .help("give the [[input]] a unit, or leave out that of the output"),
            );
        }
        if takers.iter().any(|(signal, _)| self.unit(output, signal, names) == unit.get_ref()) {
            return None;
        }
        Some(match takers.first() {
            None => {
                diagnostic("[[output]] has a unit, and none of its signals can have one".into())
                    .help(NO_UNIT)
            }
            Some((signal, name)) => diagnostic(format!(
                "[[output]] unit is \"{}\", and {} is in \"{}\"",
                unit.get_ref(),
                name.get_ref(),
                self.own_unit(signal.from, names)
            ))
            .help(
                "nothing is converted: leave the unit of the output out, or convert with a block",
            ),
        })
    }
}

fn of_block(
    block: &BlockEntry,
    entry: &Entry<'_>,
    diagnostics: &mut Vec<Diagnostic>,
) -> BlockLabels {
    let mut labels = BlockLabels {
        comment: block.comment.clone().unwrap_or_default(),
        ..BlockLabels::default()
    };
    let Some(block_type) = &entry.block_type else { return labels };
    let pins = || block_type.signals();
    let conflict = |span, message: String, help: &str| {
        Diagnostic::new(Problem::Conflict, span, message).help(help)
    };
    for (name, unit) in &block.units {
        match pins().find(|(_, pin)| pin.name == name.get_ref()) {
            Some((index, pin)) if has_unit(pin.pin_type) => {
                labels.units.push((index, unit.clone()));
            }
            Some((_, pin)) => {
                let message = format!("pin \"{}\" is a {}", name.get_ref(), pin.pin_type);
                diagnostics.push(conflict(name.span(), message, NO_UNIT));
            }
            None => {
                let pins: Vec<Pin> = pins().map(|(_, pin)| *pin).collect();
                diagnostics.push(unknown_pin(block_type, name, &pins));
            }
        }
    }
    let Some(unit) = &block.unit else { return labels };
    let main = main_output(block_type.outputs).map(|pin| block_type.inputs.len() + pin);
    match main.map(|main| (main, labels.units.iter().any(|(pin, _)| *pin == main))) {
        Some((main, false)) => labels.units.push((main, unit.get_ref().clone())),
        Some((main, true)) => {
            let pin = block_type.outputs[main - block_type.inputs.len()].name;
            let message = format!("[[block]] has two units for {pin}");
            diagnostics.push(conflict(unit.span(), message, "keep unit or units"));
        }
        None => {
            let message =
                format!("[[block]] has a unit, and {} has no output for it", block_type.name);
            diagnostics.push(conflict(unit.span(), message, NO_UNIT));
        }
    }
    labels
}

/// The first output that is a number of something.
fn main_output(outputs: &[Pin]) -> Option<usize> {
    outputs.iter().position(|pin| has_unit(pin.pin_type))
}

/// The unit as frames and files have it: a TIME is shown with its own.
pub(super) fn announced(value_type: PinType, unit: &str) -> &str {
    if value_type == PinType::Time { "" } else { unit }
}
