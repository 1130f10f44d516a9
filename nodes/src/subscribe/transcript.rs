//! What `subscribe` makes of the frames: lines for people, or a CSV file.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::{BufWriter, ErrorKind, Write};

use isochrone_engine::escaped;
use isochrone_ipc::{FrameHeader, LayoutWatcher, SignalSpec, Stamps, ipc};

use crate::failure::Failure;
use crate::{numbers, terminal};
use isochrone_runtime::Limiter;

/// How long a frame waits for its layout before it is shown without names. Whoever announces one does
/// so within half of it.
const PATIENCE_NS: u64 = 1_000_000_000;
/// Most frames that wait.
const MOST_WAITING: usize = 65_536;

/// Where the frames go.
pub(crate) enum Sink {
    /// Nowhere: they are only counted.
    Count,
    /// A line for each, for people.
    Lines { every: u64 },
    /// A CSV file of the same form that `simulate` writes. Where the layout changes, another header
    /// stands in it.
    Csv { name: String, out: BufWriter<Box<dyn Write>> },
}

/// A frame that was received.
pub(crate) struct Taken {
    pub(crate) header: FrameHeader,
    /// How many values it has.
    pub(crate) channels: usize,
    /// The values, where they are wanted.
    pub(crate) values: Vec<f64>,
    pub(crate) received_ns: u64,
    pub(crate) stamps: Stamps,
    /// Count of frames, from 1.
    pub(crate) number: u64,
}

/// Writes frames with the names that their publisher announces for them.
pub(crate) struct Transcript {
    service: String,
    sink: Sink,
    waiting: VecDeque<Taken>,
    shown: Option<Shown>,
    names: Vec<String>,
    limiter: Limiter,
}

/// What the names are of.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Shown {
    layout: u64,
    is_announced: bool,
    channels: usize,
}

impl Transcript {
    pub(crate) fn new(service: &str, sink: Sink) -> Self {
        let (waiting, names) = (VecDeque::new(), Vec::new());
        let (service, limiter) = (service.to_owned(), Limiter::default());
        Self { service, sink, waiting, shown: None, names, limiter }
    }

    /// Whether it wants the values of frames, and not only to know what they are.
    pub(crate) fn wants_values(&self) -> bool {
        !matches!(self.sink, Sink::Count)
    }

    /// Takes the next frame. It waits until its layout is known.
    pub(crate) fn take(&mut self, frame: Taken) {
        self.waiting.push_back(frame);
    }

    /// Whether frames wait for their layout.
    pub(crate) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Writes the frames that need wait no longer.
    pub(crate) fn write(
        &mut self,
        watcher: &LayoutWatcher<ipc::Service>,
        now_ns: u64,
    ) -> Result<(), Failure> {
        while let Some(frame) = self.waiting.front() {
            let layout = frame.header.layout;
            let is_known = layout == 0 || watcher.find(layout).is_some();
            let has_waited = now_ns.saturating_sub(frame.received_ns) >= PATIENCE_NS;
            if !is_known && !has_waited && self.waiting.len() < MOST_WAITING {
                break;
            }
            let Some(frame) = self.waiting.pop_front() else { break };
            self.head(&frame.header, frame.channels, watcher)?;
            self.body(&frame)?;
        }
        Ok(())
    }

    /// Tells what the frames are, if that is news.
    fn head(
        &mut self,
        header: &FrameHeader,
        channels: usize,
        watcher: &LayoutWatcher<ipc::Service>,
    ) -> Result<(), Failure> {
        let announced = watcher.find(header.layout);
        let shown = Shown { layout: header.layout, is_announced: announced.is_some(), channels };
        let before = self.shown.replace(shown);
        if before == Some(shown) {
            return Ok(());
        }
        let signals = announced.map_or(&[][..], |announced| &announced.layout.signals);
        self.names = column_names(signals, channels);
        let what = match announced {
            Some(announced) => {
                format!("{} (from \"{}\")", listed(&self.names), announced.publisher)
            }
            None => format!("{channels} values, which nobody names"),
        };
        let news = match before {
            None => format!("\"{}\" carries {what}", self.service),
            Some(_) => format!("\"{}\" has changed, and now carries {what}", self.service),
        };
        if let Some(news) = self.limiter.pass(&news) {
            terminal::note(&news);
        }
        if let Sink::Csv { name, out } = &mut self.sink {
            let names: Vec<_> = self.names.iter().map(|name| field(name)).collect();
            let row = format!("cycle,{}\n", names.join(","));
            out.write_all(row.as_bytes()).map_err(|error| cannot_write(name, &error))?;
        }
        Ok(())
    }

    fn body(&mut self, frame: &Taken) -> Result<(), Failure> {
        let Taken { header, values, received_ns, stamps, number, .. } = frame;
        match &mut self.sink {
            Sink::Count => Ok(()),
            Sink::Lines { every } if !(number - 1).is_multiple_of(*every) => Ok(()),
            Sink::Lines { .. } => {
                let age = match stamps {
                    Stamps::Believed => {
                        let age_ns = received_ns.saturating_sub(header.publish_ns);
                        format!("{:.1}", age_ns as f64 / 1e3)
                    }
                    Stamps::Future | Stamps::Foreign => "-".to_owned(),
                };
                let mut line = format!("{:>8} {:>8} {age:>9} us ", header.sequence, header.cycle);
                for (channel, value) in values.iter().enumerate() {
                    // What nobody named stands by its place.
                    let is_named = self.shown.is_some_and(|shown| shown.is_announced);
                    let name = self.names.get(channel).filter(|_| is_named);
                    let name = name.map_or_else(String::new, |name| format!("{name}="));
                    line += &format!(" {name}{}", numbers::format(*value));
                }
                terminal::print(&(line + "\n"))
            }
            Sink::Csv { name, out } => {
                let mut row = header.cycle.to_string();
                for value in values {
                    row.push(',');
                    row += &numbers::format(*value);
                }
                row.push('\n');
                out.write_all(row.as_bytes()).map_err(|error| cannot_write(name, &error))
            }
        }
    }

    /// Hands everything on to whoever reads along.
    pub(crate) fn flush(&mut self) -> Result<(), Failure> {
        match &mut self.sink {
            Sink::Csv { name, out } => out.flush().map_err(|error| cannot_write(name, &error)),
            _ => Ok(()),
        }
    }
}

/// A name as a field of a CSV file.
fn field(name: &str) -> Cow<'_, str> {
    match name.contains([',', '"']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")).into(),
        false => name.into(),
    }
}

fn cannot_write(name: &str, error: &std::io::Error) -> Failure {
    match error.kind() {
        ErrorKind::BrokenPipe => Failure::reader_left(),
        _ => Failure::found(format!("cannot write {name}: {error}")),
    }
}

/// Names as a line for people.
fn listed(names: &[String]) -> String {
    const SHOWN: usize = 64;
    let (shown, more) = names.split_at(names.len().min(SHOWN));
    match more.len() {
        0 => shown.join(", "),
        more => format!("{}, and {more} more", shown.join(", ")),
    }
}

/// The signals' names, or the channels' numbers where nobody names them. Another process chose the
/// names, so they are escaped, also for a file that somebody will look at.
fn column_names(signals: &[SignalSpec], channels: usize) -> Vec<String> {
    let name = |channel: usize| match signals.get(channel) {
        Some(signal) if !signal.name.is_empty() => escaped(&signal.name).into_owned(),
        _ => format!("ch{channel}"),
    };
    (0..channels).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_another_process_chose_does_not_reach_the_terminal_as_a_command() {
        let signals = [SignalSpec::new("a\u{1b}[2J\u{9b}", ""), SignalSpec::default()];
        assert_eq!(column_names(&signals, 2), [r"a\u001b[2J\u009b", "ch1"]);
    }

    #[test]
    fn a_name_stays_one_field_of_a_csv_file() {
        assert_eq!(field("level.y"), "level.y");
        assert_eq!(field("a,b"), "\"a,b\"");
        assert_eq!(field("a\"b"), "\"a\"\"b\"");
    }
}
