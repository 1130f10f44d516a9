//! Finds constants that make a block of the library report an error from its first call, or need a caution.
//!
//! Blocks from elsewhere are not stepped before the node runs: nothing is known of what they do with
//! values that their wires may never bring.

use isochrone_blocks::{BlockType, Cycle, Ob, Pin, PinType, status};

use super::names::{Entry, Names};
use super::wires::Wiring;
use crate::Diagnostic;
use crate::diagnostic::Problem;

/// What wired pins are tried with.
const LREALS: [f64; 8] = [0.0, 1.0, -1.0, 1e6, -1e6, 1e150, -1e150, f64::MAX];
const TRIES: u64 = 256;

/// Tries every entry with its constants.
pub(super) fn constants(names: &Names<'_>, wiring: &Wiring, diagnostics: &mut Vec<Diagnostic>) {
    let obs = names.obs();
    for (entry, constants) in names.entries.iter().zip(&wiring.constants) {
        let (Some(block_type), Some(task)) = (&entry.block_type, entry.task) else { continue };
        let period_ns = names.tasks[task].period_ns;
        if let Some(status) = first_error(block_type, constants, period_ns, &obs) {
            diagnostics.push(diagnostic(entry, entry.name, block_type, status));
            continue;
        }
        let instances = wiring.exceptions.range(entry.first..entry.first + entry.count);
        for (instance, constants) in instances {
            if let Some(status) = first_error(block_type, constants, period_ns, &obs) {
                let name = entry.instance_name(instance - entry.first);
                diagnostics.push(diagnostic(entry, &name, block_type, status));
            }
        }
    }
}

/// Status word of an instance's first call with these constants at its input pins, if that is an
/// error; `None` for a block from outside the library, which is not called. Where wires lead (`None`), many values
/// are tried: an error that none of them avoids is the constants' doing. `obs` are the OB numbers and periods in ns
/// of the node's tasks.
pub fn first_error(
    block_type: &BlockType,
    constants: &[Option<f64>],
    period_ns: u64,
    obs: &[(i16, u64)],
) -> Option<u16> {
    if !block_type.is_of_library() {
        return None;
    }
    let cycle = Cycle::new(0, period_ns, obs);
    let status = |attempt: u64| {
        let slot = |(index, (pin, constant)): (usize, (&Pin, &Option<f64>))| {
            constant.unwrap_or_else(|| wired_slot(pin, index, attempt))
        };
        let pins = block_type.inputs.iter().zip(constants).enumerate();
        first_status(block_type, pins.map(slot).collect(), &cycle)
    };
    let first = status(0)?;
    let is_wired = constants.iter().any(Option::is_none);
    (!is_wired || (1..TRIES).all(|attempt| status(attempt).is_some())).then_some(first)
}

/// Notes on blocks of the library that need a caution once a BOOL pin, which may become TRUE, is FALSE again,
/// whatever their wires bring.
pub(super) fn cautions(names: &Names<'_>, wiring: &Wiring) -> Vec<Diagnostic> {
    let obs = names.obs();
    let mut diagnostics = Vec::new();
    for (entry, constants) in names.entries.iter().zip(&wiring.constants) {
        let (Some(block_type), Some(task)) = (&entry.block_type, entry.task) else { continue };
        let cycle = Cycle::new(0, names.tasks[task].period_ns, &obs);
        let own = wiring.exceptions.range(entry.first..entry.first + entry.count);
        let own = own.map(|(instance, own)| (entry.instance_name(instance - entry.first), own));
        let mut instances = std::iter::once((entry.name.to_owned(), constants)).chain(own);
        let found =
            instances.find_map(|(name, of)| Some((name, cautioned_pin(block_type, of, &cycle)?)));
        let Some(((name, pin), caution)) = found.zip(block_type.caution) else { continue };
        let message = format!(
            "block \"{name}\" ({}): when {pin} becomes FALSE, {}",
            block_type.name, caution.meaning
        );
        let diagnostic = Diagnostic::new(Problem::Caution, entry.span.clone(), message);
        diagnostics.push(diagnostic.help(caution.remedy));
    }
    diagnostics
}

/// The BOOL input of an instance with these constants whose fall leads to where it needs a caution.
fn cautioned_pin(
    block_type: &BlockType,
    constants: &[Option<f64>],
    cycle: &Cycle<'_>,
) -> Option<&'static str> {
    if !block_type.is_of_library() || block_type.caution.is_none() {
        return None;
    }
    let needs_caution = |switch: usize, attempt: u64| {
        let slot = |(index, (pin, constant)): (usize, (&Pin, &Option<f64>))| match constant {
            // Other wires are at rest.
            None if pin.pin_type == PinType::Bool => 0.0,
            constant => constant.unwrap_or_else(|| wired_slot(pin, index, attempt)),
        };
        let pins = block_type.inputs.iter().zip(constants).enumerate();
        let mut slots: Vec<f64> = pins.map(slot).collect();
        slots.resize(block_type.slots(), 0.0);
        let mut state = vec![0; block_type.state_words];
        for value in [1.0, 0.0] {
            if let Some(slot) = slots.get_mut(switch) {
                *slot = value;
            }
            block_type.step_bank(&mut slots, &mut state, cycle);
        }
        block_type.needs_caution(&slots)
    };
    let pins = block_type.inputs.iter().zip(constants).enumerate();
    let mut switches =
        pins.filter(|(_, (pin, it))| pin.pin_type == PinType::Bool && **it != Some(0.0));
    switches
        .find(|(switch, _)| (0..TRIES).all(|attempt| needs_caution(*switch, attempt)))
        .map(|(_, (pin, _))| pin.name)
}

/// What a wire brings to a pin in one of the attempts: the same to all pins in the first ones, then
/// to each another.
fn wired_slot(pin: &Pin, index: usize, attempt: u64) -> f64 {
    let choice = match attempt {
        0..16 => attempt,
        // Any function that scatters will do; this one gives the same warnings in every run.
        _ => (attempt << 8 | index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40,
    };
    match pin.pin_type {
        PinType::Lreal => LREALS.get(choice as usize % LREALS.len()).copied().unwrap_or_default(),
        PinType::Bool => (choice >> 3 & 1) as f64,
        PinType::Int | PinType::Time | PinType::Word if pin.names_task => Ob::Caller.slot(),
        // An expression may divide by it.
        PinType::Int | PinType::Time | PinType::Word => (choice % 4) as f64,
    }
}

/// Status word of an instance's first call, if it is an error.
fn first_status(block_type: &BlockType, mut slots: Vec<f64>, cycle: &Cycle<'_>) -> Option<u16> {
    slots.resize(block_type.slots(), 0.0);
    let mut state = vec![0; block_type.state_words];
    let errors = block_type.step_bank(&mut slots, &mut state, cycle);
    let shown = block_type.indication().and_then(|indication| {
        slots.get(indication.place()).and_then(|value| indication.status_word(*value))
    });
    (errors > 0).then_some(shown.unwrap_or_default())
}

fn diagnostic(entry: &Entry<'_>, name: &str, block_type: &BlockType, code: u16) -> Diagnostic {
    let word = block_type.status.iter().find(|word| word.code == code);
    let meaning =
        word.map_or_else(|| "an error".into(), |word| format!("{} ({})", word.meaning, word.name));
    let message = format!("block \"{name}\" reports 16#{code:04X} from its first call: {meaning}");
    let help = match code {
        status::OB_UNAVAILABLE | status::QRY_CINT => {
            "leave callOB out for the task that runs the block, name a task, or give one this number with ob"
        }
        _ if block_type.formulas().is_some() => {
            "change the expressions in [block.out]; --strict makes this an error"
        }
        _ => "change the constants in [block.in]; --strict makes this an error",
    };
    Diagnostic::new(Problem::ConstantError, entry.span.clone(), message).help(help)
}
