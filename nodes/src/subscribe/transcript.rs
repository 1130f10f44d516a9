//! The output of `subscribe`: live values, lines, or a CSV file.

use isochrone_ipc::{LayoutKey, SignalFrame, ipc};
use isochrone_runtime::Limiter;

use super::channel::{Channel, NO_VALUE, carried, channels, listed};
use super::column::Column;
use super::heading::Heading;
use super::object::Object;
use super::received::{ReceivedFrame, age, doubts};
use super::screen::Screen;
use super::silence::Silence;
use crate::base::failure::Failure;
use crate::base::numbers::{Digits, shown, type_of};
use crate::base::rows::{CYCLE, Rows, TIME};
use crate::base::suggestion;
use crate::base::terminal;

/// Where the frames go.
pub(crate) enum Sink {
    /// Nowhere: they are only counted.
    Count,
    /// A line for each, for terminals and pipes.
    Lines,
    /// A JSON object in a line for each, for scripts.
    Objects,
    /// One table of the newest, on a terminal.
    Screen(Screen),
    /// A CSV file. Where the layout changes, another header stands in it.
    Csv(Rows),
}

/// Which frames and signals are wanted.
pub(crate) struct Choice {
    /// Every so many frames, from the first.
    pub(crate) every: u64,
    /// Names of signals in their order; empty: all.
    pub(crate) signals: Vec<String>,
    /// The columns of a CSV file besides time and cycle.
    pub(crate) columns: Vec<Column>,
}

/// A frame of the service.
pub(super) type Frame<'a> = SignalFrame<'a, ipc::Service>;

/// Writes frames with the names that their publisher announces for them.
pub(crate) struct Transcript {
    service: String,
    sink: Sink,
    choice: Choice,
    /// The signals of the channels.
    shown: Option<LayoutKey>,
    /// Who writes the frames, if they say.
    publisher: String,
    channels: Vec<Channel>,
    /// When the first frame that was written was due.
    first_ns: Option<u64>,
    /// Of a table: the newest frame that is not drawn yet.
    undrawn: Option<ReceivedFrame>,
    /// The frame whose values the table shows.
    drawn: Option<ReceivedFrame>,
    /// Frames have ceased.
    silence: Option<Silence>,
    /// How long they had when the table was drawn, in s.
    drawn_silence_s: Option<u64>,
    limiter: Limiter,
}

impl Transcript {
    pub(crate) fn new(service: &str, sink: Sink, choice: Choice) -> Self {
        Self {
            service: service.to_owned(),
            sink,
            choice,
            shown: None,
            publisher: String::new(),
            channels: Vec::new(),
            first_ns: None,
            undrawn: None,
            drawn: None,
            silence: None,
            drawn_silence_s: None,
            limiter: Limiter::default(),
        }
    }

    /// Writes the frame with this number, counted from 1, if it is wanted.
    pub(super) fn write(&mut self, frame: &Frame<'_>, number: u64) -> Result<(), Failure> {
        self.head(frame)?;
        if !matches!(self.sink, Sink::Count) && (number - 1).is_multiple_of(self.choice.every) {
            self.body(frame)?;
        }
        Ok(())
    }

    /// Says what was held back, and draws the table, where it is time.
    pub(super) fn tend(&mut self) -> Result<(), Failure> {
        if let Some(news) = self.limiter.held() {
            terminal::note(&news.to_string());
        }
        self.draw_in_time()
    }

    /// Tells what the frames are, if that is news.
    fn head(&mut self, frame: &Frame<'_>) -> Result<(), Failure> {
        let shown = frame.layout();
        let before = self.shown.replace(shown);
        if before == Some(shown) {
            return Ok(());
        }
        let all = channels(frame);
        let what = carried(frame, &all);
        self.publisher = frame.announced().map_or_else(String::new, |it| it.publisher.clone());
        self.channels = self.chosen(&all, before)?;
        let news = match before {
            None => format!("\"{}\" carries {what}", self.service),
            Some(_) => format!("\"{}\" has changed, and now carries {what}", self.service),
        };
        match &mut self.sink {
            // The table itself says it.
            Sink::Screen(screen) => {
                screen.leave();
                self.undrawn = None;
                self.drawn = None;
            }
            _ => {
                if let Some(news) = self.limiter.pass(news) {
                    terminal::note(&news.to_string());
                }
            }
        }
        if let Sink::Csv(rows) = &mut self.sink {
            let named = self.channels.iter().map(|it| (it.name.as_str(), it.unit.as_str()));
            let names: Vec<_> = named.collect();
            let further = self.choice.columns.iter().map(|column| column.as_str());
            let own: Vec<&str> = [TIME, CYCLE].into_iter().chain(further).collect();
            rows.header(&own, &names)?;
        }
        Ok(())
    }

    /// The channels that were chosen, of frames that follow those shown `before`.
    fn chosen(&self, all: &[Channel], before: Option<LayoutKey>) -> Result<Vec<Channel>, Failure> {
        if self.choice.signals.is_empty() {
            return Ok(all.to_vec());
        }
        let place = |name: &String| {
            let found = all.iter().find(|channel| channel.name == *name).cloned();
            found.ok_or_else(|| {
                let (service, names) = (&self.service, listed(all));
                let question = suggestion::question(name, all.iter().map(|it| it.name.as_str()));
                let why =
                    format!("\"{service}\" has no signal \"{name}\"; it has: {names}{question}");
                match before {
                    None => Failure::usage(why),
                    // A failure after the start is not a wrong command line.
                    Some(_) => Failure::found(why),
                }
            })
        };
        self.choice.signals.iter().map(place).collect()
    }

    fn body(&mut self, frame: &Frame<'_>) -> Result<(), Failure> {
        let (header, values, receipt) = (frame.header(), frame.channels(), frame.receipt());
        let due_ns = receipt.due_ns();
        let first_ns = *self.first_ns.get_or_insert(due_ns);
        let chosen =
            self.channels.iter().map(|channel| (channel, values.get(channel.place).copied()));
        match &mut self.sink {
            Sink::Count => Ok(()),
            Sink::Lines => {
                let mut line =
                    format!("{:>8} {:>8} {:>12} ", header.sequence, header.cycle, age(&receipt));
                // A channel without a name is shown by its index.
                let is_named = self.shown.is_some_and(|shown| shown.is_announced);
                for (channel, value) in chosen {
                    let value = value.map_or_else(
                        || NO_VALUE.to_owned(),
                        |value| shown(value, type_of(&channel.value_type), Digits::All),
                    );
                    if is_named {
                        line += &format!(" {}={value}", channel.name)
                    } else {
                        line += &format!(" {value}")
                    }
                }
                terminal::print(&(line + &doubts(&receipt, "  ") + "\n"))
            }
            Sink::Objects => {
                let object = Object::new(&receipt, values, &self.channels);
                terminal::print(&terminal::json_line(&object)?)
            }
            Sink::Screen(_) => {
                self.undrawn = Some(ReceivedFrame { receipt, values: values.to_vec() });
                Ok(())
            }
            Sink::Csv(rows) => {
                let time_s = due_ns.wrapping_sub(first_ns).cast_signed() as f64 / 1e9;
                let further: Vec<String> =
                    self.choice.columns.iter().map(|column| column.of(&receipt)).collect();
                let values = chosen.map(|(_, value)| value);
                rows.row_with(Some(time_s), header.cycle, &further, values)
            }
        }
    }

    /// Flushes everything for a program that reads the output meanwhile.
    pub(crate) fn flush(&mut self) -> Result<(), Failure> {
        match &mut self.sink {
            Sink::Csv(rows) => rows.flush(),
            _ => self.draw_in_time(),
        }
    }

    /// As [`flush`](Self::flush), once nothing more comes.
    pub(crate) fn finish(&mut self) -> Result<(), Failure> {
        if let Some(news) = self.limiter.take_held() {
            terminal::note(&news.to_string());
        }
        self.draw()?;
        self.flush()
    }

    fn draw_in_time(&mut self) -> Result<(), Failure> {
        match &self.sink {
            Sink::Screen(screen) if screen.is_due() => self.draw(),
            _ => Ok(()),
        }
    }

    fn draw(&mut self) -> Result<(), Failure> {
        let Sink::Screen(screen) = &mut self.sink else { return Ok(()) };
        let silence_s = self.silence.map(|silence| silence.seconds());
        if let Some(frame) = self.undrawn.take() {
            self.drawn = Some(frame);
        } else if silence_s == self.drawn_silence_s {
            return Ok(());
        }
        let Some(frame) = &self.drawn else { return Ok(()) };
        self.drawn_silence_s = silence_s;
        let (service, publisher, silence) = (&self.service, &self.publisher, self.silence);
        screen.draw(&Heading { service, publisher, frame, silence }, &self.channels)
    }

    /// Tells that frames have ceased, or come again.
    pub(super) fn tell(&mut self, news: Option<String>, silence: Option<Silence>) {
        self.silence = silence;
        // A table says it itself.
        let is_shown = matches!(self.sink, Sink::Screen(_)) && self.drawn.is_some();
        if let Some(news) = news.filter(|_| !is_shown)
            && let Some(news) = self.limiter.pass(news)
        {
            terminal::note(&news.to_string());
        }
    }

    /// Lets others write to the terminal.
    pub(crate) fn leave(&mut self) {
        if let Sink::Screen(screen) = &mut self.sink {
            screen.leave();
        }
    }
}
