//! Inputs, variables and outputs.

use isochrone_blocks::PinType;
use isochrone_engine::config::{Bad, OnStale};
use isochrone_engine::{InputPlan, Plan, SignalPlan, VariablePlan, format_duration_ns};
use isochrone_report::{Page, Row, TableColumn};

use crate::base::numbers::{self, Digits};

/// The service and the place in its frame that an input is read from.
pub(super) fn origin(input: &InputPlan) -> String {
    match &input.service {
        Some(service) => format!("{service}[{}]", input.binding),
        None => "the program that runs the node".into(),
    }
}

pub(super) fn inputs(page: &mut Page, plan: &Plan) {
    if plan.tasks.iter().all(|task| task.inputs.is_empty()) {
        return;
    }
    page.heading("Inputs");
    let columns = ["input", "type", "unit", "from", "range", "default, stale", "comment"];
    for task in &plan.tasks {
        let rows = task.inputs.iter().map(|input| {
            Row::of([
                input.name.clone(),
                input.value_type.to_string(),
                unit(input),
                origin(input),
                range(input.range),
                stale(input),
                input.comment.clone(),
            ])
        });
        page.table(format!("Task {}", task.name), &columns.map(TableColumn::Words), rows);
    }
}

/// The unit of an input, which its publisher announces if the configuration gives none.
fn unit(input: &InputPlan) -> String {
    let is_announced = input.service.is_some()
        && matches!(input.value_type, PinType::Lreal | PinType::Int)
        && input.unit.is_empty();
    if is_announced { "announced".into() } else { input.unit.clone() }
}

fn range(range: Option<(f64, f64)>) -> String {
    range.map_or_else(String::new, |(min, max)| format!("{min:?} to {max:?}"))
}

/// What an input reads without good samples.
fn stale(input: &InputPlan) -> String {
    let mut text = numbers::shown(input.default, input.value_type, Digits::All);
    text += &match input.max_age_ns {
        Some(age_ns) => format!("; stale after {}", format_duration_ns(age_ns)),
        None => "; never stale by age".into(),
    };
    if input.bad == Bad::Stale {
        text += ", and if its sender flags it";
    }
    if input.max_age_ns.is_some() || input.bad == Bad::Stale {
        text += &match input.on_stale {
            OnStale::Hold => ": holds its last value".into(),
            OnStale::Default => ": takes its default".into(),
            OnStale::Ramp(rate) => format!(": goes to its default by {rate:?} per second"),
        };
    }
    if input.feedback {
        text += "; closes a loop of nodes";
    }
    if !input.finite {
        text += "; takes NaN and infinity";
    }
    text
}

pub(super) fn variables(page: &mut Page, plan: &Plan) {
    if plan.tasks.iter().all(|task| task.variables.is_empty()) {
        return;
    }
    page.heading("Variables");
    let columns = [
        TableColumn::Words("variable"),
        TableColumn::Words("type"),
        TableColumn::Words("unit"),
        TableColumn::Number("initial"),
        TableColumn::Words("range"),
        TableColumn::Words("comment"),
    ];
    for task in &plan.tasks {
        let rows = task.variables.iter().map(|variable| {
            let VariablePlan { name, value_type, initial, unit, comment, .. } = variable;
            let limits = plan.limits.iter().find(|limits| limits.names == *name);
            Row::of([
                name.clone(),
                value_type.to_string(),
                unit.clone(),
                numbers::shown(*initial, *value_type, Digits::All),
                range(limits.map(|limits| (limits.min, limits.max))),
                comment.clone(),
            ])
        });
        page.table(format!("Given by operators; task {}", task.name), &columns, rows);
    }
}

pub(super) fn outputs(page: &mut Page, plan: &Plan) {
    let mut outputs: Vec<_> = plan
        .tasks
        .iter()
        .flat_map(|task| task.outputs.iter().map(move |output| (task, output)))
        .collect();
    if outputs.is_empty() {
        return;
    }
    outputs.sort_by_key(|(_, output)| output.position);
    page.heading("Outputs");
    let columns = [
        TableColumn::Words("channel"),
        TableColumn::Words("signal"),
        TableColumn::Words("type"),
        TableColumn::Words("unit"),
    ];
    for (task, output) in outputs {
        page.markup("<section class=\"block\">\n");
        page.element("<h3><code>", &output.service, "</code></h3>\n");
        if !output.comment.is_empty() {
            page.element("<p>", &output.comment, "</p>\n");
        }
        let row = |(channel, signal): (usize, &SignalPlan)| {
            let SignalPlan { name, value_type, unit, .. } = signal;
            Row::of([channel.to_string(), name.clone(), value_type.to_string(), unit.clone()])
        };
        let every = format_duration_ns(task.settings.period_ns);
        let caption = format!("One frame every {every}, by task {}", task.name);
        page.table(caption, &columns, output.signals.iter().enumerate().map(row));
        page.markup("</section>\n");
    }
}
