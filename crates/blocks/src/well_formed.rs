//! Rules for every declaration, checked when a block is compiled.

use crate::status::is_status;
use crate::{Pin, PinType};

/// Fails to compile for a block whose pins could not be named, wired or read.
pub(crate) const fn assert_well_formed(inputs: &[Pin], outputs: &[Pin]) {
    assert!(!inputs.is_empty() || !outputs.is_empty(), "a block needs a pin");
    let pins = inputs.len() + outputs.len();
    let mut index = 0;
    while index < pins {
        let name = at(inputs, outputs, index).name;
        assert!(
            is_identifier(name),
            "a pin's name is a letter or `_`, then letters, digits and `_`, all of them ASCII"
        );
        let mut other = 0;
        while other < index {
            assert!(!is_same(name, at(inputs, outputs, other).name), "two pins have the same name");
            other += 1;
        }
        index += 1;
    }
    assert_latches(inputs);
    assert_status_is_a_word(outputs);
}

/// A pin by its place among the inputs and, behind them, the outputs.
const fn at<'a>(inputs: &'a [Pin], outputs: &'a [Pin], index: usize) -> &'a Pin {
    if index < inputs.len() { &inputs[index] } else { &outputs[index - inputs.len()] }
}

const fn assert_latches(inputs: &[Pin]) {
    let mut index = 0;
    while index < inputs.len() {
        if let Some(latch) = inputs[index].latched_by {
            let (mut other, mut is_there) = (0, false);
            while other < inputs.len() {
                let is_bool = matches!(inputs[other].pin_type, PinType::Bool);
                is_there |= is_bool && is_same(latch, inputs[other].name);
                other += 1;
            }
            assert!(is_there, "`latched_by` names no BOOL input of the block");
        }
        index += 1;
    }
}

const fn assert_status_is_a_word(outputs: &[Pin]) {
    let mut index = 0;
    while index < outputs.len() {
        assert!(
            !is_status(outputs[index].name) || matches!(outputs[index].pin_type, PinType::Word),
            "the output `\"status\"` holds a status word: declare it as `\"status\" => status: u16`"
        );
        index += 1;
    }
}

/// An identifier of IEC 61131-3. It stands in a configuration as a key and behind the dot of `block.pin`.
const fn is_identifier(name: &str) -> bool {
    let bytes = name.as_bytes();
    let mut index = 0;
    while index < bytes.len() {
        let is_first_digit = index == 0 && bytes[index].is_ascii_digit();
        if is_first_digit || !(bytes[index].is_ascii_alphanumeric() || bytes[index] == b'_') {
            return false;
        }
        index += 1;
    }
    !bytes.is_empty()
}

/// `==`, which constants do not have for texts.
const fn is_same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len() != b.len() {
        return false;
    }
    let mut index = 0;
    while index < a.len() {
        if a[index] != b[index] {
            return false;
        }
        index += 1;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_a_configuration_could_not_tell_from_something_else_is_no_identifier() {
        for good in ["x", "_x", "setChangeRate", "x1", "Ret_Val"] {
            assert!(is_identifier(good), "{good}");
        }
        for bad in ["", "1x", "a.b", "a@prev", "{i}", "a\nb", "a b", "ä", "a\"b"] {
            assert!(!is_identifier(bad), "{bad:?}");
        }
    }

    #[test]
    fn names_are_the_same_only_if_all_of_them_is() {
        assert!(is_same("x1", "x1") && is_same("", ""));
        assert!(!is_same("x1", "x2") && !is_same("x", "x1") && !is_same("x", ""));
    }
}
