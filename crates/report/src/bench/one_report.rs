//! The measurements of one report, and how its arms compare.

use super::compare::{Pairing, TooShort};
use super::measured::{Comparison, INVALID_ALLOWED, LeftOut, Measurement};
use super::reported::Reported;
use crate::report::{CostReport, Report};

impl Report {
    /// Everything that the report measured and contains the distribution of, in the order of the
    /// report.
    pub fn measured(&self) -> Vec<Measurement> {
        let tasks = self.tasks.iter().filter_map(Measurement::of);
        let links = self.links.iter().filter_map(Measurement::of);
        let costs = self.costs.iter().filter_map(Measurement::of);
        tasks.chain(links).chain(costs).collect()
    }

    /// Compares each arm with the first under the same conditions and stores the result. Block
    /// types are not compared with each other, because each does different work.
    pub fn compare_arms(&mut self) {
        let measured = self.measured();
        (self.comparisons, self.left_out) = (Vec::new(), Vec::new());
        for (index, candidate) in measured.iter().enumerate() {
            let comparable = |other: &&Measurement| {
                candidate.metric != CostReport::METRIC
                    && other.metric == candidate.metric
                    && other.circumstances == candidate.circumstances
            };
            let Some(reference) = measured.iter().take(index).find(comparable) else { continue };
            for (percentile, compared) in Comparison::each(reference, candidate, Pairing::Paired) {
                let left_out = |percentile: &str, why: String| LeftOut {
                    metric: reference.metric.key.to_owned(),
                    percentile: percentile.to_owned(),
                    reference: reference.label(),
                    candidate: candidate.label(),
                    why,
                };
                match compared {
                    Ok(comparison) => self.comparisons.push(comparison),
                    // Too few turns are too few for every percentile.
                    Err(why @ TooShort::Turns { .. }) => {
                        let disturbed = |arm: &Measurement| arm.too_disturbed(INVALID_ALLOWED);
                        let disturbed = disturbed(reference).or_else(|| disturbed(candidate));
                        let why = disturbed.map_or_else(|| why.to_string(), |why| why.to_string());
                        self.left_out.push(left_out("", why));
                        break;
                    }
                    Err(why) => self.left_out.push(left_out(percentile.key, why.to_string())),
                }
            }
        }
    }
}
