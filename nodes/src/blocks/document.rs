//! The catalogue for programs.

use isochrone_blocks::{BlockType, Decision, Origin, Pin, PinDefault, StatusWord};
use serde::Serialize;

use crate::numbers::Typed;

#[derive(Serialize)]
pub(super) struct Document<'a> {
    blocks: Vec<BlockRow<'a>>,
}

#[derive(Serialize)]
struct BlockRow<'a> {
    name: &'a str,
    doc: &'a str,
    follows: Option<&'a str>,
    inputs: Vec<InputRow<'a>>,
    outputs: Vec<PinRow<'a>>,
    computes: &'a [&'a str],
    status: Vec<StatusRow<'a>>,
    decisions: Vec<DecisionRow<'a>>,
}

#[derive(Serialize)]
struct PinRow<'a> {
    name: &'a str,
    #[serde(rename = "type")]
    value_type: &'a str,
    unit: &'a str,
    doc: &'a str,
    aliases: &'a [&'a str],
}

#[derive(Serialize)]
struct InputRow<'a> {
    #[serde(flatten)]
    pin: PinRow<'a>,
    /// Distinguishes a pin without a default from callOB, whose default is not a number.
    required: bool,
    default: Option<Typed>,
    latched_by: Option<&'a str>,
}

#[derive(Serialize)]
struct StatusRow<'a> {
    code: u16,
    word: String,
    name: &'a str,
    origin: &'a str,
    meaning: &'a str,
}

#[derive(Serialize)]
struct DecisionRow<'a> {
    silent_on: &'a str,
    chosen: &'a str,
}

impl<'a> Document<'a> {
    pub(super) fn of(types: &[&'a BlockType]) -> Self {
        Self { blocks: types.iter().map(|known| BlockRow::of(known)).collect() }
    }
}

impl<'a> BlockRow<'a> {
    fn of(known: &'a BlockType) -> Self {
        Self {
            name: known.name,
            doc: known.doc(),
            follows: known.follows,
            inputs: known.inputs.iter().map(InputRow::of).collect(),
            outputs: known.outputs.iter().map(PinRow::of).collect(),
            computes: known.computes,
            status: known.status.iter().map(StatusRow::of).collect(),
            decisions: known.decisions.iter().map(DecisionRow::of).collect(),
        }
    }
}

impl<'a> PinRow<'a> {
    fn of(pin: &'a Pin) -> Self {
        Self {
            name: pin.name,
            value_type: pin.pin_type.as_str(),
            unit: pin.unit,
            doc: pin.doc(),
            aliases: pin.aliases,
        }
    }
}

impl<'a> InputRow<'a> {
    fn of(pin: &'a Pin) -> Self {
        let default = match pin.default {
            PinDefault::Value(value) => Some(Typed { value, value_type: pin.pin_type }),
            PinDefault::Required | PinDefault::CallingTask => None,
        };
        let required = pin.default == PinDefault::Required;
        Self { pin: PinRow::of(pin), required, default, latched_by: pin.latched_by }
    }
}

impl<'a> StatusRow<'a> {
    fn of(word: &'a StatusWord) -> Self {
        let origin = match word.origin {
            Origin::Document => "document",
            Origin::Ours => "ours",
        };
        let (code, name, meaning) = (word.code, word.name, word.meaning);
        Self { code, word: format!("16#{code:04X}"), name, origin, meaning }
    }
}

impl<'a> DecisionRow<'a> {
    fn of(decision: &'a Decision) -> Self {
        Self { silent_on: decision.silent_on, chosen: decision.chosen }
    }
}
