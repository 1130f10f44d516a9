//! Gates: the file, and what becomes of a bench that is held against one.

use std::path::Path;

use isochrone_report::{Gate, Outcome, Report};

use crate::failure::Failure;
use crate::terminal;

/// Reads a gate.
pub(crate) fn read(path: &Path) -> Result<Gate, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::usage(format!("cannot read {name}: {error}")))?;
    let gate: Gate =
        toml::from_str(&text).map_err(|error| Failure::usage(format!("{name}: {error}")))?;
    gate.check().map_err(|error| Failure::usage(format!("{name}: {error}")))?;
    Ok(gate)
}

/// Says what became of each rule. A rule that is broken is a finding (exit 1); a run that says too
/// little about a rule, or a gate of which nothing could be judged, is none that can be used (exit 2).
pub(crate) fn hold(gate: &Gate, report: &Report) -> Result<(), Failure> {
    let judged = gate.judge(report);
    for (outcome, says) in &judged {
        terminal::note(&format!("gate: {}: {says}", outcome.as_str()));
    }
    let worst = match report.ended_early {
        true => Some(Outcome::Invalid),
        false => judged.iter().map(|(outcome, _)| *outcome).max(),
    };
    match worst {
        Some(Outcome::Pass) => Ok(()),
        Some(Outcome::Fail) => Err(Failure::found("the gate does not hold")),
        Some(Outcome::Invalid) if report.ended_early => {
            Err(Failure::usage("the bench was ended early: no result for the gate"))
        }
        Some(Outcome::Invalid) => Err(Failure::usage("the run is invalid: no result for the gate")),
        Some(Outcome::Skipped) | None => {
            Err(Failure::usage("the gate has no rule that can be judged on this machine"))
        }
    }
}
