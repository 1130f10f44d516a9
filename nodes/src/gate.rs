//! Gates: the file, and what becomes of a bench that is held against one.

use std::path::Path;

use isochrone_engine::{FileKind, read_text};
use isochrone_report::{Gate, Judgement, Outcome, Report};

use crate::failure::Failure;
use crate::terminal;

static GATE: FileKind = FileKind {
    name: "gate",
    format: "TOML",
    max_bytes: 1 << 20,
    shorten: "",
    needs: "needs at least one [[rule]]",
};

/// Reads a gate.
pub(crate) fn read(path: &Path) -> Result<Gate, Failure> {
    let name = path.display();
    let text = read_text(path, &GATE).map_err(Failure::usage)?;
    let gate: Gate =
        toml::from_str(&text).map_err(|error| Failure::usage(format!("{name}: {error}")))?;
    if gate.rules.is_empty() {
        return Err(Failure::usage(format!("{name}: the gate has no rule")));
    }
    Ok(gate)
}

/// Says what became of each rule. A rule that is broken is a finding (exit 1); a run that says too
/// little about a rule, or a gate of which nothing could be judged, decides nothing (exit 4).
pub(crate) fn hold(gate: &Gate, report: &Report) -> Result<(), Failure> {
    let judged = gate.judge(report);
    for Judgement { outcome, says } in &judged {
        terminal::note(&format!("gate: {}: {says}", outcome.as_str()));
    }
    let worst = if report.ended_early {
        Some(Outcome::Invalid)
    } else {
        judged.iter().map(|judged| judged.outcome).max()
    };
    match worst {
        Some(Outcome::Pass) => Ok(()),
        Some(Outcome::Fail) => Err(Failure::found("the gate does not hold")),
        Some(Outcome::Invalid) if report.ended_early => {
            Err(Failure::inconclusive("the bench was ended early: no result for the gate"))
        }
        Some(Outcome::Invalid) => {
            Err(Failure::inconclusive("the run says too little: no result for the gate"))
        }
        Some(Outcome::Skipped) | None => {
            Err(Failure::inconclusive("the gate has no rule that can be judged on this machine"))
        }
    }
}
