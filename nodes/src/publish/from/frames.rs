//! The frames of a recording, in the order of their releases.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap, HashSet};
use std::fs::File;
use std::path::{Path, PathBuf};

use isochrone_ipc::{Flags, FrameLayout, SignalSpec, check_service_name};
use isochrone_processes::Stop;
use isochrone_recording::{FileCondition, Item, Reader, Uncarried};

use crate::base::failure::Failure;
use crate::base::mcap_file::{open, unreadable};

/// How far apart in time frames may stand in a file in the wrong order: the tasks of a node are written one
/// after the other.
const DISORDER_NS: u64 = 5_000_000_000;
/// Most bytes of frames that wait for earlier ones.
const MOST_WAITING_BYTES: usize = 64 << 20;

/// The services of a recording, and what their frames carry.
#[derive(Default)]
pub(super) struct Layouts {
    /// A service may have several, one after the other.
    pub(super) all: Vec<(String, FrameLayout)>,
    /// How many frames of each there are.
    counts: Vec<u64>,
    /// Of each channel of the file the layouts of its frames; a task has one for each of its outputs.
    channels: HashMap<u16, Vec<Option<usize>>>,
    /// Messages of other programs.
    pub(super) other_messages: u64,
    /// What is in no frame.
    pub(super) uncarried: Vec<Uncarried>,
    pub(super) condition: FileCondition,
}

/// A frame to be sent.
pub(super) struct Frame {
    /// Its place among the layouts.
    pub(super) layout: usize,
    /// When its cycle was due.
    pub(super) due_ns: u64,
    pub(super) cycle: u64,
    pub(super) missed: u64,
    pub(super) flags: Flags,
    /// How long before its release the oldest sample was published that it is computed from, if that is known.
    pub(super) source_age_ns: Option<u64>,
    pub(super) values: Vec<f64>,
    /// Its place in the file.
    place: u64,
}

impl Layouts {
    /// Reads a recording once; `None`: it is to stop.
    pub(super) fn read(path: &Path, stop: &Stop) -> Result<Option<Self>, Failure> {
        let (mut layouts, mut counts, mut known) = (Self::default(), Vec::new(), HashMap::new());
        let mut place = |service: &str, signals: &[SignalSpec], period_ns| {
            let signals = signals.to_vec();
            let new = (service.to_owned(), FrameLayout { signals, period_ns });
            let next = known.len();
            Some(*known.entry(new).or_insert_with_key(|new| {
                layouts.all.push(new.clone());
                next
            }))
        };
        let mut reader = open(path)?;
        while let Some(item) = reader.next_item().map_err(|error| unreadable(path, &error))? {
            if stop.is_due() {
                return Ok(None);
            }
            let places = match item {
                Item::Frame(frame) => layouts.channels.entry(frame.channel).or_insert_with(|| {
                    let carried = frame.carried;
                    vec![place(&carried.service, &carried.signals, carried.period_ns)]
                }),
                Item::Row(row) => layouts.channels.entry(row.channel).or_insert_with(|| {
                    let period_ns = Some(row.layout.period_ns);
                    let outputs = row.layout.outputs.iter();
                    outputs.map(|of| place(&of.service, &of.signals, period_ns)).collect()
                }),
                _ => continue,
            };
            for place in places.iter().flatten() {
                if counts.len() <= *place {
                    counts.resize(*place + 1, 0);
                }
                counts.get_mut(*place).into_iter().for_each(|count| *count += 1);
            }
        }
        let (other_messages, condition) = (reader.other_messages(), reader.condition().clone());
        let uncarried = reader.uncarried().cloned().collect();
        Ok(Some(Self { counts, other_messages, uncarried, condition, ..layouts }))
    }

    /// The services, in the order of their first frames.
    pub(super) fn services(&self) -> Vec<String> {
        let mut seen = HashSet::new();
        let services = self.all.iter().map(|(service, _)| service);
        services.filter(|service| seen.insert(*service)).cloned().collect()
    }

    /// How many frames a service has.
    pub(super) fn frames(&self, service: &str) -> u64 {
        let of = self.all.iter().zip(&self.counts).filter(|((of, _), _)| of == service);
        of.map(|(_, count)| count).sum()
    }

    /// Leaves those of some services, which come `speed` times as fast as they were recorded.
    ///
    /// # Errors
    /// A name or a layout that a publisher cannot have.
    pub(super) fn only(self, services: &[String], speed: Option<f64>) -> Result<Self, Failure> {
        let mut places = Vec::new();
        let (mut all, mut counts) = (Vec::new(), Vec::new());
        let services: HashSet<&String> = services.iter().collect();
        for ((service, mut layout), count) in self.all.into_iter().zip(self.counts) {
            if !services.contains(&service) {
                places.push(None);
                continue;
            }
            check_service_name(&service).map_err(Failure::usage)?;
            layout.check().map_err(|error| {
                Failure::usage(format!("the recorded layout of \"{service}\": {error}"))
            })?;
            let period = |period_ns: u64| Some((period_ns as f64 / speed?).round() as u64);
            layout.period_ns = layout.period_ns.and_then(period);
            places.push(Some(all.len()));
            all.push((service, layout));
            counts.push(count);
        }
        let mut channels = self.channels;
        for layout in channels.values_mut().flatten() {
            *layout = layout.and_then(|place| places.get(place).copied().flatten());
        }
        Ok(Self { all, counts, channels, ..self })
    }
}

/// Reads the frames of a recording.
pub(super) struct Frames<'a> {
    path: PathBuf,
    reader: Reader<File>,
    layouts: &'a Layouts,
    waiting: BinaryHeap<Frame>,
    waiting_bytes: usize,
    /// Of all that was read.
    newest_ns: u64,
    place: u64,
    is_over: bool,
}

impl<'a> Frames<'a> {
    pub(super) fn open(path: &Path, layouts: &'a Layouts) -> Result<Self, Failure> {
        Ok(Self {
            path: path.to_owned(),
            reader: open(path)?,
            layouts,
            waiting: BinaryHeap::new(),
            waiting_bytes: 0,
            newest_ns: 0,
            place: 0,
            is_over: false,
        })
    }

    /// The next frame; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Frame>, Failure> {
        while !self.is_over && !self.is_next_known() {
            self.read()?;
        }
        let next = self.waiting.pop();
        self.waiting_bytes -= next.as_ref().map_or(0, Frame::bytes);
        Ok(next)
    }

    /// Whether no frame will be read any more that is due before the next one.
    fn is_next_known(&self) -> bool {
        let is_old = |next: &Frame| self.newest_ns.saturating_sub(next.due_ns) > DISORDER_NS;
        self.waiting_bytes > MOST_WAITING_BYTES || self.waiting.peek().is_some_and(is_old)
    }

    fn read(&mut self) -> Result<(), Failure> {
        let item = self.reader.next_item().map_err(|error| unreadable(&self.path, &error))?;
        let mut new = Vec::new();
        match item {
            None => self.is_over = true,
            Some(Item::Frame(frame)) => {
                let layouts = self.layouts.channels.get(&frame.channel);
                let Some(layout) = layouts.and_then(|of| *of.first()?) else { return Ok(()) };
                let header = frame.header;
                let has_source = header.source_ns != 0 && header.release_ns != 0;
                new.push(Frame {
                    layout,
                    due_ns: frame.due_ns,
                    cycle: header.cycle,
                    missed: header.missed,
                    flags: frame.flags(),
                    source_age_ns: has_source
                        .then(|| header.release_ns.saturating_sub(header.source_ns)),
                    values: frame.values.to_vec(),
                    place: 0,
                });
            }
            Some(Item::Row(row)) => {
                let outputs = self.layouts.channels.get(&row.channel).into_iter().flatten();
                let outputs = outputs.zip(row.outputs());
                let outputs = outputs.filter_map(|(layout, output)| Some(((*layout)?, output)));
                new.extend(outputs.map(|(layout, (flags, values))| Frame {
                    layout,
                    due_ns: row.head.release_ns,
                    cycle: row.head.cycle,
                    missed: row.head.missed,
                    flags: Flags::from_bits(flags),
                    source_age_ns: None,
                    values: values.to_vec(),
                    place: 0,
                }));
            }
            Some(_) => {}
        }
        for frame in new {
            self.newest_ns = self.newest_ns.max(frame.due_ns);
            self.waiting_bytes += frame.bytes();
            self.place += 1;
            self.waiting.push(Frame { place: self.place, ..frame });
        }
        Ok(())
    }

    /// In what state the file is, as far as it was read: one whose end was not read may be closed.
    pub(super) fn condition(&self) -> FileCondition {
        let condition = self.reader.condition().clone();
        FileCondition { is_closed: condition.is_closed || !self.is_over, ..condition }
    }
}

impl Frame {
    fn bytes(&self) -> usize {
        size_of::<Self>() + self.values.len() * size_of::<f64>()
    }

    /// The first in the heap is the one that is due first.
    fn rank(&self) -> std::cmp::Reverse<(u64, u64)> {
        std::cmp::Reverse((self.due_ns, self.place))
    }
}

impl PartialEq for Frame {
    fn eq(&self, other: &Self) -> bool {
        self.rank() == other.rank()
    }
}

impl Eq for Frame {}

impl PartialOrd for Frame {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Frame {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank().cmp(&other.rank())
    }
}
