//! Sets the stage, and deals blows on it.

use std::path::PathBuf;
use std::time::Duration;

use super::litter::litter;
use super::point::{Blow, Point};
use super::scene::Company;
use super::stage::{Findings, Outcome, SET_WITHIN, Stage, Verdict};
use super::{kill, stop};
use crate::Failure;

impl Stage {
    /// Sets the stage for a program whose frames are to flow `within` this time after a blow.
    ///
    /// # Errors
    /// The program does not do what it should even if nothing happens to it.
    pub fn new(program: PathBuf, within: Duration) -> Result<Self, Failure> {
        let mut stage = Self { program, within, usual_litter: Vec::new() };
        let mut company = Company::new(&stage)?;
        company.all_fresh()?;
        let mut findings = Findings::default();
        company.expect_frames(SET_WITHIN, &mut findings);
        let domain = company.end(&mut findings);
        if !findings.wrong.is_empty() {
            return Err(format!("undisturbed, {}", findings.wrong.join("; ")).into());
        }
        stage.usual_litter = litter(&domain);
        Ok(stage)
    }

    /// Deals a blow at a point, in a domain of its own.
    pub fn strike(&self, point: Point, blow: Blow) -> Outcome {
        let found = match blow {
            Blow::Kill => kill::strike(self, point),
            Blow::Stop => stop::strike(self, point),
        };
        let (verdict, recovered) = match found {
            Ok(Some(found)) if found.wrong.is_empty() => (Verdict::Pass, found.recovered),
            Ok(Some(found)) => (Verdict::Fail(found.wrong), found.recovered),
            Ok(None) => (Verdict::NotReached, None),
            Err(failure) => (Verdict::Fail(vec![failure.to_string()]), None),
        };
        Outcome { point, blow, verdict, recovered }
    }
}
