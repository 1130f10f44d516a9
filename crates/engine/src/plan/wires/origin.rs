//! Resolving the text of a wire.

use std::ops::Range;

use isochrone_blocks::PinType;

use crate::Diagnostic;
use crate::diagnostic::{Among, Problem};
use crate::plan::InputPart;
use crate::plan::names::Names;
use crate::plan::pins::{part_of_variable, unknown_output, unknown_part};

/// Stands for the number of an instance in a wire.
pub(in crate::plan) const INSTANCE: &str = "{i}";

/// Where a wire comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::plan) enum Origin {
    /// An input of the node, or what that is worth.
    Input { input: usize, part: InputPart },
    /// A variable.
    Variable(usize),
    /// An output pin of an instance.
    Pin { instance: usize, pin: usize },
}

/// What reads a value.
#[derive(Clone, Copy)]
pub(in crate::plan) enum Reader<'a> {
    /// A frame.
    Output,
    /// An instance of an entry, by a wire that is the same for all of them.
    Instances,
    /// An instance of the entry of this name, by a wire with its number.
    Instance(&'a str, usize),
}

/// The names of a configuration, and what is found wrong with its wires.
pub(in crate::plan) struct Resolver<'a, 'f> {
    pub(in crate::plan) names: &'a Names<'a>,
    pub(super) diagnostics: &'f mut Vec<Diagnostic>,
}

impl Resolver<'_, '_> {
    pub(in crate::plan) fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// The wire that `ramp[0].y` stands for.
    fn without_brackets(&self, name: &str, rest: &str) -> Option<String> {
        let (name, index) = name.strip_suffix(']')?.split_once('[')?;
        let block = self.names.blocks.get(name)?;
        let count = self.names.entries.get(*block)?.count;
        let index: usize = index.trim().parse().ok().filter(|index| *index < count)?;
        Some(match count {
            1 => format!("{name}.{rest}"),
            _ => format!("{name}.{index}.{rest}"),
        })
    }

    /// What a wire's text stands for; reports what is wrong with it. `None` without a report where
    /// the error is known already.
    pub(in crate::plan) fn origin(
        &mut self,
        text: &str,
        span: Range<usize>,
        reader: Reader<'_>,
    ) -> Option<(Origin, PinType)> {
        if let Some((input, part)) = self.names.input_part(text) {
            let value_type = match part {
                InputPart::Value => input.value_type?,
                part => part.pin_type(PinType::Lreal),
            };
            return Some((Origin::Input { input: input.index, part }, value_type));
        }
        if let Some(variable) = self.names.variables.get(text) {
            return Some((Origin::Variable(variable.index), variable.value_type?));
        }
        let mut parts = text.splitn(2, '.');
        let (name, rest) = (parts.next().unwrap_or_default(), parts.next());
        let Some(rest) = rest else {
            let has_variables = !self.names.variables.is_empty();
            let noun = if has_variables { "input or variable" } else { "input" };
            let message = format!("there is no {noun} \"{name}\"");
            let diagnostic = Diagnostic::new(Problem::UnknownSource, span, message);
            let diagnostic =
                match self.names.blocks.get(name).and_then(|b| self.names.entries.get(*b)) {
                    Some(entry) => diagnostic.help(match entry.block_type?.outputs.first() {
                        Some(pin) if entry.block_type?.is_alarm() => {
                            format!("{name} is an alarm; write \"{name}.{}\"", pin.name)
                        }
                        Some(pin) => format!(
                            "{name} is a block; name one of its output pins, such as \"{name}.{}\"",
                            pin.name
                        ),
                        None => format!("{name} is a block without outputs"),
                    }),
                    None => diagnostic.seek(name, Among::Inputs),
                };
            self.report(diagnostic);
            return None;
        };
        let found = self.names.blocks.get(name).and_then(|block| self.names.entries.get(*block));
        let Some(entry) = found else {
            if self.names.inputs.contains_key(name) {
                self.report(unknown_part(name, rest, span));
                return None;
            }
            if self.names.variables.contains_key(name) {
                self.report(part_of_variable(name, rest, span));
                return None;
            }
            let diagnostic = Diagnostic::new(
                Problem::UnknownSource,
                span,
                format!("there is no block \"{name}\""),
            );
            self.report(match self.without_brackets(name, rest) {
                Some(right) => diagnostic.help(format!("write \"{right}\"")),
                None => diagnostic.seek(name, Among::Blocks),
            });
            return None;
        };
        let block_type = entry.block_type.filter(|_| entry.count_is_known)?;
        let (index, pin_name) = match rest.split_once('.') {
            Some((index, pin)) => match index.parse::<usize>() {
                Ok(index) if index < entry.count => (index, pin),
                _ => {
                    let mut message = format!("there is no \"{name}.{index}\"");
                    if let Reader::Instance(reader, number) = reader {
                        message += &format!(", which instance {number} of {reader} is wired to");
                    }
                    self.report(Diagnostic::new(Problem::UnknownSource, span, message).help(
                        match entry.count {
                            1 => format!("{name} is a single block: \"{name}.{pin}\""),
                            _ if index == INSTANCE => format!(
                                "{INSTANCE} is for wires; name each instance: \"{name}.0.{pin}\", \"{name}.1.{pin}\" …"
                            ),
                            count => format!(
                                "the instances of {name} are {name}.0 to {name}.{}",
                                count - 1
                            ),
                        },
                    ));
                    return None;
                }
            },
            None if entry.count > 1 => {
                let diagnostic = Diagnostic::new(
                    Problem::UnknownSource,
                    span,
                    format!(
                        "\"{text}\" does not say which of the {} instances of {name}",
                        entry.count
                    ),
                );
                self.report(diagnostic.help(match reader {
                    Reader::Output => format!(
                        "name each instance: \"{name}.0.{rest}\", \"{name}.1.{rest}\" …"
                    ),
                    Reader::Instances | Reader::Instance(..) => format!(
                        "\"{name}.0.{rest}\" is the first, \"{name}.{INSTANCE}.{rest}\" the one with the reader's number"
                    ),
                }));
                return None;
            }
            None => (0, rest),
        };
        let Some(pin) = block_type.outputs.iter().position(|pin| pin.name == pin_name) else {
            let pin = text.split_at(text.len() - pin_name.len());
            self.report(unknown_output(&block_type, name, pin, span));
            return None;
        };
        let value_type = block_type.outputs.get(pin)?.pin_type;
        Some((Origin::Pin { instance: entry.first + index, pin }, value_type))
    }
}
