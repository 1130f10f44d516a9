//! Leftovers of many dead processes in one domain.

use isochrone_ipc::IsolatedDomain;

use super::kill::{reaches, start};
use super::litter::litter;
use super::point::{Blow, Circumstance, Point};
use super::scene::Company;
use super::stage::{Findings, Stage};
use crate::Failure;

/// What is left once processes have worked and ended that came after the dead.
#[derive(Debug, Clone, Default)]
pub struct Pile {
    /// After the first.
    pub first: Vec<String>,
    /// After the last.
    pub last: Vec<String>,
    /// What else was not as it should be.
    pub wrong: Vec<String>,
}

impl Stage {
    /// Kills a process at each point in turn, all in one domain and without others in between but
    /// after the first and the last.
    ///
    /// # Errors
    /// A process cannot be started or traced.
    pub fn pile_up(&self, points: &[Point]) -> Result<Pile, Failure> {
        let mut pile = Pile::default();
        let mut domain = self.domain()?;
        for (index, point) in points.iter().enumerate() {
            domain = self.kill_one(domain, *point)?;
            if index == 0 {
                domain = self.work_once(domain, &mut pile)?;
                pile.first = litter(&domain);
            }
        }
        domain = self.work_once(domain, &mut pile)?;
        pile.last = litter(&domain);
        Ok(pile)
    }

    fn kill_one(&self, domain: IsolatedDomain, point: Point) -> Result<IsolatedDomain, Failure> {
        let company = Company::within(self, domain);
        // Nobody else is there.
        let point = Point { circumstance: Circumstance::Cold, ..point };
        let victim = start(self, &company, point, Blow::Kill)?;
        // Among what the dead left it may not come there, or not even run. It is killed all the same.
        let _ = reaches(&company, point, &victim);
        drop(victim);
        Ok(company.domain)
    }

    fn work_once(
        &self,
        domain: IsolatedDomain,
        pile: &mut Pile,
    ) -> Result<IsolatedDomain, Failure> {
        let mut company = Company::within(self, domain);
        let mut findings = Findings::default();
        company.all_fresh()?;
        company.expect_frames(self.within(), &mut findings);
        let domain = company.end(&mut findings);
        pile.wrong.append(&mut findings.wrong);
        Ok(domain)
    }
}
