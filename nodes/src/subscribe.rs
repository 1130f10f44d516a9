//! `subscribe`: a subscriber process.

mod line;
mod transcript;

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::parse_seconds;
use isochrone_machine::Environment;
use isochrone_report::Report;

use self::line::Line;
use self::transcript::{Sink, Transcript};
use crate::domain;
use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::stop::Stop;
use crate::{configuration, terminal};

/// Print, record or measure the frames of a service
///
/// Waits for the service if it does not exist yet. Without --csv and --stats every frame is a line:
/// sequence, cycle, age and values, with the names that the publisher announces. Where those change,
/// a note says so, and a CSV file goes on with another header row.
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
    /// Count frames instead of printing them; at the end rate, loss and latency: of the last hop, and
    /// end to end through all nodes
    #[arg(long)]
    stats: bool,
    /// Print every Nth frame only; with --stats, print them as well
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// End after this many frames
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..), allow_negative_numbers = true)]
    count: Option<u64>,
    /// End after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
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

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    configuration::service_name(&args.service)?;
    let csv = args.csv.as_deref().map(create).transpose()?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let stop = Stop::on_signal(args.seconds)?;
    let participant = args.domain.join("isochrone/subscribe")?;
    let Some(mut line) = Line::open(&participant, &args.service, &stop)? else {
        let service = &args.service;
        return Err(Failure::nobody(format!(
            "there is no service \"{service}\"; start its publisher, or see `iox2 service list` for those that there are"
        )));
    };
    terminal::note(&format!("subscribed to \"{}\". Ctrl-C ends it.", args.service));
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    let mut transcript = Transcript::new(&args.service, sink(args, csv));
    let wants_more = |frames| args.count.is_none_or(|count| frames < count);
    while wants_more(line.timing.frames()) && !stop.is_due() {
        if line.receive(&mut transcript) {
            transcript.write(&line.watcher, line.now_ns)?;
            continue;
        }
        // Whoever reads along shall not wait for a buffer to fill.
        transcript.write(&line.watcher, line.now_ns)?;
        transcript.flush()?;
        line.care();
        if !args.spin {
            thread::sleep(LOOK_INTERVAL);
        }
    }
    while transcript.is_waiting() {
        thread::sleep(LOOK_INTERVAL);
        line.now_ns = Monotonic.now_ns();
        line.care();
        transcript.write(&line.watcher, line.now_ns)?;
    }
    transcript.flush()?;

    let link = line.report();
    let outcome = line.outcome();
    report.warnings = line.alarms;
    report.links = vec![link.into()];
    if let Some(file) = report_file {
        file.write_report(&report)?;
    }
    if args.stats {
        match args.json {
            true => terminal::print_json(&report)?,
            false => terminal::print(&report.to_string())?,
        }
    } else if let [link] = &report.links[..] {
        terminal::note(&format!("{} frames, {} lost", link.link.frames, link.link.lost));
    }
    outcome
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

fn sink(args: &Args, csv: Option<Box<dyn Write>>) -> Sink {
    match csv {
        Some(out) => Sink::Csv {
            name: args.csv.as_deref().unwrap_or(Path::new("-")).display().to_string(),
            out: BufWriter::with_capacity(1 << 16, out),
        },
        None if args.stats && args.every.is_none() => Sink::Count,
        None => Sink::Lines { every: args.every.unwrap_or(1) },
    }
}
