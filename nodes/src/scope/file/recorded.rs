//! Recordings in MCAP, of `scope`, of `record` and of a node.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::path::Path;

use isochrone_engine::escaped;
use isochrone_ipc::SignalSpec;
use isochrone_recording::{
    ClockReading, FileCondition, Item, Mark, Reader, RecordedFrame, RecordedRow,
};
use isochrone_scope::{Head, ObservedTask, TrackSignal, Trigger, Triggered};

use super::super::output::{BEGIN, END, HISTORY, NEXT, TRIGGER};
use super::readable::{Around, Contents, Each, Enough, Readable};
use crate::base::failure::Failure;
use crate::base::mcap_file::{accept_undamaged, open, unreadable};
use crate::subscribe::channels_of;

/// A file that was read once.
pub(super) struct Recorded<'a> {
    path: &'a Path,
    /// Which track the cycles of a channel go to. A service whose signals change has one for each layout.
    places: HashMap<u16, usize>,
    contents: Contents,
    condition: FileCondition,
}

/// The entries of the file for a cycle.
enum Line<'a> {
    /// A frame of a service.
    Frame(RecordedFrame<'a>),
    /// A cycle of a task.
    Row(RecordedRow<'a>),
}

impl Line<'_> {
    fn channel(&self) -> u16 {
        match self {
            Self::Frame(frame) => frame.channel,
            Self::Row(row) => row.channel,
        }
    }

    fn node(&self) -> &str {
        match self {
            Self::Frame(frame) => &frame.carried.publisher,
            Self::Row(row) => &row.layout.node,
        }
    }

    fn clock(&self) -> ClockReading {
        let (monotonic_ns, unix_ns) = match self {
            Self::Frame(frame) => (frame.due_ns, frame.due_unix_ns),
            Self::Row(row) => (row.head.release_ns, row.release_unix_ns),
        };
        ClockReading { monotonic_ns, unix_ns }
    }

    /// The source: a service, or a task with the values of its inputs and outputs.
    fn observed(&self) -> ObservedTask {
        let (task, period_ns, specs) = match self {
            Self::Frame(RecordedFrame { carried, .. }) => {
                (&carried.service, carried.period_ns, carried.signals.clone())
            }
            Self::Row(RecordedRow { layout, .. }) => {
                let outputs = layout.outputs.iter().flat_map(|output| &output.signals);
                let signals: Vec<SignalSpec> =
                    layout.inputs.iter().chain(outputs).cloned().collect();
                (&layout.task, Some(layout.period_ns), signals)
            }
        };
        let signals = channels_of(&specs, specs.len()).into_iter().map(|channel| TrackSignal {
            name: channel.name,
            unit: channel.unit,
            value_type: channel.value_type,
        });
        ObservedTask {
            task: escaped(task).into_owned(),
            period_ns: period_ns.filter(|period_ns| *period_ns > 0),
            signals: signals.collect(),
        }
    }

    /// The cycle, with all that its task has missed since the start.
    fn head(&self) -> Head {
        let (cycle, lost, missed) = match self {
            Self::Frame(frame) => (frame.header.cycle, frame.lost, frame.header.missed),
            Self::Row(row) => (row.head.cycle, row.head.lost, row.head.missed),
        };
        Head { cycle, release_ns: self.clock().monotonic_ns, lost, missed }
    }

    fn values(&self, values: &mut Vec<f64>) {
        values.clear();
        match self {
            Self::Frame(frame) => values.extend(frame.values),
            Self::Row(row) => {
                let inputs = 0..row.layout.inputs.len();
                values.extend(inputs.map(|input| row.input(input).value));
                values.extend(row.outputs().flat_map(|(_, signals)| signals));
            }
        }
    }
}

/// Reads what is in a file.
pub(super) fn read(path: &Path) -> Result<Recorded<'_>, Failure> {
    // In the order of the channels, which is that in which they were written.
    let mut tracks: BTreeMap<u16, ObservedTask> = BTreeMap::new();
    let mut contents = Contents::default();
    let (mut trigger, mut begin_ns, mut end_ns) = (None, None, None);
    let mut around: HashMap<String, Around> = HashMap::new();
    let reader = each(
        path,
        |line| {
            tracks.entry(line.channel()).or_insert_with(|| line.observed());
            contents.clock.get_or_insert(line.clock());
            if contents.node.is_empty() {
                contents.node = escaped(line.node()).into_owned();
            }
            Ok(Enough::No)
        },
        |mark| match mark.kind.as_str() {
            HISTORY => around.entry(task(&mark)).or_default().has_history = true,
            NEXT => {
                let (cycle, release_ns, lost) = (mark.cycle, mark.time_ns, mark.count);
                let next = Head { cycle, release_ns, lost, missed: 0 };
                around.entry(task(&mark)).or_default().next = Some(next);
            }
            TRIGGER => trigger = Some(triggered(mark)),
            BEGIN => begin_ns = Some(mark.time_ns),
            END => end_ns = Some(mark.time_ns),
            _ => {}
        },
    )?;
    let condition = reader.condition().clone();
    if tracks.is_empty() {
        accept_undamaged(path, &condition)?;
        let path = path.display();
        return Err(match reader.other_messages() {
            0 => Failure::found(format!("{path} has no frames")),
            _ => Failure::usage(format!("{path} has only messages of another program")),
        });
    }
    if contents.node.is_empty() {
        contents.node = escaped(&path.display().to_string()).into_owned();
    }
    if begin_ns.is_some() {
        // A shot's rows are those of tasks.
        let prefix = format!("{}/", contents.node);
        let plain = |task: &str| task.strip_prefix(&prefix).unwrap_or(task).to_owned();
        tracks.values_mut().for_each(|track| track.task = plain(&track.task));
        trigger = trigger.map(|it: Triggered| Triggered { task: plain(&it.task), ..it });
        around = around.into_iter().map(|(task, around)| (plain(&task), around)).collect();
    }
    let places = tracks.keys().copied().zip(0..).collect();
    let tracks = tracks.into_values().collect();
    let contents = Contents { tracks, trigger, begin_ns, end_ns, around, ..contents };
    Ok(Recorded { path, places, contents, condition })
}

fn each(
    path: &Path,
    mut line: impl FnMut(Line<'_>) -> Result<Enough, Failure>,
    mut mark: impl FnMut(Mark),
) -> Result<Reader<File>, Failure> {
    let mut reader = open(path)?;
    while let Some(item) = reader.next_item().map_err(|error| unreadable(path, &error))? {
        let enough = match item {
            Item::Frame(frame) => line(Line::Frame(frame))?,
            Item::Row(row) => line(Line::Row(row))?,
            Item::Mark(found) => {
                mark(found);
                Enough::No
            }
            Item::Entry(_) | Item::Configuration(_) | Item::State(_) => Enough::No,
        };
        if enough == Enough::Yes {
            break;
        }
    }
    Ok(reader)
}

impl Readable for Recorded<'_> {
    fn contents(&self) -> &Contents {
        &self.contents
    }

    fn rows(&self, give: &mut Each<'_>) -> Result<(), Failure> {
        let mut values = Vec::new();
        let mut newest: HashMap<usize, Head> = HashMap::new();
        let line = |line: Line<'_>| {
            let Some(track) = self.places.get(&line.channel()).copied() else {
                return Ok(Enough::No);
            };
            let head = line.head();
            let before = newest.get(&track).copied();
            // The last frame of a node that ends may be sent again, and what follows a restart does not go
            // back in time.
            if before.is_some_and(|before| before.release_ns >= head.release_ns) {
                return Ok(Enough::No);
            }
            newest.insert(track, head);
            let missed = before.map_or(0, |before| head.missed.saturating_sub(before.missed));
            line.values(&mut values);
            give(track, Head { missed, ..head }, &values)
        };
        each(self.path, line, |_| {}).map(drop)
    }

    fn judge(&self) -> Result<(), Failure> {
        accept_undamaged(self.path, &self.condition)
    }
}

/// The task, or the service, that a mark is of.
fn task(mark: &Mark) -> String {
    escaped(&mark.service).into_owned()
}

/// The instant that a shot was captured around. Its level is shown where it can be read as a number.
fn triggered(mark: Mark) -> Triggered {
    let trigger = mark.text.parse::<Trigger>().ok();
    let level = trigger.as_ref().and_then(|it| it.level.as_deref()?.parse().ok());
    Triggered {
        task: task(&mark),
        cycle: mark.cycle,
        release_ns: mark.time_ns,
        signal: trigger.map(|trigger| trigger.signal).unwrap_or_default(),
        text: mark.text,
        level,
        lost: mark.count,
    }
}
