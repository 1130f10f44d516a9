//! The arms of a report in groups of equal circumstances, as people compare them.

use isochrone_timing::{Metric, Summary};

use crate::bench::{Comparison, LeftOut, PERCENTILES, Reported};
use crate::report::{LinkArm, TaskArm};

/// Arms under the same circumstances, in the order of the report.
pub(super) struct Group<'a, R> {
    pub(super) circumstances: String,
    pub(super) arms: Vec<&'a R>,
    /// How they compare with the first of them.
    pub(super) comparisons: Vec<&'a Comparison>,
}

impl<R> Group<'_, R> {
    /// What a table or a picture of the group is of.
    pub(super) fn heading(&self, metric: &str) -> String {
        if self.circumstances.is_empty() {
            metric.to_owned()
        } else {
            format!("{metric}, {}", self.circumstances)
        }
    }
}

/// Puts arms under the same circumstances together.
pub(super) fn groups<'a, R: Reported>(
    arms: impl IntoIterator<Item = &'a R>,
    comparisons: &'a [Comparison],
) -> Vec<Group<'a, R>> {
    let mut groups: Vec<Group<'a, R>> = Vec::new();
    for arm in arms {
        let circumstances = arm.circumstances();
        let label = arm.label();
        let of_arm = comparisons.iter().filter(|comparison| {
            comparison.metric == R::COMPARED.key && comparison.candidate == label
        });
        match groups.iter_mut().find(|group| group.circumstances == circumstances) {
            Some(group) => {
                group.arms.push(arm);
                group.comparisons.extend(of_arm);
            }
            None => {
                groups.push(Group {
                    circumstances,
                    arms: vec![arm],
                    comparisons: of_arm.collect(),
                });
            }
        }
    }
    groups
}

/// Which releases a distribution of release jitter is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Releases {
    /// Those of the cycles that ran.
    Raw,
    /// With those that were missed.
    Corrected,
    /// With those that were missed, of the valid turns only.
    Valid,
}

impl Releases {
    /// What tables call them.
    pub(super) const fn as_str(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Corrected => "corrected",
            Self::Valid => "valid",
        }
    }
}

/// The release jitter of a task: of all cycles, and where that says something else, with the
/// releases that were missed and without the invalid turns.
pub(super) fn release_jitter(task: &TaskArm) -> Vec<(Releases, &Summary)> {
    let corrected = task.release_jitter_corrected_ns.as_ref().filter(|_| task.task.missed > 0);
    let valid = task.release_jitter_valid_ns.as_ref().filter(|_| invalid_turns(task) > 0);
    let further = [(Releases::Corrected, corrected), (Releases::Valid, valid)];
    let further = further.into_iter().filter_map(|(of, summary)| Some((of, summary?)));
    std::iter::once((Releases::Raw, &task.task.release_jitter_ns)).chain(further).collect()
}

/// How old the value was at every stage of its way through a node; empty where there was no node.
pub(super) fn stages(link: &LinkArm) -> impl Iterator<Item = (&'static str, &Summary)> {
    let stages = [
        ("age at release", &link.age_at_release_ns),
        ("age at publish", &link.link.age_at_publish_ns),
        ("end to end", &link.link.end_to_end_ns),
    ];
    stages.into_iter().filter(|(_, summary)| summary.count > 0)
}

/// How many turns of an arm are invalid.
pub(super) fn invalid_turns<R: Reported>(arm: &R) -> usize {
    arm.turns().iter().filter(|turn| turn.invalid.is_some()).count()
}

/// The percentiles that tables show, and the maximum.
pub(super) const COLUMNS: [&str; 6] = ["p50", "p90", "p99", "p99.9", "p99.99", "max"];

/// The values of [`COLUMNS`].
pub(super) fn columns(summary: &Summary) -> [Option<u64>; COLUMNS.len()] {
    [summary.p50, summary.p90, summary.p99, summary.p99_9, summary.p99_99, summary.max]
}

/// The mean, which others' benchmarks of latency are stated as, and [`COLUMNS`].
pub(super) fn latency_columns() -> impl Iterator<Item = &'static str> {
    std::iter::once("mean").chain(COLUMNS)
}

/// An arm as a comparison calls it, without the circumstances that the group has said already.
pub(super) fn arm_of<'a>(label: &'a str, circumstances: &str) -> &'a str {
    label.strip_suffix(&format!(" ({circumstances})")).unwrap_or(label)
}

/// A comparison that is missing: which, and why.
pub(super) fn sentence(left_out: &LeftOut) -> String {
    let LeftOut { percentile, reference, candidate, why, .. } = left_out;
    let at = if percentile.is_empty() {
        String::new()
    } else {
        format!(" at {}", percentile_name(percentile))
    };
    format!("{candidate} with {reference}{at}: {why}")
}

/// The name of a percentile for people; one that this version does not know keeps its key.
pub(super) fn percentile_name(key: &str) -> &str {
    PERCENTILES.iter().find(|percentile| percentile.key == key).map_or(key, |known| known.name)
}

/// The part of a CPU as `12.5`, in %, if it was measured.
pub(super) fn percent(part: Option<f64>) -> Option<String> {
    part.map(|part| format!("{:.1}", 100.0 * part))
}

/// A value of a metric by its key; of one that this version does not know the bare number.
pub(super) fn value(metric: &str, value: u64) -> String {
    Metric::find(metric).map_or_else(|| value.to_string(), |metric| metric.shown(value))
}

/// A metric by its key, as people call it.
pub(super) fn metric_name(metric: &str) -> &str {
    Metric::find(metric).map_or(metric, |metric| metric.name)
}

#[cfg(test)]
mod tests {
    use isochrone_timing::TaskReport;

    use super::*;
    use crate::report::TurnReport;

    fn task(name: &str, load: &str) -> TaskArm {
        TaskArm {
            task: TaskReport {
                name: name.to_owned(),
                period_ns: 1_000_000,
                ..TaskReport::default()
            },
            load: load.to_owned(),
            ..TaskArm::default()
        }
    }

    #[test]
    fn arms_under_the_same_circumstances_stand_together_with_their_comparisons() {
        let tasks = [task("a", "idle"), task("a", "cpu"), task("b", "idle")];
        let comparison = |metric: &str, candidate: &str| Comparison {
            metric: metric.to_owned(),
            candidate: candidate.to_owned(),
            ..Comparison::default()
        };
        let comparisons = [
            comparison("one_way_ns", "b (1 ms, idle)"),
            comparison("release_jitter_corrected_ns", "b (1 ms, idle)"),
            comparison("release_jitter_corrected_ns", "b (1 ms, cpu)"),
        ];
        let groups = groups(&tasks, &comparisons);
        let names: Vec<Vec<&str>> = groups
            .iter()
            .map(|g| g.arms.iter().map(|arm| arm.task.name.as_str()).collect())
            .collect();
        assert_eq!(names, [vec!["a", "b"], vec!["a"]]);
        assert_eq!(groups[0].comparisons, [&comparisons[1]]);
        assert!(groups[1].comparisons.is_empty());
        assert_eq!(groups[0].heading("release jitter"), "release jitter, 1 ms, idle");
    }

    #[test]
    fn corrected_and_valid_are_shown_where_they_differ_from_raw() {
        let kinds = |task: &TaskArm| -> Vec<&str> {
            release_jitter(task).into_iter().map(|(releases, _)| releases.as_str()).collect()
        };
        let mut task = TaskArm {
            release_jitter_corrected_ns: Some(Summary::default()),
            release_jitter_valid_ns: Some(Summary::default()),
            ..task("a", "")
        };
        assert_eq!(kinds(&task), ["raw"]);
        task.task.missed = 1;
        assert_eq!(kinds(&task), ["raw", "corrected"]);
        task.turns = vec![TurnReport { invalid: Some("why".to_owned()), ..Default::default() }];
        assert_eq!(kinds(&task), ["raw", "corrected", "valid"]);
    }
}
