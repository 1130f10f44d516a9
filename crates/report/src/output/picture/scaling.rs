//! A picture of what instances cost, over how many there are.

use isochrone_timing::Metric;

use super::axis::{Axis, Logarithmic};
use super::chart::{Chart, Layer};
use super::form::Form;
use super::ink::Ink;
use super::legend::Entry;
use super::mark::Mark;
use super::screen::Screen;
use crate::report::CostReport;

const LINE: Form = Form::Line(2);

/// Draws the median time of one instance over the number of instances on two logarithmic axes, with
/// one line per block type.
pub fn scaling_svg(title: &str, costs: &[CostReport]) -> String {
    scaling_of(title, costs, Screen::Wide)
}

/// [`scaling_svg`] for a screen of any width.
pub(crate) fn scaling_of(title: &str, costs: &[CostReport], screen: Screen) -> String {
    let lines = lines(costs);
    let points = || lines.iter().flat_map(|(_, points)| points);
    let nothing = Logarithmic { low: 1.0, high: 10.0 };
    let instances = Logarithmic::around(points().map(|(instances, _)| *instances));
    let times = Logarithmic::around(points().map(|(_, ps)| *ps));
    let chart = Chart {
        title,
        x: Axis {
            range: instances.unwrap_or(nothing),
            says: "instances",
            label: &|instances| format!("{instances:.0}"),
        },
        y: Axis {
            range: times.unwrap_or(nothing),
            says: "time of one instance, p50",
            label: &|ps| Metric::STEP.shown(ps.round() as u64),
        },
        legend: lines
            .iter()
            .enumerate()
            .map(|(arm, (name, _))| Entry::new(LINE, Ink::of(arm), name))
            .collect(),
        layers: lines
            .iter()
            .enumerate()
            .flat_map(|(arm, (_, points))| layers(arm, points))
            .collect(),
    };
    chart.svg(screen)
}

fn layers(arm: usize, points: &[(f64, f64)]) -> [Layer; 2] {
    [LINE, Form::Marks(Mark::Dot)].map(|form| Layer {
        points: points.to_vec(),
        form,
        ink: Ink::of(arm),
    })
}

/// The points (instances, ps) of each type, in the order of the report; ascending.
fn lines(costs: &[CostReport]) -> Vec<(&str, Vec<(f64, f64)>)> {
    let mut lines: Vec<(&str, Vec<(f64, f64)>)> = Vec::new();
    for cost in costs {
        let Some(ps) = cost.step_ps.p50 else { continue };
        let point = (cost.instances.max(1) as f64, ps.max(1) as f64);
        match lines.iter_mut().find(|(name, _)| *name == cost.name) {
            Some((_, points)) => points.push(point),
            None => lines.push((&cost.name, vec![point])),
        }
    }
    for (_, points) in &mut lines {
        points.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    }
    lines
}

#[cfg(test)]
mod tests {
    use isochrone_timing::Summary;

    use super::*;

    fn cost(name: &str, instances: u64, p50: Option<u64>) -> CostReport {
        let step_ps = Summary { p50, ..Summary::default() };
        CostReport { name: name.to_owned(), instances, step_ps, ..CostReport::default() }
    }

    #[test]
    fn each_type_is_a_line_through_its_instances_in_ascending_order() {
        let costs = [
            cost("ramp", 1_000, Some(2_000)),
            cost("mixed", 1, Some(5_000)),
            cost("ramp", 1, Some(9_000)),
            cost("ramp", 10, None),
        ];
        let expected =
            [("ramp", vec![(1.0, 9_000.0), (1_000.0, 2_000.0)]), ("mixed", vec![(1.0, 5_000.0)])];
        assert_eq!(lines(&costs), expected);
        let svg = scaling_svg("Cost", &costs);
        assert!(svg.contains("ramp") && svg.contains("mixed") && svg.contains("</svg>"), "{svg}");
    }

    #[test]
    fn a_picture_of_no_costs_is_an_empty_frame() {
        assert!(scaling_svg("Cost", &[]).contains("</svg>"));
    }
}
