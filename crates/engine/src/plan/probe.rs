//! Finds constants that make a block report an error from its first call.

use isochrone_blocks::{BlockType, Cycle, PinType, status};

use super::names::{Entry, Names};
use super::wires::Wiring;
use crate::Finding;
use crate::finding::Problem;

/// Steps every entry once with its constants. Where wires lead, several values are tried: an error
/// that none of them avoids is the constants' doing.
pub(super) fn constants(names: &Names<'_>, wiring: &Wiring, findings: &mut Vec<Finding>) {
    const WIRED: [(f64, f64); 6] =
        [(0.0, 0.0), (1e6, 0.0), (-1e6, 0.0), (0.0, 1.0), (1e6, 1.0), (-1e6, 1.0)];
    let obs = names.obs();
    for (entry, constants) in names.entries.iter().zip(&wiring.constants) {
        let (Some(block_type), Some(task)) = (&entry.block_type, entry.task) else { continue };
        let cycle = Cycle::new(0, names.tasks[task].period_ns, &obs);
        let statuses = WIRED.map(|(lreal, bool)| {
            let slot = |(pin, constant): (&isochrone_blocks::Pin, &Option<f64>)| {
                constant.unwrap_or(match pin.pin_type {
                    PinType::Bool => bool,
                    PinType::Lreal => lreal,
                    // Reads as 0, and at callOB as "not connected".
                    PinType::Int | PinType::Time | PinType::Word => f64::NAN,
                })
            };
            first_status(block_type, block_type.inputs.iter().zip(constants).map(slot).collect(), &cycle)
        });
        if let [Some(first), rest @ ..] = &statuses
            && rest.iter().all(Option::is_some)
        {
            findings.push(finding(entry, block_type, *first));
        }
    }
}

/// Status word of an instance's first call, if it is an error.
fn first_status(block_type: &BlockType, mut slots: Vec<f64>, cycle: &Cycle<'_>) -> Option<u16> {
    slots.resize(block_type.slots(), 0.0);
    let mut state = vec![0; block_type.state_words];
    let errors = block_type.step_bank(&mut slots, &mut state, cycle);
    let status = block_type.outputs.iter().position(|pin| pin.name == "status");
    let status = status.and_then(|pin| slots.get(block_type.inputs.len() + pin));
    (errors > 0).then_some(status.map_or(0, |slot| *slot as u16))
}

fn finding(entry: &Entry<'_>, block_type: &BlockType, code: u16) -> Finding {
    let meaning = block_type.status.iter().find(|(known, _)| *known == code);
    let meaning = meaning.map_or("an error", |(_, meaning)| meaning);
    let message = format!("block \"{}\" reports 16#{code:04X} from its first call: {meaning}", entry.name);
    let help = match code {
        status::OB_UNAVAILABLE | status::QRY_CINT => {
            "leave callOB out for the task that runs the block, or give a task this number with ob"
        }
        _ => "change the constants in [block.in]; --strict makes this an error",
    };
    Finding::new(Problem::ConstantError, entry.span.clone(), message).help(help)
}
