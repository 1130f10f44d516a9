//! A recording as arrays.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use isochrone::ipc::SignalSpec;
use isochrone_recording::{FileCondition, Item, Reader};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::failed;

/// Between two looks whether Python has received a signal.
const ITEMS: usize = 16_384;

/// Frames of one service with one layout, or what the inputs of a task read.
#[derive(Default)]
struct Channel {
    service: String,
    publisher: String,
    period_ns: Option<u64>,
    signals: Vec<SignalSpec>,
    numbers: [Vec<u64>; 6],
    values: Vec<Vec<f64>>,
    lost: u64,
}

/// The names of a channel's `numbers`.
const NUMBERS: [&str; 6] = ["time_ns", "cycle", "release_ns", "publish_ns", "missed", "flags"];

impl Channel {
    fn take(&mut self, numbers: [u64; 6], values: impl IntoIterator<Item = f64>) {
        self.numbers.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        self.values.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
    }
}

/// The channels of a file, in the order in which they begin, and what is wrong with it, if something is.
#[pyfunction]
pub(crate) fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
) -> PyResult<(Vec<Bound<'py, PyDict>>, Option<String>)> {
    let refused =
        |cause: &dyn std::fmt::Display| failed(format!("cannot read {}: {cause}", path.display()));
    let file = py.detach(|| open(&path))?;
    let mut reader =
        py.detach(|| Reader::open_with_index(file)).map_err(|error| refused(&error))?;
    let mut read = Read::default();
    loop {
        let goes_on = py.detach(|| {
            for _ in 0..ITEMS {
                match reader.next_item() {
                    Ok(Some(item)) => read.take(&item),
                    Ok(None) => return Ok(false),
                    Err(error) => return Err(error),
                }
            }
            Ok(true)
        });
        if !goes_on.map_err(|error| refused(&error))? {
            break;
        }
        py.check_signals()?;
    }
    let channels = read.channels.into_iter().map(|channel| dictionary(py, channel));
    Ok((channels.collect::<PyResult<_>>()?, doubt(&path, reader.condition())))
}

fn open(path: &Path) -> PyResult<BufReader<File>> {
    // A pipe has no end to begin with, and opening it would wait for somebody to write to it.
    let about = std::fs::metadata(path).map_err(PyErr::from)?;
    if !about.is_file() {
        return Err(failed(format!("{} is no file", path.display())));
    }
    Ok(BufReader::new(File::open(path)?))
}

fn dictionary(py: Python<'_>, channel: Channel) -> PyResult<Bound<'_, PyDict>> {
    let Channel { service, publisher, period_ns, signals, numbers, values, lost } = channel;
    let dictionary = PyDict::new(py);
    dictionary.set_item("service", service)?;
    dictionary.set_item("publisher", publisher)?;
    dictionary.set_item("period_ns", period_ns)?;
    let words = |of: fn(&SignalSpec) -> &String| signals.iter().map(of).collect::<Vec<_>>();
    dictionary.set_item("names", words(|signal| &signal.name))?;
    dictionary.set_item("types", words(|signal| &signal.value_type))?;
    dictionary.set_item("units", words(|signal| &signal.unit))?;
    dictionary.set_item("lost", lost)?;
    for (name, numbers) in NUMBERS.into_iter().zip(numbers) {
        dictionary.set_item(name, PyArray1::from_vec(py, numbers))?;
    }
    let values = values.into_iter().map(|column| PyArray1::from_vec(py, column));
    dictionary.set_item("values", values.collect::<Vec<_>>())?;
    Ok(dictionary)
}

fn doubt(path: &Path, condition: &FileCondition) -> Option<String> {
    if condition.is_whole() {
        return None;
    }
    let what = match &condition.first_damage {
        Some(damage) => format!(
            "is damaged at {} places; {} bytes were not read; the first, at byte {}: {}",
            condition.damaged, condition.unread_bytes, damage.at, damage.what
        ),
        None if condition.is_of_part => "is a copy of a part of another recording".to_owned(),
        None => "was not closed: its recorder was killed or is still at it, and nobody knows what came after".to_owned(),
    };
    Some(format!("{} {what}", path.display()))
}

/// What was read so far.
#[derive(Default)]
struct Read {
    channels: Vec<Channel>,
    /// Of each channel of the file and part of its rows, the place in `channels`.
    places: BTreeMap<(u16, usize), usize>,
}

impl Read {
    fn take(&mut self, item: &Item<'_>) {
        match item {
            Item::Frame(frame) => {
                let header = frame.header;
                let channel = self.channel((frame.channel, 0), || Channel {
                    service: frame.carried.service.clone(),
                    publisher: frame.carried.publisher.clone(),
                    period_ns: frame.carried.period_ns,
                    signals: frame.carried.signals.clone(),
                    ..Channel::default()
                });
                channel.lost += frame.lost;
                let numbers = [
                    frame.due_unix_ns,
                    header.cycle,
                    header.release_ns,
                    header.publish_ns,
                    header.missed,
                    header.flags,
                ];
                channel.take(numbers, frame.values.iter().copied());
            }
            Item::Row(row) => {
                let (layout, head) = (row.layout, row.head);
                let described = |service: String, signals| Channel {
                    service,
                    publisher: layout.node.clone(),
                    period_ns: Some(layout.period_ns),
                    signals,
                    ..Channel::default()
                };
                let numbers = |flags| {
                    let (cycle, release_ns) = (head.cycle, head.release_ns);
                    [row.release_unix_ns, cycle, release_ns, head.end_ns, head.missed, flags]
                };
                for (place, (output, (flags, values))) in
                    layout.outputs.iter().zip(row.outputs()).enumerate()
                {
                    let channel = self.channel((row.channel, place + 1), || {
                        described(output.service.clone(), output.signals.clone())
                    });
                    channel.lost += head.lost;
                    channel.take(numbers(flags), values.iter().copied());
                }
                if layout.inputs.is_empty() {
                    return;
                }
                let channel = self.channel((row.channel, 0), || {
                    let columns = layout.columns();
                    let of_inputs =
                        columns.iter().skip(layout.input(0)).take(layout.wire(0) - layout.input(0));
                    let bare = |signal: &SignalSpec| SignalSpec {
                        name: signal.name.strip_prefix("in.").unwrap_or(&signal.name).to_owned(),
                        ..signal.clone()
                    };
                    described(layout.path(), of_inputs.map(bare).collect())
                });
                channel.lost += head.lost;
                let values = row.values.get(layout.input(0)..layout.wire(0)).unwrap_or_default();
                channel.take(numbers(0), values.iter().copied());
            }
            Item::Mark(_) | Item::Entry(_) | Item::Configuration(_) | Item::State(_) => {}
        }
    }

    fn channel(&mut self, key: (u16, usize), new: impl FnOnce() -> Channel) -> &mut Channel {
        let Self { channels, places } = self;
        let place = *places.entry(key).or_insert_with(|| {
            let channel = new();
            let values = vec![Vec::new(); channel.signals.len()];
            channels.push(Channel { values, ..channel });
            channels.len() - 1
        });
        &mut channels[place]
    }
}
