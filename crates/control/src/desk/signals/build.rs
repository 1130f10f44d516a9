//! The index of a plan's names.

use isochrone_engine::{InputPlan, LinkPlan, Plan, TaskPlan, VariablePlan, WirePlan};

use super::published::Published;
use super::{Block, Import, Input, Run, Signals, Task, Variable, split};

impl Signals {
    /// The index of a plan's names.
    pub fn of(plan: &Plan) -> Self {
        let tasks: Box<[Task]> = plan
            .tasks
            .iter()
            .enumerate()
            .map(|(index, task)| self::task(plan, index, task))
            .collect();
        let mut values: Vec<(u32, u32)> = Vec::new();
        let mut named: Vec<(Box<str>, Run)> = Vec::new();
        for (index, task) in plan.tasks.iter().enumerate() {
            let inputs = 0..task.inputs.len();
            let variables = (0..task.variables.len()).map(|variable| task.variable_slot(variable));
            values.extend(inputs.chain(variables).map(|slot| (index as u32, slot as u32)));
            runs(index as u32, task, &mut named);
        }
        let name_of =
            |(task, slot): &(u32, u32)| tasks.get(*task as usize)?.value_name(*slot as usize);
        values.sort_by(|a, b| name_of(a).cmp(&name_of(b)));
        let mut order: Vec<u32> = (0..named.len() as u32).collect();
        let key = |run: u32| named.get(run as usize).map(|(name, run)| (name, run.number));
        order.sort_by_key(|run| key(*run));
        let mut blocks: Vec<Block> = Vec::new();
        let mut block_of = vec![0; named.len()];
        for run in order {
            let Some((name, found)) = named.get(run as usize) else { continue };
            if blocks.last().is_none_or(|block| block.name != *name) {
                let labels = plan.labels(name).cloned().unwrap_or_default();
                blocks.push(Block { name: name.clone(), runs: Vec::new(), count: 0, labels });
            }
            let index = blocks.len() - 1;
            if let (Some(block), Some(of)) = (blocks.last_mut(), block_of.get_mut(run as usize)) {
                block.runs.push(run);
                block.count += found.len;
                *of = index as u32;
            }
        }
        let runs =
            named.into_iter().zip(block_of).map(|((_, run), block)| Run { block, ..run }).collect();
        Self { tasks, values: values.into(), blocks: blocks.into(), runs }
    }
}

fn task(plan: &Plan, index: usize, task: &TaskPlan) -> Task {
    let wires = task.banks.iter().flat_map(|bank| &bank.wires).chain(&task.previous);
    let mut wires: Vec<WirePlan> = wires.copied().collect();
    wires.sort_unstable_by_key(|wire| wire.to);
    let mut delayed: Vec<u32> = task.previous.iter().map(|wire| wire.to).collect();
    delayed.sort_unstable();
    let incoming = plan.links.iter().filter(|link| link.to == index);
    let import = |link: &LinkPlan| Import {
        first_slot: link.first_slot,
        from: link.from,
        slots: link.slots.as_slice().into(),
    };
    let input = |input: &InputPlan| Input {
        name: input.name.as_str().into(),
        value_type: input.value_type,
        service: input.service.as_deref().map(Into::into),
        unit: input.unit.as_str().into(),
        comment: input.comment.as_str().into(),
    };
    let variable = |variable: &VariablePlan| Variable {
        name: variable.name.as_str().into(),
        value_type: variable.value_type,
        initial: variable.initial,
        unit: variable.unit.as_str().into(),
        comment: variable.comment.as_str().into(),
    };
    Task {
        name: task.name.clone(),
        ob: task.settings.ob,
        period_ns: task.settings.period_ns,
        inputs: task.inputs.iter().map(input).collect(),
        variables: task.variables.iter().map(variable).collect(),
        alarms: task.alarms.clone().into(),
        slots: task.image.len(),
        wires: wires.into(),
        delayed: delayed.into(),
        imports: incoming.map(import).collect(),
        published: Published::of(plan, index),
    }
}

/// The runs of a task's instances.
fn runs(index: u32, task: &TaskPlan, named: &mut Vec<(Box<str>, Run)>) {
    for bank in &task.banks {
        let block_type = bank.block_type;
        let (stride, inputs) = (block_type.slots(), block_type.inputs.len());
        let constants = |instance: usize| {
            let first = bank.first_slot + instance * stride;
            task.image.get(first..first + inputs).unwrap_or_default()
        };
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        let mut instance = 0;
        while let Some((base, number)) = bank.instances.get(instance).and_then(|name| split(name)) {
            let of_run = constants(instance);
            let follows = |(offset, next): (usize, &String)| {
                same(constants(instance + offset), of_run)
                    && split(next).is_some_and(|(name, next)| {
                        name == base && next == number.map(|number| number + offset as u32)
                    })
            };
            let rest = bank.instances.get(instance..).unwrap_or_default();
            let len = rest.iter().enumerate().take_while(|next| follows(*next)).count();
            // A block without a number is alone.
            let len = if number.is_some() { len.max(1) } else { 1 };
            let run = Run {
                block: 0,
                task: index,
                first_slot: bank.first_slot + instance * stride,
                len,
                number,
                block_type,
                constants: of_run.into(),
            };
            named.push((base.into(), run));
            instance += len;
        }
    }
}
