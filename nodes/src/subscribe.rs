//! `subscribe`: a subscriber process.

mod channel;
mod line;
mod screen;
mod taken;
mod transcript;

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::parse_seconds;
use isochrone_ipc::{Participant, ipc};
use isochrone_machine::Environment;
use isochrone_report::Report;
use isochrone_runtime::FrameWait;
use isochrone_timing::units::counted;

use self::line::Line;
use self::screen::Screen;
use self::transcript::{Choice, Sink, Transcript};
use crate::domain;
use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::rows::Rows;
use crate::stop;
use crate::{configuration, list, numbers, terminal};

/// Show, record or measure the frames of a service
///
/// Waits for the service if it does not exist yet. On a terminal, a table shows the newest values
/// and is updated in place. In a pipe, each frame is one line: sequence, cycle, age and values,
/// with the signal names that the publisher announces.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone subscribe plant/level\n  \
    isochrone subscribe plant/level --signals level.y --every 100 | tee log\n  \
    isochrone subscribe plant/level --csv out.csv --count 5000\n  \
    isochrone subscribe plant/level --stats --seconds 10 --spin\n\n\
    The columns of --csv are `time_s`, `cycle` and the signals. `time_s` is when the frame's cycle was \
    due (or, if the publisher does not give that, when it was sent), in seconds after the first row. \
    Numbers are written with full precision, so `publish --csv` publishes the same values again. If the publisher changes its signals, a new header row follows.")]
pub(crate) struct Args {
    /// Service to subscribe to, such as plant/level
    service: String,
    /// Write frames to this file ("-": stdout) instead of showing them
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Signals to show or write, in this order; default: all
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    signals: Vec<String>,
    /// Count frames instead of showing them; at the end, show rate, loss and latency: of the last
    /// hop, and end to end through all nodes
    #[arg(long)]
    stats: bool,
    /// Show or write only every Nth frame; with --stats, show these frames too
    #[arg(long, value_name = "N", value_parser = numbers::parse_count, allow_negative_numbers = true)]
    every: Option<u64>,
    /// Stop after this many frames
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    count: Option<u64>,
    /// Stop after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Look for frames without pause: uses a whole CPU, and the latency is that of the link alone.
    /// Otherwise it sleeps until the next frame is due, and its wake-up adds to the latency
    #[arg(long)]
    spin: bool,
    /// With --stats, print the report as JSON
    #[arg(long, requires = "stats")]
    json: bool,
    /// Write the report of --stats (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Say nothing while waiting for the service
    #[arg(long, hide = true)]
    wait_silently: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// Between two looks for a layout, at the end.
const LOOK_INTERVAL: Duration = Duration::from_millis(1);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    configuration::service_name(&args.service)?;
    let sink = sink(args)?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let stop = stop::on_signal(args.seconds)?;
    let participant = args.domain.join("isochrone/subscribe")?;
    let say_waiting = || {
        if !args.wait_silently {
            terminal::note(&waiting(&participant, &args.service));
        }
    };
    let Some(mut line) = Line::open(&participant, &args.service, &stop, say_waiting)? else {
        let service = &args.service;
        let way_out = match list::similar(&participant, service) {
            Some(similar) => format!("did you mean \"{similar}\"?"),
            None => "start its publisher, or see `isochrone list` for those that there are".into(),
        };
        return Err(Failure::nobody(format!("there is no service \"{service}\"; {way_out}")));
    };
    terminal::note(&format!("subscribed to \"{}\". Press Ctrl-C to end it.", args.service));
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    let choice = Choice { every: args.every.unwrap_or(1), signals: args.signals.clone() };
    let mut transcript = Transcript::new(&args.service, sink, choice);
    let wait = (!args.spin).then(FrameWait::in_this_thread);
    let wants_more = |frames| args.count.is_none_or(|count| frames < count);
    while wants_more(line.frames()) && !stop.is_due() {
        if line.receive(&mut transcript) {
            transcript.write(&line.watcher, line.now_ns)?;
            continue;
        }
        // Whoever reads along shall not wait for a buffer to fill.
        transcript.write(&line.watcher, line.now_ns)?;
        transcript.flush()?;
        let alarms = line.alarms.len();
        line.care();
        if line.alarms.len() > alarms {
            transcript.leave();
        }
        if let Some(wait) = &wait {
            line.sleep(wait);
        }
    }
    while transcript.is_waiting() {
        thread::sleep(LOOK_INTERVAL);
        line.now_ns = Monotonic.now_ns();
        line.care();
        transcript.write(&line.watcher, line.now_ns)?;
    }
    transcript.finish()?;
    line.date_rest();

    let link = line.report();
    let outcome = line.outcome();
    report.warnings = line.alarms.iter().map(Into::into).collect();
    report.links = vec![link.into()];
    if let Some(mut file) = report_file {
        file.write_report(&report)?;
    }
    if args.stats {
        if args.json {
            terminal::print_json(&report)?;
        } else {
            terminal::print(&report.to_string())?;
        }
    } else if let [link] = &report.links[..] {
        terminal::note(&format!("{}, {} lost", counted(link.link.frames, "frame"), link.link.lost));
    }
    outcome
}

fn sink(args: &Args) -> Result<Sink, Failure> {
    Ok(match &args.csv {
        Some(path) => Sink::Csv(Rows::create(path)?),
        None if args.stats && args.every.is_none() => Sink::Count,
        None if io::stdout().is_terminal() => Sink::Screen(Screen::default()),
        None => Sink::Lines,
    })
}

/// What a subscriber says that waits for a service.
fn waiting(participant: &Participant<ipc::Service>, service: &str) -> String {
    let meant = match list::similar(participant, service) {
        Some(similar) => format!("; did you mean \"{similar}\"?"),
        None => ".".into(),
    };
    format!(
        "waiting for service \"{service}\", which does not exist yet{meant} Press Ctrl-C to end it."
    )
}
