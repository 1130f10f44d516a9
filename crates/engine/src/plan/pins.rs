//! Pins that a block does not have: which one was meant.

use std::ops::Range;

use isochrone_blocks::{BlockType, Pin};
use toml::Spanned;

use super::InputPart;
use crate::ConfigFinding;
use crate::finding::Problem;
use crate::nearest::{KnownNames, nearest_name};

pub(super) fn unknown_input(block_type: &BlockType, name: &Spanned<String>) -> ConfigFinding {
    let message = format!("{} has no input pin \"{}\"", block_type.name, name.get_ref());
    let finding = ConfigFinding::new(Problem::UnknownPin, name.span(), message);
    if block_type.outputs.iter().any(|pin| pin.name == name.get_ref()) {
        return finding.help(format!("{} is an output pin; it cannot be set", name.get_ref()));
    }
    which_pin(finding, "", name.get_ref(), block_type.inputs)
}

/// `owner` is the instance as it is written before the pin, with its dot.
pub(super) fn unknown_output(
    block_type: &BlockType,
    block: &str,
    (owner, pin): (&str, &str),
    span: Range<usize>,
) -> ConfigFinding {
    let message = format!("block \"{block}\" ({}) has no output pin \"{pin}\"", block_type.name);
    let finding = ConfigFinding::new(Problem::UnknownPin, span, message);
    if block_type.inputs.iter().any(|input| input.name == pin) {
        return finding.help(format!("{pin} is an input pin; a wire starts at an output pin"));
    }
    which_pin(finding, owner, pin, block_type.outputs)
}

/// What an input does not have beside its value.
pub(super) fn unknown_part(input: &str, part: &str, span: Range<usize>) -> ConfigFinding {
    let message = format!("input \"{input}\" has no \"{part}\"");
    let parts = InputPart::ALL.map(|part| format!("{input}{}", part.suffix()));
    ConfigFinding::new(Problem::UnknownSource, span, message)
        .did_you_mean(&format!("{input}.{part}"), parts.iter().map(String::as_str))
}

/// What a variable does not have beside its value.
pub(super) fn part_of_variable(variable: &str, part: &str, span: Range<usize>) -> ConfigFinding {
    let message = format!("variable \"{variable}\" has no \"{part}\"");
    ConfigFinding::new(Problem::UnknownSource, span, message)
        .help(format!("operators give it, so it is always good; write \"{variable}\""))
}

/// The pin that is also called so.
fn pin_by_alias<'a>(written: &str, pins: &'a [Pin]) -> Option<&'a Pin> {
    let is_meant = |pin: &&Pin| pin.aliases.iter().any(|alias| alias.eq_ignore_ascii_case(written));
    pins.iter().find(is_meant)
}

/// The pin that was probably meant.
pub(super) fn meant_pin<'a>(written: &str, pins: &'a [Pin]) -> Option<&'a Pin> {
    let near = || nearest_name(written, pins.iter().map(|pin| pin.name));
    pin_by_alias(written, pins).or_else(|| {
        let name = near()?;
        pins.iter().find(|pin| pin.name == name)
    })
}

/// Says which pin was meant, with what stands before it, so that it can be copied.
fn which_pin(finding: ConfigFinding, owner: &str, written: &str, pins: &[Pin]) -> ConfigFinding {
    if let Some(pin) = pin_by_alias(written, pins) {
        return finding.help(format!("what LGF calls {written} is pin \"{}\" here", pin.name));
    }
    let known = KnownNames::new(pins.iter().map(|pin| pin.name));
    finding.help(match known.nearest(written) {
        Some(near) => format!("did you mean \"{owner}{near}\"?"),
        None => known.listing(),
    })
}
