//! The baseline of each workload, from a file: the half of the guard that counts nothing itself.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Deserialize;

/// A failure that ends the guard, as a sentence.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Part of a number by which it may grow or shrink before somebody should look: another compiler
/// moves it as much.
const TOLERANCE: f64 = 0.05;

const HEAD: &str = "\
# Instructions per instance and cycle, counted by callgrind at 1000 instances; of `expressions`, for an Expr of 20 terms.
# Rewritten by `cargo bench --profile release -p isochrone-instructions -- --write`.
";

/// Instructions per instance and cycle, by architecture and workload.
#[derive(Debug, Default, PartialEq, Deserialize)]
pub struct Baseline(BTreeMap<String, Counts>);

#[derive(Debug, Default, PartialEq, Deserialize)]
struct Counts {
    /// The compiler whose code was counted.
    compiler: String,
    instructions: BTreeMap<String, f64>,
}

/// What became of a workload.
#[derive(Debug, PartialEq)]
pub enum Verdict {
    /// It costs more.
    Worse {
        /// Its name.
        workload: String,
        /// Instructions in the baseline.
        allowed: f64,
        /// Instructions now.
        counted: f64,
        /// The compiler of the baseline and the present one, if they differ.
        compilers: Option<(String, String)>,
    },
    /// It costs less: the baseline can be lowered.
    Better {
        /// Its name.
        workload: String,
        /// Instructions in the baseline.
        allowed: f64,
        /// Instructions now.
        counted: f64,
    },
    /// Nobody said what this workload may cost.
    Unknown(String),
    /// The baseline has this workload, which there is no more.
    Gone(String),
    /// There is no baseline for this architecture.
    NoBaseline,
}

impl Baseline {
    /// Reads the file; there may be none yet.
    ///
    /// # Errors
    /// It cannot be read, or is no baseline.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        match std::fs::read_to_string(path) {
            Ok(text) => {
                toml::from_str(&text).map_err(|error| format!("{}: {error}", path.display()).into())
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(format!("cannot read {}: {error}", path.display()).into()),
        }
    }

    /// Replaces what this architecture may cost.
    pub fn replace(&mut self, instructions: BTreeMap<String, f64>, compiler: String) {
        let counts = Counts { compiler, instructions };
        self.0.insert(std::env::consts::ARCH.to_owned(), counts);
    }

    /// Writes the file.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        std::fs::write(path, self.to_string())
            .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
    }

    /// Holds what was counted against the file; workloads that are as they were are left out.
    pub fn judge(&self, counted: &BTreeMap<String, f64>, compiler: &str) -> Vec<Verdict> {
        let Some(baseline) = self.0.get(std::env::consts::ARCH) else {
            return vec![Verdict::NoBaseline];
        };
        let other_compiler = baseline.compiler != compiler;
        let compilers = other_compiler.then(|| (baseline.compiler.clone(), compiler.to_owned()));
        let judge = |(workload, counted): (&String, &f64)| {
            let (workload, counted) = (workload.clone(), *counted);
            match baseline.instructions.get(&workload).copied() {
                None => Some(Verdict::Unknown(workload)),
                Some(allowed) if counted > allowed * (1.0 + TOLERANCE) => {
                    let compilers = compilers.clone();
                    Some(Verdict::Worse { workload, allowed, counted, compilers })
                }
                Some(allowed) if counted < allowed * (1.0 - TOLERANCE) => {
                    Some(Verdict::Better { workload, allowed, counted })
                }
                Some(_) => None,
            }
        };
        let gone = baseline.instructions.keys().filter(|workload| !counted.contains_key(*workload));
        let gone = gone.cloned().map(Verdict::Gone);
        counted.iter().filter_map(judge).chain(gone).collect()
    }
}

impl fmt::Display for Baseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(HEAD)?;
        for (architecture, counts) in &self.0 {
            let compiler = toml::Value::String(counts.compiler.clone());
            write!(f, "\n[{architecture}]\ncompiler = {compiler}\n")?;
            writeln!(f, "\n[{architecture}.instructions]")?;
            for (workload, instructions) in &counts.instructions {
                writeln!(f, "{workload} = {instructions:.2}")?;
            }
        }
        Ok(())
    }
}

impl Verdict {
    /// Whether it should keep a change from landing.
    pub const fn fails(&self) -> bool {
        matches!(self, Self::Worse { .. } | Self::Unknown(_) | Self::Gone(_))
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const WAY_OUT: &str = "make it the baseline with --write";
        match self {
            Self::Worse { workload, allowed, counted, compilers } => {
                write!(
                    f,
                    "{workload}: {counted:.2} instructions per instance and cycle instead of \
                     {allowed:.2}; find what it costs, or {WAY_OUT}"
                )?;
                let Some((before, now)) = compilers else { return Ok(()) };
                write!(f, "\n  the baseline is of {before}, this is {now}")
            }
            Self::Better { workload, allowed, counted } => write!(
                f,
                "{workload}: {counted:.2} instructions per instance and cycle, no longer \
                 {allowed:.2}: lower the baseline with --write"
            ),
            Self::Unknown(workload) => {
                write!(f, "{workload}: the baseline does not have it; {WAY_OUT}")
            }
            Self::Gone(workload) => {
                write!(f, "{workload}: there is no such workload any more; {WAY_OUT}")
            }
            Self::NoBaseline => write!(
                f,
                "nothing to hold it against: the baseline has no {}; {WAY_OUT}",
                std::env::consts::ARCH
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMPILER: &str = "rustc 1.95.0 (59807616e 2026-04-14)";

    fn counts(counts: &[(&str, f64)]) -> BTreeMap<String, f64> {
        counts.iter().map(|(name, counted)| ((*name).to_owned(), *counted)).collect()
    }

    fn judge(counted: &[(&str, f64)], compiler: &str) -> Vec<Verdict> {
        let mut baseline = Baseline::default();
        baseline.replace(counts(&[("mixed", 40.0), ("SawTooth", 30.0)]), COMPILER.into());
        baseline.judge(&counts(counted), compiler)
    }

    #[test]
    fn what_is_within_five_percent_says_nothing() {
        for mixed in [38.1, 40.0, 41.9] {
            assert_eq!(judge(&[("mixed", mixed), ("SawTooth", 30.0)], COMPILER), []);
        }
    }

    #[test]
    fn what_costs_more_fails_and_names_the_workload_and_both_numbers() {
        let verdicts = judge(&[("mixed", 42.1), ("SawTooth", 30.0)], COMPILER);
        assert!(verdicts[0].fails() && verdicts.len() == 1, "{verdicts:?}");
        let says = verdicts[0].to_string();
        for part in ["mixed", "42.10", "40.00", "--write"] {
            assert!(says.contains(part), "{says}");
        }
        assert!(!says.contains("rustc"), "{says}");
    }

    #[test]
    fn another_compiler_is_named_beside_what_costs_more() {
        let says = judge(&[("mixed", 50.0), ("SawTooth", 30.0)], "rustc 2.0.0")[0].to_string();
        assert!(says.contains(COMPILER) && says.contains("rustc 2.0.0"), "{says}");
    }

    #[test]
    fn what_costs_less_passes_and_asks_for_a_lower_baseline() {
        let verdicts = judge(&[("mixed", 37.9), ("SawTooth", 30.0)], COMPILER);
        let says = verdicts[0].to_string();
        assert!(!verdicts[0].fails() && says.contains("lower the baseline"), "{says}");
        assert!(says.contains("37.90") && says.contains("40.00"), "{says}");
    }

    #[test]
    fn a_workload_that_is_new_or_gone_fails_until_the_baseline_knows() {
        let verdicts = judge(&[("mixed", 40.0), ("LowPass", 3.0)], COMPILER);
        let expected = [Verdict::Unknown("LowPass".into()), Verdict::Gone("SawTooth".into())];
        assert_eq!(verdicts, expected);
        assert!(verdicts.iter().all(Verdict::fails));
    }

    #[test]
    fn an_architecture_without_a_baseline_is_said_and_passes() {
        let verdicts = Baseline::default().judge(&counts(&[("mixed", 40.0)]), COMPILER);
        assert_eq!(verdicts, [Verdict::NoBaseline]);
        assert!(!verdicts[0].fails());
        assert!(verdicts[0].to_string().contains(std::env::consts::ARCH));
    }

    #[test]
    fn a_written_baseline_reads_back_and_keeps_other_architectures() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("baseline.toml");
        let other = "[abacus]\ncompiler = \"hand\"\n[abacus.instructions]\nmixed = 900.5\n";
        std::fs::write(&path, other).unwrap();
        let mut baseline = Baseline::read(&path).unwrap();
        baseline.replace(counts(&[("mixed", 40.25)]), "a \"compiler\"".into());
        baseline.write(&path).unwrap();
        assert_eq!(Baseline::read(&path).unwrap(), baseline);
        assert_eq!(baseline.0["abacus"].instructions["mixed"], 900.5);
    }

    #[test]
    fn a_file_that_is_none_is_empty_and_one_that_cannot_be_read_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("baseline.toml");
        assert_eq!(Baseline::read(&path).unwrap(), Baseline::default());
        std::fs::write(&path, "mixed = 4").unwrap();
        let error = Baseline::read(&path).unwrap_err().to_string();
        assert!(error.contains("baseline.toml"), "{error}");
    }
}
