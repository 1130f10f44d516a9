//! `subscribe`: a subscriber process.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::escaped;
use isochrone_ipc::{Depth, FrameHeader, FrameLayout, FrameSubscriber, ipc};
use isochrone_timing::{Environment, FrameRecord, LinkTiming, Report};

use crate::domain::{self, Domain};
use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::stop::{Stop, parse_seconds};
use crate::{load, numbers, terminal};

/// Print, record or measure the frames of a service
///
/// Waits for the service if it does not exist yet. Without --csv and --stats every frame is a line:
/// sequence, cycle, age and values.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone subscribe plant/level\n  \
    isochrone subscribe plant/level --csv out.csv --count 5000\n  \
    isochrone subscribe plant/level --stats --seconds 10 --spin")]
pub(crate) struct Args {
    /// Service to subscribe to, such as plant/level
    service: String,
    /// Write `cycle` and every signal to this file ("-": stdout) instead of printing frames
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Count frames instead of printing them; at the end rate, loss and one-way latency
    #[arg(long)]
    stats: bool,
    /// Print every Nth frame only; with --stats, print them as well
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// End after this many frames
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    count: Option<u64>,
    /// End after this many seconds
    #[arg(long, value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Look for frames without pause: uses a whole CPU, and the latency is that of the link alone.
    /// Otherwise it looks every 100 us, and that is part of the latency
    #[arg(long)]
    spin: bool,
    /// With --stats, print the report as JSON
    #[arg(long, requires = "stats")]
    json: bool,
    /// Write the report of --stats (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    #[command(flatten)]
    domain: domain::Args,
}

const LOOK_INTERVAL: Duration = Duration::from_micros(100);
/// While waiting for the service, and for publishers that come.
const SEARCH_INTERVAL: Duration = Duration::from_millis(5);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    load::service_name(&args.service)?;
    let csv = args.csv.as_deref().map(create).transpose()?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let stop = Stop::on_signal(args.seconds)?;
    let domain = Domain::find(&args.domain)?;
    let participant = domain.join("isochrone/subscribe")?;
    let mut found = None;
    while found.is_none() && !stop.is_due() {
        found =
            FrameSubscriber::<ipc::Service>::open_existing(&participant, &args.service, Depth::All)
                .map_err(Failure::found)?;
        if found.is_none() {
            thread::sleep(SEARCH_INTERVAL);
        }
    }
    let Some(mut subscriber) = found else {
        let service = &args.service;
        return Err(Failure::nobody(format!(
            "there is no service \"{service}\"; start its publisher, or see `iox2 service list` for those that there are"
        )));
    };
    let layout = subscriber.layout().clone();
    terminal::note(&format!(
        "subscribed to \"{}\": {}. Ctrl-C ends it.",
        args.service,
        match layout.signals.len() {
            0 => "a frame that does not describe itself".into(),
            channels => column_names(&layout, channels).join(", "),
        }
    ));
    let report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    let mut sink = Sink::new(args, csv, layout);
    let mut timing = LinkTiming::new();
    let mut repair = subscriber.repair();
    while !stop.is_due() {
        let Some(frame) = subscriber.next() else {
            // Whoever reads along shall not wait for a buffer to fill.
            sink.flush()?;
            repair.tend(&participant);
            if !args.spin {
                thread::sleep(LOOK_INTERVAL);
            }
            continue;
        };
        let received_ns = Monotonic.now_ns();
        let header = frame.header();
        timing.record(&FrameRecord {
            sequence: header.sequence,
            publish_ns: header.publish_ns,
            source_ns: header.source_ns,
            received_ns,
        });
        sink.take(header, frame.values(), received_ns, timing.frames())?;
        if args.count.is_some_and(|count| timing.frames() >= count) {
            break;
        }
    }
    sink.flush()?;
    let publishers = subscriber.publishers();
    drop(subscriber);
    let report = Report { links: vec![timing.report(&args.service)], ..report };
    if let Some(file) = report_file {
        file.write_report(&report)?;
    }
    if args.stats {
        match args.json {
            true => terminal::print_json(&report)?,
            false => terminal::print(&report.to_string())?,
        }
    } else {
        terminal::note(&format!("{} frames, {} lost", timing.frames(), timing.lost()));
    }
    match (timing.frames(), publishers) {
        (1.., _) => Ok(()),
        (0, 0) => Err(Failure::nobody(format!("service \"{}\" has no publisher", args.service))),
        (0, _) => Err(Failure::nobody(format!("service \"{}\" sent nothing", args.service))),
    }
}

fn create(path: &Path) -> Result<Box<dyn Write>, Failure> {
    if path == Path::new("-") {
        return Ok(Box::new(std::io::stdout().lock()));
    }
    match File::create(path) {
        Ok(file) => Ok(Box::new(file)),
        Err(error) => Err(Failure::usage(format!("cannot write {}: {error}", path.display()))),
    }
}

/// Where the frames go.
enum Sink {
    /// Nowhere: they are only counted.
    Count,
    /// A line for each, for people.
    Lines { every: u64, names: Vec<String> },
    /// A CSV file of the same form that `simulate` writes.
    Csv {
        name: String,
        out: BufWriter<Box<dyn Write>>,
        layout: FrameLayout,
        columns: Option<usize>,
    },
}

impl Sink {
    fn new(args: &Args, csv: Option<Box<dyn Write>>, layout: FrameLayout) -> Self {
        match csv {
            Some(out) => Self::Csv {
                name: args.csv.as_deref().unwrap_or(Path::new("-")).display().to_string(),
                out: BufWriter::with_capacity(1 << 16, out),
                layout,
                columns: None,
            },
            None if args.stats && args.every.is_none() => Self::Count,
            None => Self::Lines {
                every: args.every.unwrap_or(1),
                names: column_names(&layout, layout.signals.len()),
            },
        }
    }

    fn take(
        &mut self,
        header: &FrameHeader,
        values: &[f64],
        received_ns: u64,
        frames: u64,
    ) -> Result<(), Failure> {
        match self {
            Self::Count => Ok(()),
            Self::Lines { every, .. } if !(frames - 1).is_multiple_of(*every) => Ok(()),
            Self::Lines { names, .. } => {
                let age_us = received_ns.saturating_sub(header.publish_ns) as f64 / 1e3;
                let mut line =
                    format!("{:>8} {:>8} {age_us:>9.1} us ", header.sequence, header.cycle);
                for (channel, value) in values.iter().enumerate() {
                    let name = names.get(channel).map_or("", String::as_str);
                    let equals = if name.is_empty() { "" } else { "=" };
                    line += &format!(" {name}{equals}{}", numbers::format(*value));
                }
                terminal::print(&(line + "\n"))
            }
            Self::Csv { name, out, layout, columns } => {
                let mut row = String::new();
                if columns.is_none() {
                    row += &format!("cycle,{}\n", column_names(layout, values.len()).join(","));
                }
                let expected = *columns.get_or_insert(values.len());
                if values.len() != expected {
                    return Err(Failure::found(format!(
                        "the frames changed from {expected} to {} channels; {name} ends before that",
                        values.len()
                    )));
                }
                row += &header.cycle.to_string();
                for value in values {
                    row.push(',');
                    row += &numbers::format(*value);
                }
                row.push('\n');
                out.write_all(row.as_bytes()).map_err(|error| cannot_write(name, &error))
            }
        }
    }

    fn flush(&mut self) -> Result<(), Failure> {
        match self {
            Self::Csv { name, out, .. } => out.flush().map_err(|error| cannot_write(name, &error)),
            _ => Ok(()),
        }
    }
}

fn cannot_write(name: &str, error: &std::io::Error) -> Failure {
    match error.kind() {
        ErrorKind::BrokenPipe => Failure::reader_left(),
        _ => Failure::found(format!("cannot write {name}: {error}")),
    }
}

/// The signals' names, or the channels' numbers where the service does not say. Whoever made the
/// service chose the names, so they are escaped, also for a file that somebody will look at.
fn column_names(layout: &FrameLayout, channels: usize) -> Vec<String> {
    let name = |channel: usize| match layout.signals.get(channel) {
        Some(signal) if !signal.name.is_empty() => escaped(&signal.name).into_owned(),
        _ => format!("ch{channel}"),
    };
    (0..channels).map(name).collect()
}

#[cfg(test)]
mod tests {
    use isochrone_ipc::SignalSpec;

    use super::*;

    #[test]
    fn a_name_that_another_process_chose_does_not_reach_the_terminal_as_a_command() {
        let signals = vec![SignalSpec::new("a\u{1b}[2J\u{9b}", ""), SignalSpec::default()];
        let layout = FrameLayout { signals, period_ns: None };
        assert_eq!(column_names(&layout, 2), [r"a\u001b[2J\u009b", "ch1"]);
    }
}
