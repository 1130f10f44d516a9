//! The columns that a recording has of each task.

use isochrone_engine::{InputPlan, Plan};
use isochrone_ipc::SignalSpec;
use isochrone_recording::{OutputLayout, TaskLayout};

use crate::task::outputs;

/// What a recording keeps of each cycle of each task of a plan: the columns of
/// [`TaskEngine::read_row`](isochrone_engine::TaskEngine::read_row).
pub fn task_layouts(plan: &Plan) -> Vec<TaskLayout> {
    let of_task = |(index, task): (usize, &isochrone_engine::TaskPlan)| {
        let wires = plan.links.iter().filter(|link| link.to == index);
        let wires = wires.filter_map(|link| Some(plan.tasks.get(link.from)?.name.clone()));
        let inputs = task.inputs.iter();
        let inputs = inputs.map(|input| {
            let InputPlan { name, value_type, unit, .. } = input;
            SignalSpec::new(name.clone(), value_type.to_string()).in_unit(unit)
        });
        let outputs = outputs::of_task(task).into_iter();
        let outputs = outputs
            .map(|output| OutputLayout { service: output.service, signals: output.layout.signals });
        TaskLayout {
            node: plan.node.clone(),
            task: task.name.clone(),
            period_ns: task.settings.period_ns,
            inputs: inputs.collect(),
            wires: wires.collect(),
            outputs: outputs.collect(),
        }
    };
    plan.tasks.iter().enumerate().map(of_task).collect()
}

#[cfg(test)]
mod tests {
    use isochrone_engine::{Rules, Source, TaskEngine};

    use super::*;

    #[test]
    fn a_layout_has_a_column_for_each_value_of_its_tasks_rows() {
        let text = r#"
            [node]
            name = "n"
            [[task]]
            name = "fast"
            period = "1ms"
            [[task]]
            name = "slow"
            period = "2ms"
            [[input]]
            name = "target"
            type = "LREAL"
            task = "fast"
            service = "in"
            channel = 0
            [[block]]
            name = "a"
            type = "LimRateOfChangeCI"
            task = "fast"
            in = { value = "target", setChangeRate = 1.0 }
            [[block]]
            name = "b"
            type = "LimRateOfChangeCI"
            task = "slow"
            in = { value = "a.delayedValue", setChangeRate = 1.0 }
            [[output]]
            service = "out"
            task = "slow"
            signals = ["a.delayedValue", "b.delayedValue"]
        "#;
        let plan = Plan::new(Source::new("n.toml", text), &Rules::default()).unwrap();
        let layouts = task_layouts(&plan);
        let engines = TaskEngine::build(&plan).unwrap();
        let lengths: Vec<_> = engines.iter().map(TaskEngine::row_len).collect();
        assert_eq!(layouts.iter().map(TaskLayout::len).collect::<Vec<_>>(), lengths);
        assert_eq!(layouts[1].wires, ["fast"]);
        assert_eq!(layouts[0].inputs[0].name, "target");
    }
}
