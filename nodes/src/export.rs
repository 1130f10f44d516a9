//! `export`: a recording as CSV, or closed.

use std::fs::File;
use std::path::{Path, PathBuf};

use isochrone_engine::escaped;
use isochrone_recording::{
    Condition, Damage, Item, ReadError, Reader, RecordedFrame, RepairError, WriteError, repair,
};
use isochrone_timing::units::counted;

use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::rows::{CYCLE, Rows, TIME};
use crate::subscribe::channels_of;
use crate::{configuration, meant, stop, terminal};

/// Make CSV of a recording, or close one whose recorder was killed
///
/// The CSV is that of `subscribe --csv`: `time_s`, `cycle` and the signals, bit for bit; where the
/// publisher changed its signals, a new header row follows. A file that breaks off is read as far as it
/// goes. What is damaged is left out; then the exit status is 1, and stderr says where it is.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone export level.mcap -o level.csv\n  \
    isochrone export shift_*.mcap --service plant/level -o - | head\n  \
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
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    for file in &args.files {
        configuration::keep(file, &args.output)?;
    }
    if args.output.extension().is_none_or(|extension| extension != "mcap") {
        return export_csv(args);
    }
    match (&args.files[..], &args.service) {
        ([file], None) => close(file, &args.output),
        (_, Some(_)) => {
            Err(Failure::usage("--service is for CSV; a closed recording has all services"))
        }
        _ => Err(Failure::usage("close one recording at a time; several files are for CSV")),
    }
}

fn close(file: &Path, output: &Path) -> Result<(), Failure> {
    let source = open(file)?;
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
    judge(file, &repaired.condition)
}

fn export_csv(args: &Args) -> Result<(), Failure> {
    let stop = stop::on_signal(None)?;
    let service = match &args.service {
        Some(service) => service.clone(),
        None => only_service(&args.files)?,
    };
    let mut table = Csv {
        rows: Rows::create(&args.output)?,
        header: None,
        channel: None,
        first_ns: None,
        frames: 0,
        lost: 0,
    };
    let mut services = Vec::new();
    let mut judged = Ok(());
    for file in &args.files {
        let mut reader = reader(file)?;
        table.channel = None;
        while !stop.is_due() {
            match reader.next_item().map_err(|error| unreadable(file, &error))? {
                Some(Item::Frame(frame)) if frame.carried.service == service => {
                    table.write(&frame)?
                }
                Some(Item::Frame(frame)) => note_service(&mut services, &frame),
                Some(_) => {}
                None => break,
            }
        }
        if !stop.is_due() {
            judged = judged.and(judge(file, reader.condition()));
        }
    }
    if table.frames == 0 {
        let question = meant::question(&service, services.iter().map(String::as_str));
        let there = listed(&services);
        return Err(Failure::usage(format!(
            "the recording has no frames of \"{service}\"; it has: {there}{question}"
        )));
    }
    table.rows.flush()?;
    terminal::note(&format!("{}, {} lost", counted(table.frames, "frame"), table.lost));
    judged
}

/// The service that all frames are of.
fn only_service(files: &[PathBuf]) -> Result<String, Failure> {
    let mut services = Vec::new();
    let mut others = 0;
    for file in files {
        let mut reader = reader(file)?;
        while let Some(item) = reader.next_item().map_err(|error| unreadable(file, &error))? {
            if let Item::Frame(frame) = item {
                note_service(&mut services, &frame);
            }
        }
        others += reader.other_messages();
    }
    match &services[..] {
        [service] => Ok(service.clone()),
        [] if others > 0 => Err(Failure::usage(format!(
            "there are no frames in it, only {} of another program",
            counted(others, "message")
        ))),
        [] => Err(Failure::found("the recording has no frames")),
        several => {
            let there = listed(several);
            Err(Failure::usage(format!(
                "several services are recorded; choose one with --service: {there}"
            )))
        }
    }
}

fn note_service(services: &mut Vec<String>, frame: &RecordedFrame<'_>) {
    let service = &frame.carried.service;
    if !services.contains(service) {
        services.push(service.clone());
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

/// The CSV of one service.
struct Csv {
    rows: Rows,
    /// The names in the header row.
    header: Option<Vec<String>>,
    /// The channel of the last frame, in its file.
    channel: Option<u16>,
    first_ns: Option<u64>,
    frames: u64,
    lost: u64,
}

impl Csv {
    fn write(&mut self, frame: &RecordedFrame<'_>) -> Result<(), Failure> {
        if self.channel != Some(frame.channel) {
            self.channel = Some(frame.channel);
            let channels = channels_of(&frame.carried.signals, frame.carried.signals.len());
            let names: Vec<String> = channels.into_iter().map(|channel| channel.name).collect();
            if self.header.as_ref() != Some(&names) {
                let columns: Vec<&str> = names.iter().map(String::as_str).collect();
                self.rows.header(&[TIME, CYCLE], &columns)?;
                self.header = Some(names);
            }
        }
        self.frames += 1;
        self.lost += frame.lost;
        let first_ns = *self.first_ns.get_or_insert(frame.due_ns);
        let time_s = frame.due_ns.wrapping_sub(first_ns).cast_signed() as f64 / 1e9;
        self.rows.row(Some(time_s), frame.header.cycle, frame.values.iter().copied().map(Some))
    }
}

pub(crate) fn reader(file: &Path) -> Result<Reader<File>, Failure> {
    Reader::open(open(file)?).map_err(|error| unreadable(file, &error))
}

fn open(file: &Path) -> Result<File, Failure> {
    File::open(file).map_err(|error| unreadable(file, &ReadError::Io(error)))
}

pub(crate) fn unreadable(file: &Path, error: &ReadError) -> Failure {
    Failure::usage(format!("cannot read {}: {error}", file.display()))
}

/// Says that a file was not closed. Damage is a failure, for when everything else is written.
pub(crate) fn judge(file: &Path, condition: &Condition) -> Result<(), Failure> {
    let file = file.display();
    if !condition.is_closed {
        terminal::note(&format!(
            "note: {file} was not closed: its recorder was killed, or is still at it; read as far as it goes"
        ));
    }
    match &condition.first_damage {
        None => Ok(()),
        Some(Damage { at, what }) => Err(Failure::found(format!(
            "{file} is damaged: {} left out, the first at byte {at}: {what}",
            counted(condition.damaged, "part")
        ))),
    }
}
