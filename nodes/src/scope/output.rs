//! Files that shots are written to.

use std::path::{Path, PathBuf};

use isochrone_ipc::{FrameHeader, SignalSpec};
use isochrone_recording::{Carried, Frame, Mark, WriteError, Writer};
use isochrone_report::shot_svg;
use isochrone_scope::{Head, Shot, Track};

use super::captured::Captured;
use crate::base::failure::Failure;
use crate::base::files::{Numbers, OutputFile, ResultFile, numbered};
use crate::base::rows::{CYCLE, MISSED, Rows, TIME};

/// The marks of a shot: the instant that it was captured around, from where to where it was wanted, that a task
/// had cycles before, and the first cycle of a task behind.
pub(super) const TRIGGER: &str = "trigger";
pub(crate) const BEGIN: &str = "begin";
pub(super) const END: &str = "end";
pub(super) const HISTORY: &str = "history";
pub(super) const NEXT: &str = "next";

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Mcap,
    Csv,
    Svg,
}

/// Where shots are written.
pub(super) struct Output {
    path: PathBuf,
    kind: Kind,
    /// Each shot has a file of its own.
    is_numbered: bool,
    written: u64,
    /// The first one, opened before the capture, so that it is not in vain.
    opened: Option<Opened>,
}

/// A file that a shot is written to.
struct Opened {
    path: PathBuf,
    file: File,
}

enum File {
    Rows(Rows),
    Picture(ResultFile),
    Recording(OutputFile),
}

impl Output {
    /// Opens the first file.
    pub(super) fn open(path: &Path, is_numbered: bool) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let kind = match ending.as_deref() {
            Some("mcap") => Kind::Mcap,
            Some("csv") => Kind::Csv,
            Some("svg") => Kind::Svg,
            None if path == Path::new("-") => Kind::Csv,
            _ => {
                let path = path.display();
                return Err(Failure::usage(format!(
                    "{path}: end the name with .mcap, .csv or .svg, which says what to write"
                )));
            }
        };
        let mut output =
            Self { path: path.to_owned(), kind, is_numbered, written: 0, opened: None };
        output.opened = Some(output.open_file()?);
        Ok(output)
    }

    /// Whether it takes signals of one task only.
    pub(super) fn is_of_one_task(&self) -> bool {
        self.kind == Kind::Csv
    }

    fn open_file(&self) -> Result<Opened, Failure> {
        if self.kind == Kind::Mcap {
            let numbers = if self.is_numbered { Numbers::Always } else { Numbers::IfTaken };
            let file = OutputFile::create_recording(&self.path, numbers).map_err(Failure::usage)?;
            return Ok(Opened { path: file.path().to_owned(), file: File::Recording(file) });
        }
        let has_number = self.is_numbered && self.path != Path::new("-");
        let path =
            if has_number { numbered(&self.path, self.written + 1) } else { self.path.clone() };
        let file = match self.kind {
            Kind::Csv => File::Rows(Rows::create(&path)?),
            _ => File::Picture(ResultFile::open(&path)?),
        };
        Ok(Opened { path, file })
    }

    /// Writes a shot; returns the name of its file.
    pub(super) fn write(&mut self, captured: &Captured) -> Result<String, Failure> {
        let Opened { path, file } = match self.opened.take() {
            Some(opened) => opened,
            None => self.open_file()?,
        };
        self.written += 1;
        match file {
            File::Rows(rows) => write_csv(&captured.shot, rows)?,
            File::Picture(file) => {
                let heading = captured.heading();
                file.write(&shot_svg(&heading.title, &heading.about, &captured.shot))?;
            }
            File::Recording(file) => write_mcap(captured, file)?,
        }
        Ok(path.display().to_string())
    }
}

/// Refuses signals of several tasks for a file whose rows are of one.
pub(super) fn check_tasks<'t>(
    output: Option<&Output>,
    tasks: impl ExactSizeIterator<Item = &'t str>,
) -> Result<(), Failure> {
    if tasks.len() < 2 || !output.is_some_and(Output::is_of_one_task) {
        return Ok(());
    }
    let tasks: Vec<&str> = tasks.collect();
    Err(Failure::usage(format!(
        "a CSV file has the cycles of one task, and these signals are of {}: write an .mcap, or name \
         signals of one of them",
        tasks.join(" and ")
    )))
}

fn write_csv(shot: &Shot, mut rows: Rows) -> Result<(), Failure> {
    for track in &shot.tracks {
        let names = track.signals.iter().map(|it| (it.name.as_str(), it.unit.as_str()));
        let mut names: Vec<_> = names.collect();
        // Readers take a gap for lost cycles, unless the file says that they were missed.
        let tells_missed = track.rows.heads().any(|head| head.missed > 0)
            && !names.iter().any(|(name, _)| *name == MISSED);
        names.extend(tells_missed.then_some((MISSED, "")));
        rows.header(&[TIME, CYCLE], &names)?;
        for (head, values) in track.rows.iter() {
            // The instant of the trigger is 0, so that the file says which one it is.
            let after_ns = head.release_ns.wrapping_sub(shot.zero_ns()).cast_signed();
            let missed = tells_missed.then_some(head.missed as f64);
            let values = values.chain(missed).map(Some);
            rows.row(Some(after_ns as f64 / 1e9), head.cycle, values)?;
        }
    }
    rows.flush()
}

fn write_mcap(captured: &Captured, file: OutputFile) -> Result<(), Failure> {
    let Captured { shot, clock } = captured;
    let path = file.path().display().to_string();
    let Some(clock) = clock else {
        return Err(Failure::usage(format!(
            "{path}: an .mcap says when it was, which is not known of these rows; write an .svg"
        )));
    };
    let refused = |error: WriteError| Failure::found(format!("cannot write {path}: {error}"));
    let mut writer = Writer::create(file, *clock).map_err(refused)?;
    let mut channels = Vec::new();
    for track in &shot.tracks {
        channels.push(writer.add(&carried(shot, track)).map_err(refused)?);
    }
    if let Some(trigger) = &shot.trigger {
        let mark = Mark {
            time_ns: trigger.release_ns,
            cycle: trigger.cycle,
            count: trigger.lost,
            kind: TRIGGER.into(),
            service: service(shot, &trigger.task),
            text: trigger.text.clone(),
        };
        writer.mark(&mark).map_err(refused)?;
    }
    for (kind, time_ns) in [(BEGIN, shot.begin_ns), (END, shot.end_ns)] {
        let text = format!("{kind} of what was captured");
        let mark = Mark { time_ns, kind: kind.into(), text, ..Mark::default() };
        writer.mark(&mark).map_err(refused)?;
    }
    for track in &shot.tracks {
        let service = service(shot, &track.task);
        if track.has_history {
            let text = "there were cycles before".to_owned();
            let (kind, service) = (HISTORY.to_owned(), service.clone());
            let mark = Mark { time_ns: shot.begin_ns, kind, service, text, ..Mark::default() };
            writer.mark(&mark).map_err(refused)?;
        }
        if let Some(Head { cycle, release_ns, lost, .. }) = track.next {
            let text = "the first cycle behind what was captured".to_owned();
            let kind = NEXT.to_owned();
            let mark = Mark { time_ns: release_ns, cycle, count: lost, kind, service, text };
            writer.mark(&mark).map_err(refused)?;
        }
    }
    let mut row = Vec::new();
    let mut rows: Vec<_> = shot.tracks.iter().map(|track| track.rows.iter().peekable()).collect();
    let mut missed = vec![0; rows.len()];
    loop {
        // In the order of time, whatever the task.
        let next = rows.iter_mut().enumerate().filter_map(|(track, rows)| {
            let (head, _) = rows.peek()?;
            Some((head.release_ns, track))
        });
        let Some((_, track)) = next.min() else { break };
        let (Some(rows), Some(channel), Some(missed)) =
            (rows.get_mut(track), channels.get(track), missed.get_mut(track))
        else {
            break;
        };
        let Some((head, values)) = rows.next() else { break };
        row.clear();
        row.extend(values);
        *missed = head.missed.saturating_add(*missed);
        writer.write(*channel, &frame(head, &row, *missed)).map_err(refused)?;
    }
    writer.finish().map(drop).map_err(|(error, _)| refused(error))
}

/// A task's rows, as if they were a service of its node.
fn carried(shot: &Shot, track: &Track) -> Carried {
    let signal = |signal: &isochrone_scope::TrackSignal| SignalSpec {
        unit: signal.unit.clone(),
        ..SignalSpec::new(&signal.name, &signal.value_type)
    };
    Carried {
        service: service(shot, &track.task),
        publisher: shot.node.clone(),
        period_ns: track.period_ns,
        signals: track.signals.iter().map(signal).collect(),
    }
}

fn service(shot: &Shot, task: &str) -> String {
    // Data from a file has the name of its service already.
    if task.contains('/') { task.to_owned() } else { format!("{}/{task}", shot.node) }
}

fn frame<'a>(head: &Head, values: &'a [f64], missed: u64) -> Frame<'a> {
    let Head { cycle, release_ns, lost, .. } = *head;
    let header = FrameHeader {
        sequence: cycle,
        cycle,
        release_ns,
        publish_ns: release_ns,
        missed,
        ..FrameHeader::default()
    };
    let (received_ns, due_ns, sent_ns) = (release_ns, release_ns, release_ns);
    Frame { header, values, received_ns, due_ns, sent_ns, lost }
}
