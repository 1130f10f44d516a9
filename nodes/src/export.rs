//! `export`: a recording as CSV, or closed.

use std::path::{Path, PathBuf};

use isochrone_engine::escaped;
use isochrone_ipc::SignalSpec;
use isochrone_processes::Stop;
use isochrone_recording::{Item, RecordedFrame, RecordedRow, RepairError, WriteError, repair};
use isochrone_timing::units::counted;

use crate::failure::Failure;
use crate::recording_file::{self, Gaps, Place, accept, damage, lack, lacking, unreadable};
use crate::result_file::ResultFile;
use crate::rows::{CYCLE, Rows, TIME};
use crate::subscribe::channels_of;
use crate::{configuration, meant, stop, terminal};

/// Make CSV of a recording, or close one whose recorder was killed
///
/// The CSV is that of `subscribe --csv`: `time_s`, `cycle` and the signals, bit for bit; where the
/// publisher changed its signals, a new header row follows. Of the recording of a node it has a row for each
/// cycle of a task: what it read, and what it computed. A file that was not closed is read as far as it goes, and
/// what is damaged is left out. Stderr then says what was not read, and the exit status is 4, unless --incomplete
/// is given. To close a recording that was not closed and is not damaged ends with 0; the copy says of itself that
/// it is a part.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone export level.mcap -o level.csv\n  \
    isochrone export shift_*.mcap --service plant/level -o - | head\n  \
    isochrone export node.mcap --task fast -o fast.csv\n  \
    isochrone export killed.mcap -o closed.mcap")]
pub(crate) struct Args {
    /// Recording; for CSV also several, in their order
    #[arg(required = true, value_name = "FILE.mcap")]
    files: Vec<PathBuf>,
    /// File to write: CSV ("-" for stdout), or a closed recording if the name ends with .mcap
    #[arg(short, long, value_name = "OUT.csv|OUT.mcap")]
    output: PathBuf,
    /// Service to export, if the recording has several
    #[arg(long)]
    service: Option<String>,
    /// Task to export, if the recording is of a node with several
    #[arg(long, conflicts_with = "service")]
    task: Option<String>,
    /// Accept recordings that were not closed, or of which parts are damaged. Without this, the exit status is then 4
    #[arg(long)]
    incomplete: bool,
}

/// What makes a CSV.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Service,
    Task,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    for file in &args.files {
        configuration::keep(file, &args.output)?;
    }
    let stop = stop::on_signal(None)?;
    if args.output.extension().is_none_or(|extension| extension != "mcap") {
        return export_csv(args, &stop);
    }
    match (&args.files[..], args.service.as_ref().or(args.task.as_ref())) {
        ([file], None) => close(file, args, &stop),
        (_, Some(_)) => Err(Failure::usage(
            "--service is for CSV, and so is --task; a closed recording has everything",
        )),
        _ => Err(Failure::usage("close one recording at a time; several files are for CSV")),
    }
}

fn close(file: &Path, args: &Args, stop: &Stop) -> Result<(), Failure> {
    let output = &*args.output;
    let source = recording_file::file_until(file, stop)?;
    let out = ResultFile::open(output)?;
    let (repaired, _) = repair(source, out).map_err(|error| match error {
        RepairError::Read(error) => unreadable(file, &error),
        RepairError::Write(WriteError::Io(error)) => {
            Failure::found(format!("cannot write {}: {error}", output.display()))
        }
        error => Failure::found(format!("{}: {error}", file.display())),
    })?;
    let messages = counted(repaired.messages, "message");
    terminal::note(&format!("{}: {messages}, closed", output.display()));
    if stop.is_due() {
        return Err(cut_short(output));
    }
    let condition = &repaired.condition;
    // What was not closed is what it is for.
    let may_be_incomplete = args.incomplete || condition.damaged == 0;
    accept(lack(file, condition, &Gaps::default()), may_be_incomplete)
}

/// The failure of an export that a signal ended.
fn cut_short(output: &Path) -> Failure {
    let output = match output.to_str() {
        Some("-") => "stdout".into(),
        _ => output.display().to_string(),
    };
    Failure::found(format!(
        "ended by a signal before everything was read: {output} has the beginning only"
    ))
}

fn export_csv(args: &Args, stop: &Stop) -> Result<(), Failure> {
    let (kind, name) = match (&args.service, &args.task) {
        (Some(service), _) => (Kind::Service, service.clone()),
        (None, Some(task)) => (Kind::Task, task.clone()),
        (None, None) => only_one(&args.files, stop)?,
    };
    let mut table = Csv {
        rows: Rows::create(&args.output)?,
        header: None,
        channel: None,
        first_ns: None,
        last: None,
        begins_file: false,
        goes_back: false,
        frames: 0,
        lost: 0,
    };
    let mut found = Found::default();
    let (mut judged, mut damaged) = (Ok(()), None);
    for file in &args.files {
        let mut reader = recording_file::open_until(file, stop)?;
        let mut gaps = Gaps::default();
        (table.channel, table.begins_file) = (None, true);
        while !stop.is_due() {
            let Some(item) = reader.next_item().map_err(|error| unreadable(file, &error))? else {
                break;
            };
            match &item {
                Item::Frame(frame) if kind == Kind::Service && frame.carried.service == name => {
                    table.write_frame(frame)?;
                    gaps.note(&item);
                }
                Item::Row(row) if kind == Kind::Task && row.layout.task == name => {
                    table.write_row(row)?;
                    gaps.note(&item);
                }
                item => found.note(item),
            }
        }
        if stop.is_due() {
            judged = Err(cut_short(&args.output));
            break;
        }
        damaged = damaged.or(damage(file, reader.condition()));
        judged = judged.and(accept(lack(file, reader.condition(), &gaps), args.incomplete));
        if std::mem::take(&mut table.goes_back) {
            judged = judged.and(Err(Failure::found(format!(
                "{} does not begin after the end of the file before it; name each file once, in the order of recording",
                file.display()
            ))));
        }
    }
    if table.frames == 0 && !stop.is_due() {
        let (what, there) = match kind {
            Kind::Service => ("frames of", &found.services),
            Kind::Task => ("cycles of task", &found.tasks),
        };
        let question = meant::question(&name, there.iter().map(String::as_str));
        let there = listed(there);
        let none = format!("the recording has no {what} \"{name}\"; it has: {there}{question}");
        return Err(lacking(damaged, none));
    }
    table.rows.flush()?;
    let word = match kind {
        Kind::Service => "frame",
        Kind::Task => "cycle",
    };
    terminal::note(&format!("{}, {} lost", counted(table.frames, word), table.lost));
    judged
}

/// The service or the task that everything is of.
fn only_one(files: &[PathBuf], stop: &Stop) -> Result<(Kind, String), Failure> {
    let mut found = Found::default();
    let (mut others, mut damaged) = (0, None);
    for file in files {
        let mut reader = recording_file::open_until(file, stop)?;
        while let Some(item) = reader.next_item().map_err(|error| unreadable(file, &error))? {
            found.note(&item);
        }
        others += reader.other_messages();
        if stop.is_due() {
            return Err(Failure::found("ended by a signal before anything was written"));
        }
        damaged = damaged.or(damage(file, reader.condition()));
    }
    let Found { services, tasks } = &found;
    match (&services[..], &tasks[..]) {
        ([service], []) => Ok((Kind::Service, service.clone())),
        ([], [task]) => Ok((Kind::Task, task.clone())),
        ([], []) if others > 0 => {
            let others = counted(others, "message");
            let what = format!("there are no frames in it, only {others} of another program");
            Err(lacking(damaged, what))
        }
        ([], []) => {
            let damaged = damaged.map_or(String::new(), |damaged| damaged + "; ");
            Err(Failure::found(format!("{damaged}the recording has no frames")))
        }
        ([], tasks) => {
            let there = listed(tasks);
            Err(Failure::usage(format!(
                "several tasks are recorded; choose one with --task: {there}"
            )))
        }
        (services, _) => {
            let there = listed(services);
            Err(Failure::usage(format!(
                "several services are recorded; choose one with --service: {there}"
            )))
        }
    }
}

/// The services and tasks of a recording.
#[derive(Default)]
struct Found {
    services: Vec<String>,
    tasks: Vec<String>,
}

impl Found {
    fn note(&mut self, item: &Item<'_>) {
        let (names, name) = match item {
            Item::Frame(frame) => (&mut self.services, &frame.carried.service),
            Item::Row(row) => (&mut self.tasks, &row.layout.task),
            _ => return,
        };
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
}

fn listed(services: &[String]) -> String {
    match services {
        [] => "none".into(),
        services => {
            services.iter().map(|it| escaped(it).into_owned()).collect::<Vec<_>>().join(", ")
        }
    }
}

/// The CSV of one service or task.
struct Csv {
    rows: Rows,
    /// The names in the header row.
    header: Option<Vec<String>>,
    /// The channel of the last frame, in its file.
    channel: Option<u16>,
    first_ns: Option<u64>,
    last: Option<Place>,
    /// Nothing of the file was written yet.
    begins_file: bool,
    /// The file is not of later than the one before.
    goes_back: bool,
    frames: u64,
    lost: u64,
}

impl Csv {
    fn write_frame(&mut self, frame: &RecordedFrame<'_>) -> Result<(), Failure> {
        self.head(frame.channel, || frame.carried.signals.clone())?;
        self.write(frame.header.cycle, Place::of_frame(frame), frame.lost, frame.values)
    }

    fn write_row(&mut self, row: &RecordedRow<'_>) -> Result<(), Failure> {
        self.head(row.channel, || row.layout.columns())?;
        self.write(row.head.cycle, Place::of_row(row), row.head.lost, row.values)
    }

    /// Writes the names of a channel's values where they are others than before.
    fn head(&mut self, channel: u16, signals: impl Fn() -> Vec<SignalSpec>) -> Result<(), Failure> {
        if self.channel == Some(channel) {
            return Ok(());
        }
        self.channel = Some(channel);
        let signals = signals();
        let channels = channels_of(&signals, signals.len());
        let names: Vec<String> = channels.into_iter().map(|channel| channel.name).collect();
        if self.header.as_ref() != Some(&names) {
            let columns: Vec<&str> = names.iter().map(String::as_str).collect();
            self.rows.header(&[TIME, CYCLE], &columns)?;
            self.header = Some(names);
        }
        Ok(())
    }

    fn write(
        &mut self,
        cycle: u64,
        place: Place,
        lost: u64,
        values: &[f64],
    ) -> Result<(), Failure> {
        let due_ns = place.due_ns;
        let before = self.last.replace(place).filter(|_| self.begins_file);
        self.begins_file = false;
        self.goes_back |= before.is_some_and(|before| due_ns <= before.due_ns);
        // What is in a file that was not named is not known to the next one.
        let lost = before.map_or(lost, |before| before.between(place).max(lost));
        self.frames += 1;
        self.lost = self.lost.saturating_add(lost);
        let first_ns = *self.first_ns.get_or_insert(due_ns);
        let time_s = due_ns.wrapping_sub(first_ns).cast_signed() as f64 / 1e9;
        self.rows.row(Some(time_s), cycle, values.iter().copied().map(Some))
    }
}
