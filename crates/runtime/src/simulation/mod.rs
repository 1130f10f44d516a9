//! The tasks of a plan without a clock and without services, as fast as they go.

mod given_input;

use isochrone_blocks::PinType;
use isochrone_engine::{BuildError, InputPart, OutputPlan, Plan, TaskEngine, TaskPlan};

use crate::simulation::given_input::{GivenInput, cannot_hold};
use crate::{Panic, TaskPanicked, catch_panic};

/// All tasks of a plan on their common grid. Tasks that are due at the same instant run in order of descending
/// priority, then in the order of the file.
///
/// ```
/// use isochrone_engine::{Plan, Rules, Source};
/// use isochrone_runtime::Simulation;
///
/// let text = r#"
///     [node]
///     name = "level"
///     [[task]]
///     name = "fast"
///     period = "1ms"
///     [[input]]
///     name = "target"
///     service = "plant/target"
///     [[block]]
///     name = "ramp"
///     type = "LimRateOfChangeCI"
///     in = { value = "target", setChangeRate = 10.0 }
///     [[output]]
///     service = "plant/level"
///     signals = ["ramp.delayedValue"]
/// "#;
/// let plan = Plan::new(Source::new("level.toml", text), &Rules::default())?;
/// let mut simulation = Simulation::new(&plan, 0, |name| (name == "target").then_some(0))?;
/// let mut frame = [0.0];
/// for cycle in 0..100 {
///     // The row of the first cycle holds.
///     simulation.advance((cycle == 0).then_some(&[1.0]), |_, _, _| ())?;
///     simulation.engines()[0].read_output(0, &mut frame);
/// }
/// assert_eq!(frame, [1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Simulation<'a> {
    plan: &'a Plan,
    engines: Vec<TaskEngine>,
    /// Tasks in the order in which they run when they are due at the same instant.
    order: Vec<usize>,
    /// Next cycle of every task.
    next: Vec<u64>,
    reference: usize,
    /// Of each task those of its inputs that have columns.
    inputs: Vec<Vec<GivenInput>>,
    /// Of each task those of its variables that have columns: their indexes, and the columns.
    variables: Vec<Vec<(usize, usize)>>,
    /// Samples that the type of their input or variable cannot hold, each counted once.
    rejects: u64,
    first_reject: Option<String>,
}

impl<'a> Simulation<'a> {
    /// Ready for the first cycle. The rows of [`advance`](Self::advance) are those of the task with the index
    /// `reference`; `column` says at which place of a row the value of a [name](Self::columns) stands, if it has one.
    /// An input without a column keeps its default and is not ok.
    ///
    /// # Errors
    /// The plan was changed since it was made, and cannot be stepped.
    pub fn new(
        plan: &'a Plan,
        reference: usize,
        column: impl Fn(&str) -> Option<usize>,
    ) -> Result<Self, BuildError> {
        let engines = TaskEngine::build(plan)?;
        let mut order: Vec<usize> = (0..plan.tasks.len()).collect();
        let priority = |task: usize| plan.tasks.get(task)?.settings.priority;
        order.sort_by_key(|task| std::cmp::Reverse(priority(*task).unwrap_or(0)));
        let inputs = |task: &TaskPlan| {
            let inputs = task.inputs.iter().enumerate();
            inputs.filter_map(|(index, input)| GivenInput::find(index, input, &column)).collect()
        };
        let variables = |task: &TaskPlan| {
            let variables = task.variables.iter().enumerate();
            variables.filter_map(|(index, it)| Some((index, column(&it.name)?))).collect()
        };
        Ok(Self {
            plan,
            engines,
            order,
            next: vec![0; plan.tasks.len()],
            reference,
            inputs: plan.tasks.iter().map(inputs).collect(),
            variables: plan.tasks.iter().map(variables).collect(),
            rejects: 0,
            first_reject: None,
        })
    }

    /// What may have a column, and its type: each input with its `ok` and its age, then each variable.
    pub fn columns(plan: &Plan) -> Vec<(String, PinType)> {
        let inputs = plan.tasks.iter().flat_map(|task| &task.inputs);
        let parts = inputs.flat_map(|input| {
            let of = |part: InputPart| {
                (format!("{}{}", input.name, part.suffix()), part.pin_type(input.value_type))
            };
            InputPart::ALL.map(of)
        });
        let variables = plan.tasks.iter().flat_map(|task| &task.variables);
        parts.chain(variables.map(|it| (it.name.clone(), it.value_type))).collect()
    }

    /// Every output of a plan with its task and its index there, in the order of the file.
    pub fn outputs(plan: &Plan) -> Vec<(usize, usize, &OutputPlan)> {
        let tasks = plan.tasks.iter().enumerate();
        let outputs = tasks.flat_map(|(t, task)| {
            task.outputs.iter().enumerate().map(move |(o, plan)| (t, o, plan))
        });
        let mut outputs: Vec<_> = outputs.collect();
        outputs.sort_by_key(|(_, _, output)| output.position);
        outputs
    }

    /// Runs everything up to and including the next cycle of the reference task. A `row` applies at that cycle; without
    /// one the values before hold. `stepped` is told each step of a task, with its index and cycle.
    ///
    /// # Errors
    /// A block panicked: then the simulation is over.
    pub fn advance(
        &mut self,
        row: Option<&[f64]>,
        mut stepped: impl FnMut(usize, &TaskEngine, u64),
    ) -> Result<(), TaskPanicked> {
        let until_ns = self.due_ns(self.reference);
        // Everything before this instant ran on the rows before.
        self.run_before(until_ns, &mut stepped)?;
        if let Some(row) = row {
            self.read(row);
        }
        for place in 0..self.order.len() {
            let Some(task) = self.order.get(place).copied() else { break };
            if self.due_ns(task) == until_ns {
                self.step(task, &mut stepped)?;
            }
            if task == self.reference {
                break;
            }
        }
        Ok(())
    }

    /// The tasks, in the order of the plan.
    pub fn engines(&self) -> &[TaskEngine] {
        &self.engines
    }

    /// When a cycle of the reference task is due, in seconds after its first.
    pub fn time_s(&self, cycle: u64) -> f64 {
        let task = self.plan.tasks.get(self.reference);
        let period_ns = task.map_or(0, |task| task.settings.period_ns);
        (u128::from(cycle) * u128::from(period_ns)) as f64 / 1e9
    }

    /// How many samples were rejected, as the type of their input or variable cannot hold them, and why the first was.
    pub fn rejects(&self) -> (u64, Option<&str>) {
        (self.rejects, self.first_reject.as_deref())
    }

    /// Runs every task that is due before an instant, in the order of time.
    fn run_before(
        &mut self,
        until_ns: u128,
        stepped: &mut impl FnMut(usize, &TaskEngine, u64),
    ) -> Result<(), TaskPanicked> {
        loop {
            // `min_by_key` takes the first of equals, which is the order of execution.
            let next = self.order.iter().copied().min_by_key(|task| self.due_ns(*task));
            match next {
                Some(task) if self.due_ns(task) < until_ns => self.step(task, stepped)?,
                _ => return Ok(()),
            }
        }
    }

    fn due_ns(&self, task: usize) -> u128 {
        let (Some(plan), Some(next)) = (self.plan.tasks.get(task), self.next.get(task)) else {
            return u128::MAX;
        };
        let settings = &plan.settings;
        u128::from(settings.phase_ns) + u128::from(*next) * u128::from(settings.period_ns)
    }

    fn step(
        &mut self,
        task: usize,
        stepped: &mut impl FnMut(usize, &TaskEngine, u64),
    ) -> Result<(), TaskPanicked> {
        let Self { plan, engines, next, .. } = self;
        let (Some(plan), Some(engine), Some(next)) =
            (plan.tasks.get(task), engines.get_mut(task), next.get_mut(task))
        else {
            return Ok(());
        };
        let cycle = *next;
        *next += 1;
        catch_panic(|| engine.step(cycle)).map_err(|Panic { message, place }| {
            let bank = engine.stepping().and_then(|bank| plan.banks.get(bank));
            let block = bank.map(|bank| bank.any_block());
            TaskPanicked { task: plan.name.clone(), block, message, place }
        })?;
        engine.maintain();
        stepped(task, engine, cycle);
        Ok(())
    }

    fn read(&mut self, row: &[f64]) {
        let Self { plan, engines, inputs, variables, rejects, first_reject, .. } = self;
        let cycle = self.next.get(self.reference).copied().unwrap_or_default();
        let mut reject = |why: String| {
            *rejects += 1;
            first_reject.get_or_insert_with(|| format!("{why} (cycle {cycle})"));
        };
        for ((task, engine), inputs) in plan.tasks.iter().zip(&mut *engines).zip(inputs) {
            for input in inputs {
                let Some(plan) = task.inputs.get(input.index) else { continue };
                input.read(plan, row).unwrap_or_else(&mut reject);
                engine.read_input(input.index, &input.reading);
            }
        }
        for ((task, engine), variables) in plan.tasks.iter().zip(engines).zip(variables) {
            for (index, column) in variables {
                let found = task.variables.get(*index).zip(row.get(*column).copied());
                let Some((variable, value)) = found else { continue };
                // An LREAL can be NaN, but nobody sets it to that.
                if variable.value_type.holds(value) && !value.is_nan() {
                    engine.give_variable(*index, value);
                } else {
                    reject(cannot_hold(&variable.name, variable.value_type, value));
                }
            }
        }
    }
}
