//! Gates: reading the file, and judging a bench by it.

use std::path::Path;

use isochrone_engine::{FileKind, read_text};
use isochrone_report::{Gate, Judgement, Report, RuleOutcome};
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

/// Prints the result of each rule. A broken rule is a finding (exit status 1), whatever the others
/// say. Too little data for a rule, or a gate without a rule that can be judged, is inconclusive
/// (exit status 4).
pub(crate) fn hold(path: &Path, gate: &Gate, report: &Report) -> Result<(), Failure> {
    let name = path.display();
    let judged = gate.judge(report);
    for Judgement { outcome, says, .. } in &judged {
        terminal::note(&format!("gate: {}: {says}", outcome.as_str()));
    }
    if report.ended_early {
        return Err(Failure::inconclusive(format!(
            "{name}: no result for this gate, because the bench was ended early; let it run to its end"
        )));
    }
    let worst = judged.iter().map(|judged| judged.outcome).max().unwrap_or(RuleOutcome::Skipped);
    let count = judged.iter().filter(|judged| judged.outcome == worst).count();
    let share = format!("{count} of {}", counted(judged.len(), "result"));
    match worst {
        RuleOutcome::Pass => Ok(()),
        RuleOutcome::Fail => Err(Failure::found(format!(
            "{name}: the gate does not hold: {share} failed, listed above; `isochrone doctor` shows \
             what disturbs this machine"
        ))),
        RuleOutcome::Invalid => Err(Failure::inconclusive(format!(
            "{name}: too little data for this gate: {share} invalid, listed above with what to do"
        ))),
        RuleOutcome::Skipped => Err(Failure::inconclusive(format!(
            "{name}: no rule of this gate can be judged on this machine; add one with \
             times_lower_than"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use std::process::ExitCode;

    use isochrone_machine::Disturbance;
    use isochrone_report::LoopArm;
    use isochrone_timing::CycleRecord;

    use super::*;

    /// Two arms of ten turns of a hundred cycles, `hybrid` half as late as `sleep`.
    fn report() -> Report {
        let arm = |name: &str, late_ns: u64| {
            let mut arm = LoopArm::new(1_000_000, 0);
            for turn in 0..10 {
                let record = |cycle: u64| {
                    let release_ns = (turn * 100 + cycle) * 1_000_000;
                    let start_ns = release_ns + late_ns;
                    let end_ns = start_ns;
                    CycleRecord { cycle, release_ns, start_ns, end_ns, ..CycleRecord::default() }
                };
                let records: Vec<CycleRecord> = (0..100).map(record).collect();
                let none = Disturbance::default();
                arm.turn(&records, &[], 0..u64::MAX, none, |_| none);
            }
            arm.report(name)
        };
        Report { tasks: vec![arm("sleep", 2_000), arm("hybrid", 1_000)], ..Report::default() }
    }

    fn status(rules: &[(&str, f64)]) -> Option<ExitCode> {
        let rule = |(percentile, at_least): &(&str, f64)| {
            format!(
                "[[rule]]\narm = \"hybrid\"\npercentile = \"{percentile}\"\n\
                 times_lower_than = \"sleep\"\nat_least = {at_least:?}\n"
            )
        };
        let gate: Gate = toml::from_str(&rules.iter().map(rule).collect::<String>()).unwrap();
        hold(Path::new("gate.toml"), &gate, &report()).err().map(|failure| failure.status())
    }

    #[test]
    fn a_broken_rule_is_a_finding_even_beside_one_that_cannot_be_decided() {
        // 1000 samples decide p50 and not p99.99.
        assert_eq!(status(&[("p50", 1.5)]), None);
        assert_eq!(status(&[("p99_99", 1.5)]), Some(ExitCode::from(4)));
        assert_eq!(status(&[("p50", 1.5), ("p99_99", 1.5)]), Some(ExitCode::from(4)));
        assert_eq!(status(&[("p50", 2.5), ("p99_99", 1.5)]), Some(ExitCode::from(1)));
        assert_eq!(status(&[("p99_99", 1.5), ("p50", 2.5)]), Some(ExitCode::from(1)));
    }
}
