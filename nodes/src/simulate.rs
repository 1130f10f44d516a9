//! `simulate`: the same engine with no clock and no IPC, as fast as it goes.

mod alarms;
mod plot;
mod recorded_input;

use std::path::PathBuf;

use isochrone_blocks::BlockType;
use isochrone_engine::{BuildError, OutputPlan, Plan, TaskEngine, TaskPlan};
use isochrone_runtime::{Panic, TaskPanicked, catch_panic, hold_panic_messages};
use isochrone_timing::units::counted;

use crate::base::csv_table::CsvTable;
use crate::base::failure::Failure;
use crate::base::files::keep_apart;
use crate::base::rows::{CYCLE, Rows, TIME};
use crate::base::stop;
use crate::base::{configuration, suggestion, terminal};
use crate::simulate::alarms::AlarmList;
use crate::simulate::plot::Plot;
use crate::simulate::recorded_input::{RecordedInput, cannot_hold, check_units, columns};

/// Run a configuration without a clock or IPC, from CSV to CSV
///
/// Several tasks advance on their common grid: tasks due at the same instant run in order of
/// descending priority, then in file order. What process alarms did is listed on stderr at the end.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone simulate examples/level.toml --cycles 1000\n  \
    isochrone simulate level.toml --cycles 5000 --inputs in.csv --output out.csv\n  \
    isochrone simulate examples/level.toml --cycles 1000 --output out.csv --plot level.html \
    --signals 'level.*,ramp.delayedValue'")]
pub(crate) struct Args {
    /// Configuration file (TOML)
    file: PathBuf,
    /// Number of cycles; default: up to the last row of --inputs
    #[arg(long, required_unless_present = "inputs", allow_negative_numbers = true)]
    cycles: Option<u64>,
    /// CSV with one column per input, by name, and one for each variable that is to change. Row k applies at
    /// cycle k and the last row holds; an input without a column keeps its default and is not ok. A column
    /// NAME.ok or NAME.age says what those are; without one a value is ok and of age 0. The columns `time_s`
    /// and `cycle` of a recording (`subscribe --csv`) are ignored, unless an input or a variable has that name
    #[arg(long, value_name = "IN.csv")]
    inputs: Option<PathBuf>,
    /// CSV file to write, "-" for stdout: `cycle` and every signal of every output
    #[arg(long, value_name = "OUT.csv", default_value = "-")]
    output: PathBuf,
    /// Write the column `time_s` first: when each cycle is due, counted from the first. `publish --csv`
    /// then replays the file at the simulated pace
    #[arg(long)]
    times: bool,
    /// Picture to draw as well: .svg, or .html, which also tells the values under the cursor and draws an interval
    /// larger. Each signal is drawn with the cycles of its own task. Signals of one
    /// unit share a pane, and each pixel has the least and the greatest value of its time
    #[arg(long, value_name = "OUT.svg|OUT.html")]
    plot: Option<PathBuf>,
    /// Signals of the picture, also such as 'ramp.*', at most 24; default: those of the outputs
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', requires = "plot")]
    signals: Vec<String>,
    /// Task whose cycles are the rows; default: the first
    #[arg(long)]
    task: Option<String>,
}

pub(crate) fn run(args: &Args, catalogue: &[BlockType]) -> Result<(), Failure> {
    let plan = configuration::plan(&args.file, catalogue)?;
    configuration::note_warnings(&plan);
    let reference = match &args.task {
        None => 0,
        Some(name) => plan.task_index(name).ok_or_else(|| {
            let names = plan.tasks.iter().map(|task| task.name.as_str()).collect::<Vec<_>>();
            let file = args.file.display();
            let question = suggestion::question(name, names.iter().copied());
            let names = names.join(", ");
            Failure::usage(format!("{file} has no task \"{name}\"; it has: {names}{question}"))
        })?,
    };
    for source in [Some(&args.file), args.inputs.as_ref()].into_iter().flatten() {
        configuration::keep(source, &args.output)?;
        if let Some(plot) = &args.plot {
            configuration::keep(source, plot)?;
        }
    }
    keep_apart(args.plot.iter().chain([&args.output]))?;
    let inputs: Vec<_> = plan.tasks.iter().flat_map(|task| &task.inputs).collect();
    let table = match &args.inputs {
        None => CsvTable::default(),
        Some(path) => {
            let names: Vec<_> = inputs.iter().flat_map(|input| columns(input)).collect();
            let columns = names.iter().map(|(name, value_type)| (name.as_str(), *value_type));
            let variables = plan.tasks.iter().flat_map(|task| &task.variables);
            let variables = variables.map(|it| (it.name.as_str(), it.value_type));
            let columns: Vec<_> = columns.chain(variables).collect();
            let table = CsvTable::of_inputs(path, &columns).map_err(Failure::usage)?;
            check_units(&plan, &table, path).map_err(Failure::usage)?;
            let missing = inputs.iter().filter(|input| table.column(&input.name).is_none());
            for input in missing {
                terminal::note(&format!(
                    "note: {} has no column \"{}\"; the input keeps its default",
                    path.display(),
                    input.name
                ));
            }
            table
        }
    };
    let cycles = args.cycles.unwrap_or(table.end());
    let mut simulation = Simulation::new(&plan, reference, table).map_err(Failure::found)?;
    let stop = stop::on_signal(None)?;
    hold_panic_messages();
    if let Some(path) = &args.plot {
        let outputs = outputs(&plan).into_iter();
        let signals = outputs.flat_map(|(task, _, it)| it.signals.iter().map(move |s| (task, s)));
        simulation.plot = Some(Plot::open(path, &args.signals, &plan, reference, signals)?);
    }
    let mut output = Output::create(args, &plan)?;
    for cycle in 0..cycles {
        if stop.is_due() {
            terminal::note(&format!("note: stopped after {cycle} of {}", counted(cycles, "cycle")));
            break;
        }
        if let Err(panicked) = simulation.advance(cycle) {
            output.rows.flush()?;
            return Err(Failure::found(panicked));
        }
        output.write(cycle, &simulation)?;
    }
    output.rows.flush()?;
    simulation.plot.take().map_or(Ok(()), Plot::write)?;
    simulation.alarms.note();
    if let Some(first) = &simulation.first_reject {
        let samples = match simulation.rejects {
            1 => "1 sample was".into(),
            n => format!("{n} samples were"),
        };
        terminal::note(&format!(
            "note: {samples} rejected, and the input or variable kept its value; the first: {first}"
        ));
    }
    Ok(())
}

/// All tasks of a plan on their common grid.
struct Simulation<'a> {
    plan: &'a Plan,
    engines: Vec<TaskEngine>,
    /// Tasks in the order in which they run when they are due at the same instant.
    order: Vec<usize>,
    /// Next cycle of every task.
    next: Vec<u64>,
    reference: usize,
    table: CsvTable,
    /// Of each task those of its inputs that have columns.
    inputs: Vec<Vec<RecordedInput>>,
    /// Of each task those of its variables that have columns: their indexes, and the columns.
    variables: Vec<Vec<(usize, usize)>>,
    alarms: AlarmList<'a>,
    plot: Option<Plot>,
    /// Samples that the type of their input or variable cannot hold, each counted once.
    rejects: u64,
    first_reject: Option<String>,
}

impl<'a> Simulation<'a> {
    fn new(plan: &'a Plan, reference: usize, table: CsvTable) -> Result<Self, BuildError> {
        let engines = TaskEngine::build(plan)?;
        let mut order: Vec<usize> = (0..plan.tasks.len()).collect();
        order.sort_by_key(|task| {
            std::cmp::Reverse(plan.tasks[*task].settings.priority.unwrap_or(0))
        });
        let recorded = |task: &TaskPlan| {
            let inputs = task.inputs.iter().enumerate();
            inputs.filter_map(|(index, input)| RecordedInput::find(index, input, &table)).collect()
        };
        let inputs = plan.tasks.iter().map(recorded).collect();
        let given = |task: &TaskPlan| {
            let variables = task.variables.iter().enumerate();
            variables.filter_map(|(index, it)| Some((index, table.column(&it.name)?))).collect()
        };
        let variables = plan.tasks.iter().map(given).collect();
        Ok(Self {
            plan,
            engines,
            order,
            next: vec![0; plan.tasks.len()],
            reference,
            inputs,
            variables,
            table,
            alarms: AlarmList::of(plan),
            plot: None,
            rejects: 0,
            first_reject: None,
        })
    }

    /// Runs everything up to and including cycle `cycle` of the reference task.
    fn advance(&mut self, cycle: u64) -> Result<(), TaskPanicked> {
        let until_ns = self.due_ns(self.reference);
        // Everything before this instant ran on the rows before.
        self.run_before(until_ns)?;
        self.read(cycle);
        for task in self.order.clone() {
            if self.due_ns(task) == until_ns {
                self.step(task)?;
            }
            if task == self.reference {
                break;
            }
        }
        Ok(())
    }

    /// Runs every task that is due before an instant, in the order of time.
    fn run_before(&mut self, until_ns: u128) -> Result<(), TaskPanicked> {
        loop {
            // `min_by_key` takes the first of equals, which is the order of execution.
            let next = self.order.iter().copied().min_by_key(|task| self.due_ns(*task));
            match next {
                Some(task) if self.due_ns(task) < until_ns => self.step(task)?,
                _ => return Ok(()),
            }
        }
    }

    fn due_ns(&self, task: usize) -> u128 {
        let plan = &self.plan.tasks[task];
        u128::from(plan.settings.phase_ns)
            + u128::from(self.next[task]) * u128::from(plan.settings.period_ns)
    }

    /// When a cycle of the reference task is due, counted from its first.
    fn time_s(&self, cycle: u64) -> f64 {
        let period_ns = self.plan.tasks[self.reference].settings.period_ns;
        (u128::from(cycle) * u128::from(period_ns)) as f64 / 1e9
    }

    fn step(&mut self, task: usize) -> Result<(), TaskPanicked> {
        let (engine, cycle) = (&mut self.engines[task], self.next[task]);
        self.next[task] += 1;
        catch_panic(|| engine.step(cycle)).map_err(|Panic { message, place }| {
            let plan = &self.plan.tasks[task];
            let block = engine.stepping().map(|bank| plan.banks[bank].any_block());
            TaskPanicked { task: plan.name.clone(), block, message, place }
        })?;
        self.alarms.look(task, engine.image(), cycle);
        if let Some(plot) = &mut self.plot {
            plot.take(task, engine.image());
        }
        Ok(())
    }

    /// Reads the row of a cycle; what has none holds.
    fn read(&mut self, cycle: u64) {
        let Self { plan, engines, inputs, variables, table, rejects, first_reject, .. } = self;
        let Some(row) = table.row_of(cycle) else { return };
        let mut reject = |why: String| {
            *rejects += 1;
            first_reject.get_or_insert_with(|| format!("{why} (cycle {cycle})"));
        };
        for ((task, engine), inputs) in plan.tasks.iter().zip(&mut *engines).zip(inputs) {
            for input in inputs {
                input.read(&task.inputs[input.index], row).unwrap_or_else(&mut reject);
                engine.read_input(input.index, &input.reading);
            }
        }
        for ((task, engine), variables) in plan.tasks.iter().zip(engines).zip(variables) {
            for (index, column) in variables {
                let (variable, value) = (&task.variables[*index], row[*column]);
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

/// Every output with its task and its index there, in the order of the file.
fn outputs(plan: &Plan) -> Vec<(usize, usize, &OutputPlan)> {
    let tasks = plan.tasks.iter().enumerate();
    let outputs = tasks
        .flat_map(|(t, task)| task.outputs.iter().enumerate().map(move |(o, plan)| (t, o, plan)));
    let mut outputs: Vec<_> = outputs.collect();
    outputs.sort_by_key(|(_, _, output)| output.position);
    outputs
}

/// The rows of the output file.
struct Output {
    rows: Rows,
    /// Every output, in the order of the file.
    outputs: Vec<OutputSource>,
    has_times: bool,
}

/// Where an output's values come from.
struct OutputSource {
    task: usize,
    /// Its index among the outputs of the task.
    output: usize,
    /// Room for its signals.
    values: Vec<f64>,
}

impl Output {
    fn create(args: &Args, plan: &Plan) -> Result<Self, Failure> {
        let mut rows = Rows::create(&args.output)?;
        let planned = outputs(plan);
        let signals = planned.iter().flat_map(|(_, _, output)| &output.signals);
        let names = signals.map(|signal| (signal.name.as_str(), signal.unit.as_str()));
        let names: Vec<_> = names.collect();
        let own: &[&str] = if args.times { &[TIME, CYCLE] } else { &[CYCLE] };
        rows.header(own, &names)?;
        let outputs = planned.iter().map(|(t, o, plan)| OutputSource {
            task: *t,
            output: *o,
            values: vec![0.0; plan.signals.len()],
        });
        Ok(Self { outputs: outputs.collect(), rows, has_times: args.times })
    }

    fn write(&mut self, cycle: u64, simulation: &Simulation<'_>) -> Result<(), Failure> {
        for OutputSource { task, output, values } in &mut self.outputs {
            simulation.engines[*task].read_output(*output, values);
        }
        let values = self.outputs.iter().flat_map(|place| &place.values).copied();
        let time_s = self.has_times.then(|| simulation.time_s(cycle));
        self.rows.row(time_s, cycle, values.map(Some))
    }
}
