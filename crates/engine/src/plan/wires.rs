//! The source of every input pin and of every value in a frame: a constant, or a wire.

mod origin;

use std::collections::BTreeMap;
use std::ops::Range;

use isochrone_blocks::{BlockType, Pin, PinDefault, PinType};
use toml::Spanned;

use super::constants::constant_slot;
use super::names::{Entry, Names};
use super::pins::{suggested_pin, unknown_input};
use crate::Diagnostic;
use crate::config::{self, BlockEntry, Config, Connection};
use crate::diagnostic::Problem;

pub(super) use origin::{INSTANCE, Origin, Reader, Resolver};

/// Behind a wire that carries the value of the cycle before.
pub(super) const PREVIOUS: &str = "@prev";

/// A wire into an instance's pin.
pub(super) struct Wire {
    pub(super) from: Origin,
    pub(super) to_instance: usize,
    pub(super) to_pin: usize,
    /// It carries the value of the cycle before.
    pub(super) previous: bool,
    /// Where it stands in the file.
    pub(super) span: Range<usize>,
}

/// A channel of a frame.
pub(super) struct Signal {
    pub(super) from: Origin,
    pub(super) value_type: PinType,
}

/// Everything that is connected.
pub(super) struct Wiring {
    /// Wires in the order of the instances that they lead to.
    pub(super) wires: Vec<Wire>,
    /// For each entry the slots of its unwired input pins; `None` where a wire leads.
    pub(super) constants: Vec<Vec<Option<f64>>>,
    /// For instances that differ from the others of their entry: all their input pins.
    pub(super) exceptions: BTreeMap<usize, Vec<Option<f64>>>,
    /// For each output its signals.
    pub(super) signals: Vec<Vec<Signal>>,
}

impl Wiring {
    pub(super) fn resolve(
        config: &Config,
        names: &Names<'_>,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Self {
        let mut resolver = Resolver { names, diagnostics };
        let mut wires = Vec::new();
        let mut constants = Vec::new();
        let mut exceptions = BTreeMap::new();
        for (block, entry) in config.blocks.iter().zip(&names.entries) {
            if !block.formulas.is_empty() {
                constants.push(resolver.formulas(block, entry, &mut wires));
                continue;
            }
            let pins = resolver.pins(block, entry);
            let from = wires.len();
            let of_instances = resolver.exceptions(block, entry, &pins.constants);
            for (pin, wire) in &pins.wired {
                let is_excepted = |index: &usize| {
                    of_instances.get(index).is_some_and(|pins| pins.named.contains(pin))
                };
                let readers = (0..entry.count).filter(|index| !is_excepted(index));
                resolver.wire(block, entry, *pin, wire, readers, &mut wires);
            }
            for (index, pins) in of_instances {
                for (pin, wire) in &pins.wired {
                    resolver.wire(block, entry, *pin, wire, std::iter::once(index), &mut wires);
                }
                exceptions.insert(entry.first + index, pins.constants);
            }
            if let Some(new) = wires.get_mut(from..) {
                new.sort_by_key(|wire: &Wire| wire.to_instance);
            }
            constants.push(pins.constants);
        }
        let alarms = names.entries.get(config.blocks.len()..).unwrap_or_default();
        for (alarm, entry) in config.alarms.iter().zip(alarms) {
            constants.push(resolver.alarm(alarm, entry, &mut wires));
        }
        let signals =
            config.outputs.iter().map(|output| resolver.signals(&output.signals)).collect();
        Self { wires, constants, exceptions, signals }
    }

    /// What stands at the input pins of an instance of an entry: `None` where a wire leads.
    pub(super) fn constants_of(&self, instance: usize, entry: usize) -> &[Option<f64>] {
        let of_entry = || self.constants.get(entry).map_or(&[][..], Vec::as_slice);
        self.exceptions.get(&instance).map_or_else(of_entry, Vec::as_slice)
    }

    /// The wires that lead to an instance.
    pub(super) fn wires_to(&self, instance: usize) -> &[Wire] {
        let start = self.wires.partition_point(|wire| wire.to_instance < instance);
        let tail = self.wires.get(start..).unwrap_or_default();
        let len = tail.partition_point(|wire| wire.to_instance == instance);
        tail.get(..len).unwrap_or_default()
    }
}

/// The input pins of an entry.
#[derive(Default)]
struct Pins<'a> {
    constants: Vec<Option<f64>>,
    wired: Vec<(usize, Spanned<&'a str>)>,
    /// The pins that something was written for.
    named: Vec<usize>,
}

impl Resolver<'_, '_> {
    /// The wires to what the expressions of an `Expr` read; of an entry without a type, reports what is wrong with them.
    fn formulas(
        &mut self,
        block: &BlockEntry,
        entry: &Entry<'_>,
        wires: &mut Vec<Wire>,
    ) -> Vec<Option<f64>> {
        let names = block.formulas.iter().flat_map(|formula| &formula.names);
        let from = wires.len();
        for (pin, name) in names.clone().enumerate() {
            let wire = Spanned::new(name.span(), name.get_ref().as_str());
            if entry.block_type.is_some() {
                self.wire(block, entry, pin, &wire, 0..entry.count, wires);
            } else {
                let text = name.get_ref().strip_suffix(PREVIOUS).unwrap_or(name.get_ref());
                self.origin(&text.replace(INSTANCE, "0"), name.span(), Reader::Instances);
            }
        }
        if let Some(new) = wires.get_mut(from..) {
            new.sort_by_key(|wire: &Wire| wire.to_instance);
        }
        vec![None; names.count()]
    }

    /// Sorts an entry's connections into constants and wires, and reports what is wrong with them.
    fn pins<'b>(&mut self, block: &'b BlockEntry, entry: &Entry<'_>) -> Pins<'b> {
        let Some(block_type) = &entry.block_type else { return Pins::default() };
        let defaults = block_type.inputs.iter().map(|pin| pin.default.slot()).collect();
        let (pins, misnamed) = self.connected(&block.pins, block_type, defaults);
        let connected = |pin: &Pin| {
            let mut names = block.pins.iter().map(|(name, _)| name.get_ref().as_str());
            names.any(|name| name == pin.name)
                || misnamed.contains(&pin.name)
                || block.misplaced_pins.iter().any(|misplaced| misplaced == pin.name)
        };
        let missing: Vec<_> = block_type
            .inputs
            .iter()
            .filter(|pin| pin.default == PinDefault::Required && !connected(pin))
            .map(|pin| pin.name)
            .collect();
        if !missing.is_empty() {
            let (noun, verb) = if missing.len() == 1 { ("pin", "is") } else { ("pins", "are") };
            let message = format!(
                "{noun} {} of block \"{}\" {verb} not connected",
                missing.join(", "),
                entry.name
            );
            self.report(Diagnostic::new(Problem::MissingPin, entry.span.clone(), message).help(
                format!("{} has no default for them: set them in [block.in]", block_type.name),
            ));
        }
        pins
    }

    /// Sorts connections into constants and wires, where `constants` stand otherwise. Returns also the
    /// pins that are connected, under another name than theirs.
    fn connected<'b>(
        &mut self,
        written: &'b config::Pins,
        block_type: &BlockType,
        constants: Vec<Option<f64>>,
    ) -> (Pins<'b>, Vec<&'static str>) {
        let mut pins = Pins { constants, wired: Vec::new(), named: Vec::new() };
        let mut misnamed = Vec::new();
        for (name, connection) in written {
            let found = block_type.inputs.iter().position(|pin| pin.name == name.get_ref());
            let Some(index) = found else {
                self.report(unknown_input(block_type, name));
                misnamed
                    .extend(suggested_pin(name.get_ref(), block_type.inputs).map(|pin| pin.name));
                continue;
            };
            let (Some(connection), Some(pin)) = (connection, block_type.inputs.get(index)) else {
                continue;
            };
            let constant = match constant_slot(connection.get_ref(), pin, self.names) {
                Some(Ok(slot)) => Some(slot),
                Some(Err(diagnostic)) => {
                    self.report(Diagnostic { span: connection.span(), ..diagnostic });
                    continue;
                }
                None => {
                    if let Connection::Wire(wire) = connection.get_ref() {
                        pins.wired.push((index, Spanned::new(connection.span(), wire)));
                    }
                    None
                }
            };
            pins.named.push(index);
            if let Some(slot) = pins.constants.get_mut(index) {
                *slot = constant;
            }
        }
        (pins, misnamed)
    }

    /// The pins of the instances that have a table of their own.
    fn exceptions<'b>(
        &mut self,
        block: &'b BlockEntry,
        entry: &Entry<'_>,
        constants: &[Option<f64>],
    ) -> BTreeMap<usize, Pins<'b>> {
        let mut exceptions = BTreeMap::new();
        let Some(block_type) = &entry.block_type else { return exceptions };
        for (number, written) in &block.instances {
            let index: Option<usize> = number.get_ref().parse().ok();
            // Of "07", TOML makes another key than of "7".
            let index = index.filter(|index| *index < entry.count);
            let index = index.filter(|index| index.to_string() == *number.get_ref());
            match index {
                Some(index) if entry.count > 1 => {
                    let (pins, _) = self.connected(written, block_type, constants.to_vec());
                    exceptions.insert(index, pins);
                }
                _ if entry.count_is_known => {
                    let (name, number_text) = (entry.name, number.get_ref());
                    let message = format!("there is no \"{name}.{number_text}\"");
                    let diagnostic =
                        Diagnostic::new(Problem::UnknownSource, number.span(), message);
                    self.report(diagnostic.help(match entry.count {
                        1 => format!("{name} is a single block; write its pins in [block.in]"),
                        count => format!("the instances of {name} are 0 to {}", count - 1),
                    }));
                }
                _ => {}
            }
        }
        exceptions
    }

    /// Resolves a wire for instances of an entry.
    fn wire(
        &mut self,
        block: &BlockEntry,
        entry: &Entry<'_>,
        to_pin: usize,
        wire: &Spanned<&str>,
        readers: impl Iterator<Item = usize>,
        wires: &mut Vec<Wire>,
    ) {
        let Some(pin) = entry.block_type.and_then(|known| known.inputs.get(to_pin)) else { return };
        let (text, previous) = match wire.get_ref().strip_suffix(PREVIOUS) {
            Some(text) => (text, true),
            None => (*wire.get_ref(), false),
        };
        let same_for_all = !text.contains(INSTANCE);
        if !same_for_all && block.count.is_none() && !block.count_is_wrong {
            self.report(has_no_number(entry.name, wire));
            return;
        }
        let mut resolved = None;
        for index in readers {
            if resolved.is_none() || !same_for_all {
                let text = text.replace(INSTANCE, &index.to_string());
                let reader = if same_for_all {
                    Reader::Instances
                } else {
                    Reader::Instance(entry.name, index)
                };
                match self.origin(&text, wire.span(), reader) {
                    Some(origin) => resolved = Some(origin),
                    // One error for the wire, not one for each instance.
                    None => return,
                }
                if let Some((from, from_type)) = resolved
                    && let Err(diagnostic) = self.check(from, from_type, pin, &text, previous)
                {
                    self.report(Diagnostic { span: wire.span(), ..diagnostic });
                    return;
                }
            }
            let Some((from, _)) = resolved else { return };
            let to_instance = entry.first + index;
            wires.push(Wire { from, to_instance, to_pin, previous, span: wire.span() });
        }
    }

    fn check(
        &self,
        from: Origin,
        from_type: PinType,
        pin: &Pin,
        text: &str,
        previous: bool,
    ) -> Result<(), Diagnostic> {
        let what = match from {
            Origin::Input { .. } => "an input",
            Origin::Variable(_) => "a variable",
            Origin::Pin { .. } => "",
        };
        if previous && !what.is_empty() {
            let message = has_no_previous(text, what);
            return Err(Diagnostic::new(Problem::UnknownSource, 0..0, message)
                .help("@prev goes behind a block's output pin"));
        }
        if !from_type.feeds(pin.pin_type) {
            let message =
                format!("\"{text}\" is {from_type}, but pin {} takes {}", pin.name, pin.pin_type);
            return Err(Diagnostic::new(Problem::TypeMismatch, 0..0, message)
                .help("a wire joins pins of the same type; INT also feeds LREAL"));
        }
        Ok(())
    }

    fn signals(&mut self, signals: &[Spanned<String>]) -> Vec<Signal> {
        signals
            .iter()
            .filter_map(|signal| {
                let (text, span) = (signal.get_ref().as_str(), signal.span());
                let current = text.strip_suffix(PREVIOUS);
                let what = |name: &str| match self.names.input_part(name) {
                    Some(_) => Some("an input"),
                    None => self.names.variables.contains_key(name).then_some("a variable"),
                };
                if let Some((name, what)) = current.and_then(|name| Some((name, what(name)?))) {
                    let message = has_no_previous(name, what);
                    let diagnostic = Diagnostic::new(Problem::UnknownSource, span, message);
                    self.report(
                        diagnostic.help(format!("{what} has no {PREVIOUS}; write \"{name}\"")),
                    );
                    return None;
                }
                let (from, value_type) = self.origin(text, span, Reader::Output)?;
                Some(Signal { from, value_type })
            })
            .collect()
    }
}

/// The wire has the number of the reading instance, and a single block has none.
fn has_no_number(name: &str, wire: &Spanned<&str>) -> Diagnostic {
    let message = format!(
        "\"{}\" has {INSTANCE}, the number of the reading instance, and {name} has no count",
        wire.get_ref()
    );
    let first = wire.get_ref().replace(INSTANCE, "0");
    Diagnostic::new(Problem::UnknownSource, wire.span(), message)
        .help(format!("write the number that is meant, as in \"{first}\", or give {name} a count"))
}

pub(super) fn has_no_previous(name: &str, what: &str) -> String {
    format!("\"{name}\" is {what}, which has no value of the cycle before")
}
