//! All points that there are.

use clap::ValueEnum;
use nix::sys::signal::Signal;

use super::call::Call;
use super::kill::runs;
use super::peer::END_WITHIN;
use super::point::{Circumstance, Phase, Point, Role};
use super::roles::{self, VICTIM};
use super::scene::Company;
use super::stage::Stage;
use super::tracer::{Event, Site};
use super::victim::Victim;
use crate::Failure;

/// Which points are wanted. An empty list is all.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Whose.
    pub roles: Vec<Role>,
    /// In which company.
    pub circumstances: Vec<Circumstance>,
    /// In which part of life.
    pub phases: Vec<Phase>,
    /// At which calls.
    pub calls: Vec<Call>,
}

impl Stage {
    /// Runs each process once unharmed; what it calls is where it can be struck.
    ///
    /// # Errors
    /// A process cannot be started or traced, or does not work.
    pub fn points(&self, selection: &Selection) -> Result<Vec<Point>, Failure> {
        let mut points = Vec::new();
        for role in Role::value_variants().iter().copied() {
            for circumstance in Circumstance::value_variants().iter().copied() {
                if wants(&selection.roles, role) && wants(&selection.circumstances, circumstance) {
                    points.extend(self.points_of(role, circumstance)?);
                }
            }
        }
        points.retain(|point| {
            wants(&selection.phases, point.phase) && wants(&selection.calls, point.call)
        });
        Ok(points)
    }

    fn points_of(&self, role: Role, circumstance: Circumstance) -> Result<Vec<Point>, Failure> {
        let company = Company::gather(self, role, circumstance)?;
        let unharmed =
            Victim::start(&self.command(&company.domain, &roles::command(role, VICTIM)), None)?;
        runs(&company, role, circumstance, &unharmed)?;
        unharmed.signal(Signal::SIGINT);
        let Some(Event::Ended(Some(_))) = unharmed.event(END_WITHIN) else {
            return Err(format!("the {role:?} does not end").into());
        };
        let counts = unharmed.counts()?;
        let points = counts.into_iter().flat_map(|(site, count)| {
            let Site { phase, thread, call } = site;
            (1..=count).map(move |k| Point { role, circumstance, phase, thread, call, k, steps: 0 })
        });
        Ok(points.collect())
    }
}

fn wants<T: PartialEq>(wanted: &[T], one: T) -> bool {
    wanted.is_empty() || wanted.contains(&one)
}

/// So many of the points, evenly spread over them, the same ones every time.
pub fn spread(points: &[Point], sample: usize) -> Vec<Point> {
    let sample = sample.min(points.len());
    // In the middle of its share, so that the first point is not always one of them.
    let place = |index: usize| (2 * index + 1) * points.len() / (2 * sample);
    (0..sample).filter_map(|index| points.get(place(index)).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_spread_over_all_points_and_takes_none_twice() {
        let of = |k| format!("node:cold:end:unlink:{k}").parse::<Point>().unwrap();
        let points: Vec<Point> = (1..=10).map(of).collect();
        let ks = |sample| spread(&points, sample).iter().map(|point| point.k).collect::<Vec<_>>();
        assert_eq!(ks(2), [3, 8]);
        assert_eq!(ks(10), (1..=10).collect::<Vec<_>>());
        assert_eq!(ks(99).len(), 10);
        assert!(ks(0).is_empty());
    }
}
