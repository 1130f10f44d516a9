//! Gates: reading the file, and judging a bench by it.

use std::path::Path;

use isochrone_engine::{FileKind, read_text};
use isochrone_report::{Gate, Judgement, Outcome, Report};
use isochrone_timing::units::counted;

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
        return Err(Failure::usage(format!(
            "{name}: the gate has no rule; add a [[rule]] with arm, percentile and a bound"
        )));
    }
    Ok(gate)
}

/// Prints the result of each rule. A broken rule is a finding (exit status 1). Too little data for a
/// rule, or a gate without a rule that can be judged, is inconclusive (exit status 4).
pub(crate) fn hold(path: &Path, gate: &Gate, report: &Report) -> Result<(), Failure> {
    let name = path.display();
    let judged = gate.judge(report);
    for Judgement { outcome, says } in &judged {
        terminal::note(&format!("gate: {}: {says}", outcome.as_str()));
    }
    if report.ended_early {
        return Err(Failure::inconclusive(format!(
            "{name}: no result for this gate, because the bench was ended early; let it run to its end"
        )));
    }
    let worst = judged.iter().map(|judged| judged.outcome).max().unwrap_or(Outcome::Skipped);
    let count = judged.iter().filter(|judged| judged.outcome == worst).count();
    let share = format!("{count} of {}", counted(judged.len(), "result"));
    match worst {
        Outcome::Pass => Ok(()),
        Outcome::Fail => Err(Failure::found(format!(
            "{name}: the gate does not hold: {share} failed, listed above; `isochrone doctor` shows \
             what disturbs this machine"
        ))),
        Outcome::Invalid => Err(Failure::inconclusive(format!(
            "{name}: too little data for this gate: {share} invalid, listed above with what to do"
        ))),
        Outcome::Skipped => Err(Failure::inconclusive(format!(
            "{name}: no rule of this gate can be judged on this machine; add one with \
             times_lower_than"
        ))),
    }
}
