//! Suggestions for pins that a block does not have.

use std::ops::Range;

use isochrone_blocks::{BlockType, Pin};
use toml::Spanned;

use super::InputPart;
use crate::Diagnostic;
use crate::diagnostic::Problem;
use crate::nearest::{KnownNames, nearest_name};

pub(super) fn unknown_input(block_type: &BlockType, name: &Spanned<String>) -> Diagnostic {
    let message = format!("{} has no input pin \"{}\"", block_type.name, name.get_ref());
    let diagnostic = Diagnostic::new(Problem::UnknownPin, name.span(), message);
    if block_type.outputs.iter().any(|pin| pin.name == name.get_ref()) {
        return diagnostic.help(format!("{} is an output pin; it cannot be set", name.get_ref()));
    }
    which_pin(diagnostic, "", name.get_ref(), block_type.inputs)
}

/// The diagnostic about a name that is none of a block's pins.
pub(super) fn unknown_pin(
    block_type: &BlockType,
    name: &Spanned<String>,
    pins: &[Pin],
) -> Diagnostic {
    let message = format!("{} has no pin \"{}\"", block_type.name, name.get_ref());
    let diagnostic = Diagnostic::new(Problem::UnknownPin, name.span(), message);
    which_pin(diagnostic, "", name.get_ref(), pins)
}

/// A block or an alarm, for a message.
pub(super) fn described(block_type: &BlockType, name: &str) -> String {
    if block_type.is_alarm() {
        format!("alarm \"{name}\"")
    } else {
        format!("block \"{name}\" ({})", block_type.name)
    }
}

/// `owner` is the instance as it is written before the pin, with its dot.
pub(super) fn unknown_output(
    block_type: &BlockType,
    block: &str,
    (owner, pin): (&str, &str),
    span: Range<usize>,
) -> Diagnostic {
    let is_alarm = block_type.is_alarm();
    let pin_word = if is_alarm { "signal" } else { "output pin" };
    let message = format!("{} has no {pin_word} \"{pin}\"", described(block_type, block));
    let diagnostic = Diagnostic::new(Problem::UnknownPin, span, message);
    if block_type.parameters().iter().any(|input| input.name == pin) {
        return diagnostic.help(format!("{pin} is an input pin; a wire starts at an output pin"));
    }
    which_pin(diagnostic, owner, pin, block_type.outputs)
}

/// The diagnostic about a part that an input does not have.
pub(super) fn unknown_part(input: &str, part: &str, span: Range<usize>) -> Diagnostic {
    let message = format!("input \"{input}\" has no \"{part}\"");
    let parts = InputPart::ALL.map(|part| format!("{input}{}", part.suffix()));
    Diagnostic::new(Problem::UnknownSource, span, message)
        .did_you_mean(&format!("{input}.{part}"), parts.iter().map(String::as_str))
}

/// The diagnostic about a part that a variable does not have.
pub(super) fn part_of_variable(variable: &str, part: &str, span: Range<usize>) -> Diagnostic {
    let message = format!("variable \"{variable}\" has no \"{part}\"");
    Diagnostic::new(Problem::UnknownSource, span, message)
        .help(format!("operators give it, so it is always good; write \"{variable}\""))
}

/// The pin with this alias.
fn pin_by_alias<'a>(written: &str, pins: &'a [Pin]) -> Option<&'a Pin> {
    let has_alias =
        |pin: &&Pin| pin.aliases.iter().any(|alias| alias.eq_ignore_ascii_case(written));
    pins.iter().find(has_alias)
}

/// The nearest pin, by alias or name.
pub(super) fn suggested_pin<'a>(written: &str, pins: &'a [Pin]) -> Option<&'a Pin> {
    let near = || nearest_name(written, pins.iter().map(|pin| pin.name));
    pin_by_alias(written, pins).or_else(|| {
        let name = near()?;
        pins.iter().find(|pin| pin.name == name)
    })
}

/// Suggests a pin, with its owner's name before it, so that it can be copied.
fn which_pin(diagnostic: Diagnostic, owner: &str, written: &str, pins: &[Pin]) -> Diagnostic {
    if let Some(pin) = pin_by_alias(written, pins) {
        return diagnostic.help(format!("what LGF calls {written} is pin \"{}\" here", pin.name));
    }
    let known = KnownNames::new(pins.iter().map(|pin| pin.name));
    diagnostic.help(match known.nearest(written) {
        Some(near) => format!("did you mean \"{owner}{near}\"?"),
        None => known.listing(),
    })
}
