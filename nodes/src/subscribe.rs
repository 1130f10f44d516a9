//! `subscribe`: a subscriber process.

mod channel;
mod column;
mod heading;
mod line;
mod measured;
mod object;
mod received;
mod screen;
mod silence;
mod transcript;
mod unheard;

use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use isochrone_cyclic::PromptWakeUps;
use isochrone_engine::parse_seconds;
use isochrone_ipc::{Participant, ipc};
use isochrone_timing::units::counted;

pub(crate) use self::channel::{carried, channels, channels_of};
pub(crate) use self::column::Column;
pub(crate) use self::unheard::{has_failures, obstacle};

use self::line::Line;
use self::screen::Screen;
use self::transcript::{Choice, Sink, Transcript};
use crate::domain;
use crate::failure::Failure;
use crate::files::{ResultFile, keep_apart};
use crate::rows::Rows;
use crate::stop;
use crate::{configuration, list, numbers, program, terminal};

/// Show, record or measure the frames of a service
///
/// Waits for the service if it does not exist yet. On a terminal, a table shows the newest values
/// and is updated in place. In a pipe, each frame is one line: sequence, cycle, age and values,
/// with the signal names that the publisher announces; with --json, one object. When frames cease to
/// come, and when they come again, the table's header says so, or a line on stderr.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone subscribe plant/level\n  \
    isochrone subscribe plant/level --signals level.y --every 100 | tee log\n  \
    isochrone subscribe plant/level --csv out.csv --count 5000\n  \
    isochrone subscribe plant/level --csv out.csv --columns sequence,flags\n  \
    isochrone subscribe plant/level --json | jq -c 'select(.flags != [])'\n  \
    isochrone subscribe plant/level --stats --seconds 10 --spin\n\n\
    The columns of --csv are `time_s`, `cycle` and the signals. `time_s` is when the frame's cycle was \
    due (or, if the publisher does not give that, when it was sent), in seconds after the first row. \
    Numbers are written with full precision, so `publish --csv` publishes the same values again. If the publisher changes its signals, a new header row follows.\n\n\
    --json prints one object per frame and line: `sequence`, `cycle`, `publish_ns` (the sender's monotonic \
    clock), `age_ns` (when it came; null if it was stamped by another clock), `flags` (a list, empty for a \
    frame in order) and `values` by signal name. NaN and infinities are the texts \"NaN\", \"inf\" and \"-inf\".")]
pub(crate) struct Args {
    /// Service to subscribe to, such as plant/level
    service: String,
    /// Write frames to this file ("-": stdout) instead of showing them
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// With --csv, further columns behind `cycle`. `publish --csv` takes a file without them
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…", requires = "csv")]
    columns: Vec<Column>,
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
    /// Stop after this many frames; with --every, of those that are shown or written
    #[arg(long, value_parser = numbers::parse_count, allow_negative_numbers = true)]
    count: Option<u64>,
    /// Stop after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Look for frames without pause: uses a whole CPU, and the latency is that of the link alone.
    /// Otherwise it sleeps until the next frame is due by the announced period, or for 100 us at a time if there is
    /// none, and its wake-up adds to the latency
    #[arg(long)]
    spin: bool,
    /// Print each frame as one JSON object in a line; with --stats, print the report as JSON
    #[arg(long)]
    json: bool,
    /// Write the report of --stats (JSON) to this file at the end
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Say nothing while waiting for the service
    #[arg(long, hide = true)]
    wait_silently: bool,
    /// How long a publisher may send nothing at first before that is an error
    #[arg(long, hide = true, value_name = "TIME", value_parser = parse_seconds)]
    patience: Option<f64>,
    #[command(flatten)]
    domain: domain::Args,
}

/// Between two looks for a layout, at the end.
const LOOK_INTERVAL: Duration = Duration::from_millis(1);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    configuration::service_name(&args.service)?;
    keep_apart([&args.csv, &args.report].into_iter().flatten())?;
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
    let mut report = program::report();
    let every = args.every.unwrap_or(1);
    let (signals, columns) = (args.signals.clone(), args.columns.clone());
    let choice = Choice { every, signals, columns };
    let mut transcript = Transcript::new(&args.service, sink, choice);
    let prompt = (!args.spin).then(PromptWakeUps::in_this_thread);
    // The first frame is shown, and then each `every`th.
    let most = args.count.map(|count| (count - 1).saturating_mul(every).saturating_add(1));
    let wants_more = |frames| most.is_none_or(|most| frames < most);
    while wants_more(line.frames()) && !stop.is_due() {
        let alarms = line.alarms().len();
        let has_come = line.receive(&mut transcript)?;
        if !has_come {
            let news = line.care();
            transcript.tell(news, line.silence());
        }
        if line.alarms().len() > alarms {
            transcript.leave();
        }
        transcript.tend()?;
        if has_come {
            continue;
        }
        // A program that reads the output meanwhile should not wait for a buffer to fill.
        transcript.flush()?;
        if prompt.is_some() {
            line.sleep();
        }
    }
    while wants_more(line.frames()) && line.is_waiting() {
        if !line.receive_waiting(&mut transcript)? {
            thread::sleep(LOOK_INTERVAL);
        }
    }
    transcript.finish()?;

    let link = line.report();
    let outcome = line.outcome(args.patience.unwrap_or_default());
    report.warnings = line.alarms().iter().map(Into::into).collect();
    report.links = vec![link.into()];
    if let Some(file) = report_file {
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
    let prints_frames = !args.stats || args.every.is_some();
    Ok(match &args.csv {
        Some(_) if args.json && !args.stats => {
            return Err(Failure::usage(
                "--json prints each frame and --csv writes each frame: choose one; with --stats, --json prints the report",
            ));
        }
        Some(path) => Sink::Csv(Rows::create(path)?),
        None if !prints_frames => Sink::Count,
        None if args.json && !args.stats => Sink::Objects,
        None if io::stdout().is_terminal() => Sink::Screen(Screen::default()),
        None => Sink::Lines,
    })
}

/// The message of a subscriber that waits for a service.
fn waiting(participant: &Participant<ipc::Service>, service: &str) -> String {
    let suggestion = match list::similar(participant, service) {
        Some(similar) => format!("; did you mean \"{similar}\"?"),
        None => ".".into(),
    };
    format!(
        "waiting for service \"{service}\", which does not exist yet{suggestion} Press Ctrl-C to end it."
    )
}
