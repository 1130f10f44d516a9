//! `export`: a recording as CSV, or closed.

mod table;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use isochrone_engine::escaped;
use isochrone_processes::Stop;
use isochrone_recording::{Item, RepairError, Uncarried, WriteError, repair};
use isochrone_timing::units::counted;

use self::table::Table;
use crate::base::failure::Failure;
use crate::base::files::{Numbers, OutputFile, Unwritable};
use crate::base::mcap_file::{
    self, Gaps, SendPosition, accept, damage, lack, lacking, note_uncarried, unreadable,
};
use crate::base::{configuration, stop, suggestion, terminal};
use crate::scope::BEGIN;
use crate::subscribe::Column;

/// Make CSV of a recording, or close one whose recorder was killed
///
/// The CSV is that of `subscribe --csv`: `time_s`, `cycle` and the signals, bit for bit; where the
/// publisher changed its signals, a new header row follows; `time_s` counts from the first frame or cycle in the
/// recording, whatever it is of, so that the rows of all services and tasks have the same times. Of the recording of a node it has a row for each
/// cycle of a task: what it read, what it computed, and where it missed cycles, as a last column, how many before the row. A file that was not closed is read as far as it goes, and
/// what is damaged is left out. Stderr then says what was not read, and the exit status is 4, unless --incomplete
/// is given. To close a recording that was not closed and is not damaged ends with 0; the copy says of itself that
/// it is a part. A recording of ROS 2 is read as well: each topic is a service, and each number that all of its messages
/// have a signal; stderr names what is none.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone export level.mcap -o level.csv\n  \
    isochrone export shift_*.mcap --service plant/level -o - | head\n  \
    isochrone export node.mcap --task fast -o fast.csv\n  \
    isochrone export level.mcap --columns unix_ns,flags -o level.csv\n  \
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
    /// With CSV, further columns behind `cycle`; of the cycles of a task there is `unix_ns`
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…")]
    columns: Vec<Column>,
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
        ([file], None) if args.columns.is_empty() => close(file, args, &stop),
        _ if !args.columns.is_empty() => {
            Err(Failure::usage("--columns is for CSV; a closed recording has everything"))
        }
        (_, Some(_)) => Err(Failure::usage(
            "--service is for CSV, and so is --task; a closed recording has everything",
        )),
        _ => Err(Failure::usage("close one recording at a time; several files are for CSV")),
    }
}

fn close(file: &Path, args: &Args, stop: &Stop) -> Result<(), Failure> {
    let source = mcap_file::file_until(file, stop)?;
    let out =
        OutputFile::create_recording(&args.output, Numbers::IfTaken).map_err(Failure::usage)?;
    let output = &*out.path().to_owned();
    let (repaired, _) = repair(source, out).map_err(|error| match error {
        RepairError::Read(error) => unreadable(file, &error),
        RepairError::Write(WriteError::Io(error)) => Failure::found(Unwritable::new(output, error)),
        error => Failure::found(format!("{}: {error}", file.display())),
    })?;
    let messages = counted(repaired.messages, "message");
    terminal::note(&format!("{}: {messages}, closed", output.display()));
    if stop.is_due() {
        return Err(cut_short(output));
    }
    let condition = &repaired.condition;
    // What was not closed is what it is for.
    judge(lack(file, condition, &Gaps::default()), args.incomplete || condition.damaged == 0)
}

/// Says how what a recording lacks is accepted, where it is not.
fn judge(lack: Option<String>, may_be_incomplete: bool) -> Result<(), Failure> {
    let way = if may_be_incomplete { "" } else { " (--incomplete accepts that)" };
    accept(lack.map(|lack| lack + way), may_be_incomplete)
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
    let named = match (&args.service, &args.task) {
        (Some(service), _) => Some((Kind::Service, service.clone())),
        (None, task) => task.as_ref().map(|task| (Kind::Task, task.clone())),
    };
    let is_surveyed = match &named {
        None => true,
        // What comes from a pipe is read once.
        Some(_) => args.files.iter().all(|file| file.is_file()),
    };
    let survey = if is_surveyed { Survey::read(&args.files, stop)? } else { Survey::default() };
    let (kind, name) = named
        .map_or_else(|| survey.only_one(), Ok)
        .inspect_err(|_| note_uncarried(&survey.uncarried))?;
    // What is of a service is what `subscribe --csv` writes of it; but the services of a shot are the cycles of tasks.
    let is_of_task = kind == Kind::Task || survey.found.is_shot;
    let mut there = survey.found.of(kind).iter();
    let tells_missed = is_of_task && there.any(|known| known.name == name && known.has_missed);
    let of_frames = |column: &&Column| !matches!(column, Column::UnixNs);
    if let (Kind::Task, Some(column)) = (kind, args.columns.iter().find(of_frames)) {
        return Err(Failure::usage(format!(
            "`{}` is of frames, and the cycles of a task have `unix_ns` alone; export a service, or give --columns \
             unix_ns",
            column.as_str()
        )));
    }
    let mut table = Table::create(&args.output, &args.columns, tells_missed)?;
    let mut found = RecordingContents::default();
    let (mut judged, mut damaged, mut uncarried) = (Ok(()), None, BTreeSet::new());
    for file in &args.files {
        let mut reader = mcap_file::open_until(file, stop)?;
        let mut gaps = Gaps::default();
        table.begin_file();
        while !stop.is_due() {
            let Some(item) = reader.next_item().map_err(|error| unreadable(file, &error))? else {
                break;
            };
            table.note_time(&item);
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
        uncarried.extend(reader.uncarried().filter(|it| it.service == name).cloned());
        damaged = damaged.or(damage(file, reader.condition()));
        judged = judged.and(judge(lack(file, reader.condition(), &gaps), args.incomplete));
        if table.goes_back() {
            judged = judged.and(Err(Failure::found(format!(
                "{} does not begin after the end of the file before it; name each file once, in the order of recording",
                file.display()
            ))));
        }
    }
    if kind == Kind::Service {
        note_uncarried(&uncarried);
    }
    if table.frames == 0 && !stop.is_due() {
        let there = found.of(kind);
        let what = match kind {
            Kind::Service => "frames of",
            Kind::Task => "cycles of task",
        };
        let question = suggestion::question(&name, there.iter().map(|known| known.name.as_str()));
        let there = listed(there);
        let none = format!("the recording has no {what} \"{name}\"; it has: {there}{question}");
        return Err(lacking(damaged, none));
    }
    table.flush()?;
    let word = match kind {
        Kind::Service => "frame",
        Kind::Task => "cycle",
    };
    // What is of a service is put as `subscribe` puts it.
    let missed = match (kind, table.missed) {
        (_, 0) => String::new(),
        (Kind::Service, _) if !tells_missed => String::new(),
        (_, missed) => format!(", {missed} missed"),
    };
    terminal::note(&format!("{}, {} lost{missed}", counted(table.frames, word), table.lost));
    judged
}

/// What is in the files.
#[derive(Default)]
struct Survey {
    found: RecordingContents,
    /// Messages of other programs.
    others: u64,
    uncarried: BTreeSet<Uncarried>,
    damaged: Option<String>,
}

impl Survey {
    fn read(files: &[PathBuf], stop: &Stop) -> Result<Self, Failure> {
        let mut survey = Self::default();
        for file in files {
            let mut reader = mcap_file::open_until(file, stop)?;
            while let Some(item) = reader.next_item().map_err(|error| unreadable(file, &error))? {
                survey.found.note(&item);
            }
            survey.others += reader.other_messages();
            survey.uncarried.extend(reader.uncarried().cloned());
            if stop.is_due() {
                return Err(Failure::found("ended by a signal before anything was written"));
            }
            survey.damaged = survey.damaged.or(damage(file, reader.condition()));
        }
        Ok(survey)
    }

    /// The service or the task that everything is of.
    fn only_one(&self) -> Result<(Kind, String), Failure> {
        let (others, damaged) = (self.others, self.damaged.clone());
        let RecordingContents { services, tasks, .. } = &self.found;
        match (&services[..], &tasks[..]) {
            ([service], []) => Ok((Kind::Service, service.name.clone())),
            ([], [task]) => Ok((Kind::Task, task.name.clone())),
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
}

/// The services and tasks of a recording.
#[derive(Default)]
struct RecordingContents {
    services: Vec<RecordedSource>,
    tasks: Vec<RecordedSource>,
    /// It is what `scope` captured.
    is_shot: bool,
}

/// A service or a task.
struct RecordedSource {
    name: String,
    /// Its newest cycle.
    newest: SendPosition,
    has_missed: bool,
}

impl RecordingContents {
    fn of(&self, kind: Kind) -> &[RecordedSource] {
        match kind {
            Kind::Service => &self.services,
            Kind::Task => &self.tasks,
        }
    }

    fn note(&mut self, item: &Item<'_>) {
        let (all, name, newest) = match item {
            Item::Frame(frame) => {
                (&mut self.services, &frame.carried.service, SendPosition::of_frame(frame))
            }
            Item::Row(row) => (&mut self.tasks, &row.layout.task, SendPosition::of_row(row)),
            Item::Mark(mark) => {
                self.is_shot |= mark.kind == BEGIN;
                return;
            }
            _ => return,
        };
        match all.iter_mut().find(|known| known.name == *name) {
            Some(known) => {
                known.has_missed |= known.newest.missed_until(newest) > 0;
                known.newest = newest;
            }
            None => all.push(RecordedSource { name: name.clone(), newest, has_missed: false }),
        }
    }
}

fn listed(all: &[RecordedSource]) -> String {
    match all {
        [] => "none".into(),
        all => all.iter().map(|it| escaped(&it.name).into_owned()).collect::<Vec<_>>().join(", "),
    }
}
