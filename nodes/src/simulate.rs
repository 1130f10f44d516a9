//! `simulate`: the same engine with no clock and no IPC, as fast as it goes.

mod alarms;
mod plot;
mod units;

use std::path::PathBuf;

use isochrone_blocks::BlockType;
use isochrone_engine::{Plan, TaskEngine};
use isochrone_runtime::{Simulation, hold_panic_messages};
use isochrone_timing::units::counted;

use crate::base::csv_table::CsvTable;
use crate::base::failure::Failure;
use crate::base::files::keep_apart;
use crate::base::rows::{CYCLE, Rows, TIME};
use crate::base::stop;
use crate::base::{configuration, suggestion, terminal};
use crate::simulate::alarms::AlarmList;
use crate::simulate::plot::Plot;
use crate::simulate::units::check_units;

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
            let columns = Simulation::columns(&plan);
            let columns = columns.iter().map(|(name, value_type)| (name.as_str(), *value_type));
            let columns: Vec<_> = columns.collect();
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
    let column = |name: &str| table.column(name);
    let mut simulation = Simulation::new(&plan, reference, column).map_err(Failure::found)?;
    let mut alarms = AlarmList::of(&plan);
    let stop = stop::on_signal(None)?;
    hold_panic_messages();
    let mut plot = match &args.plot {
        None => None,
        Some(path) => {
            let outputs = Simulation::outputs(&plan).into_iter();
            let signals =
                outputs.flat_map(|(task, _, it)| it.signals.iter().map(move |s| (task, s)));
            Some(Plot::open(path, &args.signals, &plan, reference, signals)?)
        }
    };
    let mut output = Output::create(args, &plan)?;
    for cycle in 0..cycles {
        if stop.is_due() {
            terminal::note(&format!("note: stopped after {cycle} of {}", counted(cycles, "cycle")));
            break;
        }
        let look = |task: usize, engine: &TaskEngine, cycle| {
            alarms.look(task, engine.image(), cycle);
            if let Some(plot) = &mut plot {
                plot.take(task, engine.image());
            }
        };
        if let Err(panicked) = simulation.advance(table.row_of(cycle), look) {
            output.rows.flush()?;
            return Err(Failure::found(panicked));
        }
        output.write(cycle, &simulation)?;
    }
    output.rows.flush()?;
    plot.map_or(Ok(()), Plot::write)?;
    alarms.note();
    if let (rejects, Some(first)) = simulation.rejects() {
        let samples = match rejects {
            1 => "1 sample was".into(),
            n => format!("{n} samples were"),
        };
        terminal::note(&format!(
            "note: {samples} rejected, and the input or variable kept its value; the first: {first}"
        ));
    }
    Ok(())
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
        let planned = Simulation::outputs(plan);
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
            simulation.engines()[*task].read_output(*output, values);
        }
        let values = self.outputs.iter().flat_map(|place| &place.values).copied();
        let time_s = self.has_times.then(|| simulation.time_s(cycle));
        self.rows.row(time_s, cycle, values.map(Some))
    }
}
