//! `publish`: a publisher process.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, Scope, Thread};
use std::time::Duration;

use isochrone_cyclic::{Clock, Cyclic, Monotonic, Schedule, Wake};
use isochrone_engine::parse_seconds;
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, OpenError, Participant, Repair, SignalSpec,
    Stamp, ipc,
};
use serde_json::json;

use crate::domain;
use crate::failure::Failure;
use crate::recording::Recording;
use crate::stop::Stop;
use crate::wave::{Shape, Wave};
use crate::{configuration, terminal};

/// Publish frames of values: constants, waves or a CSV file
///
/// A channel for each value, wave or CSV column. A service has one writer: a second publisher of
/// isochrone on the same service is refused.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone publish plant/analog --value 13824,0.5\n  \
    isochrone publish plant/analog --wave sine,square --amplitude 13824,1 --offset 13824 --frequency 0.5\n  \
    isochrone publish plant/analog --csv in.csv --rate 1000")]
#[command(group(clap::ArgGroup::new("what").required(true).args(["value", "wave", "csv"])))]
pub(crate) struct Args {
    /// Service to publish on, such as plant/analog
    service: String,
    /// Constant values, one for each channel
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true, value_name = "V,…")]
    value: Vec<f64>,
    /// Waves, one for each channel
    #[arg(long, value_delimiter = ',', value_enum, value_name = "SHAPE,…")]
    wave: Vec<Shape>,
    /// CSV file: a column for each channel, a row for each frame; ends after the last row, which
    /// holds where --count asks for more
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Peak of each wave, or one for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        allow_negative_numbers = true,
        value_name = "A,…"
    )]
    amplitude: Vec<f64>,
    /// Mean of each wave, or one for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "0",
        allow_negative_numbers = true,
        value_name = "O,…"
    )]
    offset: Vec<f64>,
    /// Frequency of each wave in Hz, or one for all
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1",
        value_parser = parse_frequency,
        allow_negative_numbers = true,
        value_name = "HZ,…"
    )]
    frequency: Vec<f64>,
    /// Frames per second
    #[arg(long, default_value = "1000", value_name = "HZ", value_parser = parse_rate, allow_negative_numbers = true)]
    rate: f64,
    /// End after this many frames
    #[arg(long)]
    count: Option<u64>,
    /// End after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: domain::Args,
}

const MAX_RATE_HZ: f64 = 100_000.0;
const MIN_RATE_HZ: f64 = 1.0 / 3600.0;
/// From the announcement of the layout to the first frame: a node looks for layouts every 20 ms.
const HEAD_START_NS: u64 = 50_000_000;
/// How often a reader that came is looked for.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    configuration::service_name(&args.service)?;
    let signals = Signals::new(args)?;
    let period_ns = (1e9 / args.rate).round() as u64;
    let layout = FrameLayout { signals: signals.specs(), period_ns: Some(period_ns) };
    layout.check().map_err(Failure::usage)?;
    let stop = Stop::on_signal(args.seconds)?;
    stop.keep_time()?;
    let participant = args.domain.join("isochrone/publish")?;
    let mut publisher = FramePublisher::<ipc::Service>::open(&participant, &args.service, &layout)
        .map_err(Failure::found)?;
    let repair = publisher.repair();
    let schedule = Schedule::every(period_ns, Wake::Sleep);
    let count = args.count.or(signals.frames());
    let mut missed = 0;
    thread::scope(|scope| {
        let _announcing = Announcing::start(scope, &participant, &args.service, &layout, repair)?;
        terminal::note(&format!(
            "publishing {} on \"{}\" at {} Hz. Ctrl-C ends it.",
            layout.signals.iter().map(|signal| signal.name.as_str()).collect::<Vec<_>>().join(", "),
            args.service,
            args.rate
        ));
        // Readers that wait learn first what the frames will be.
        let epoch_ns = Monotonic.now_ns() + period_ns.max(HEAD_START_NS);
        let mut cyclic = Cyclic::new(Monotonic, schedule, epoch_ns, stop.flag());
        let mut frame = 0;
        while count.is_none_or(|count| frame < count) && !stop.is_due() {
            let Some(release) = cyclic.wait() else { break };
            if let Some(values) = publisher.values_mut() {
                // A wave follows the grid, a recording the frames: no row is left out.
                signals.write(frame, release.cycle as f64 * period_ns as f64 / 1e9, values);
            }
            let stamp = Stamp {
                cycle: release.cycle,
                release_ns: release.release_ns,
                source_ns: 0,
                missed: release.missed,
            };
            publisher.send(stamp, || Monotonic.now_ns());
            publisher.prepare();
            frame += 1;
        }
        missed = cyclic.missed();
        Ok::<_, Failure>(())
    })?;
    let counters = publisher.counters();
    let (sent, unsent) = (counters.sent, counters.unsent + counters.send_errors);
    if args.json {
        return terminal::print_json(&json!({
            "service": args.service, "frames": sent, "unsent": unsent, "missed": missed,
        }));
    }
    terminal::print(&format!(
        "published {sent} frames on \"{}\", {unsent} could not be sent, {missed} releases missed\n",
        args.service
    ))
}

/// The thread that tells what the frames are, however seldom those are sent, and makes good failed
/// connections. It ends when this is dropped.
struct Announcing {
    is_over: Arc<AtomicBool>,
    thread: Thread,
}

impl Announcing {
    fn start<'scope>(
        scope: &'scope Scope<'scope, '_>,
        participant: &'scope Participant<ipc::Service>,
        service: &'scope str,
        layout: &'scope FrameLayout,
        mut repair: Repair,
    ) -> Result<Self, Failure> {
        let is_over = Arc::new(AtomicBool::new(false));
        let over = is_over.clone();
        let (ready, is_ready) = channel::<Result<(), OpenError>>();
        let thread = scope.spawn(move || {
            // A port belongs to the thread that opens it.
            let opened = LayoutAnnouncer::open(participant, service, "publish", layout);
            let mut announcer = match opened {
                Ok(announcer) => announcer,
                Err(error) => return drop(ready.send(Err(error))),
            };
            let _ = ready.send(Ok(()));
            while !over.load(Ordering::Relaxed) {
                announcer.tend(participant);
                repair.tend(participant);
                thread::park_timeout(LOOK_INTERVAL);
            }
        });
        let announcing = Self { is_over, thread: thread.thread().clone() };
        let gone = |_| Failure::found("the thread that announces the layout ended in its start");
        is_ready.recv().map_err(gone)?.map_err(Failure::found)?;
        Ok(announcing)
    }
}

impl Drop for Announcing {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        self.thread.unpark();
    }
}

/// What the channels carry.
enum Signals {
    Constant(Vec<f64>),
    Waves(Vec<Wave>),
    Recording(Recording),
}

impl Signals {
    fn new(args: &Args) -> Result<Self, Failure> {
        if let Some(path) = &args.csv {
            return Ok(Self::Recording(Recording::read(path, None).map_err(Failure::usage)?));
        }
        if args.wave.is_empty() {
            return Ok(Self::Constant(args.value.clone()));
        }
        let channels = args.wave.len();
        let of = |option: &str, values: &[f64], channel: usize| {
            match values {
            [one] => Ok(*one),
            several => several.get(channel).copied().filter(|_| several.len() == channels).ok_or_else(
                || {
                    let given = several.len();
                    Failure::usage(format!(
                        "--{option} gives {given} values for {channels} waves; give one for all, or one for each"
                    ))
                },
            ),
        }
        };
        let wave = |(channel, shape): (usize, &Shape)| {
            Ok(Wave {
                shape: *shape,
                amplitude: of("amplitude", &args.amplitude, channel)?,
                offset: of("offset", &args.offset, channel)?,
                frequency_hz: of("frequency", &args.frequency, channel)?,
            })
        };
        Ok(Self::Waves(args.wave.iter().enumerate().map(wave).collect::<Result<_, Failure>>()?))
    }

    fn specs(&self) -> Vec<SignalSpec> {
        let names: Vec<String> = match self {
            Self::Constant(values) => {
                (0..values.len()).map(|channel| format!("ch{channel}")).collect()
            }
            Self::Waves(waves) => (0..waves.len()).map(|channel| format!("ch{channel}")).collect(),
            Self::Recording(recording) => recording.columns().to_vec(),
        };
        // Untyped: whether a sample fits its input is for the input to say, sample by sample.
        names.into_iter().map(|name| SignalSpec::new(name, "")).collect()
    }

    /// Frames that there are, if their number is limited.
    fn frames(&self) -> Option<u64> {
        match self {
            Self::Recording(recording) => Some(recording.len() as u64),
            _ => None,
        }
    }

    fn write(&self, frame: u64, time_s: f64, values: &mut [f64]) {
        match self {
            Self::Constant(constants) => values.copy_from_slice(constants),
            Self::Waves(waves) => {
                values.iter_mut().zip(waves).for_each(|(value, wave)| *value = wave.at(time_s));
            }
            Self::Recording(recording) => values.copy_from_slice(recording.row(frame)),
        }
    }
}

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (MIN_RATE_HZ..=MAX_RATE_HZ).contains(&rate) => Ok(rate),
        _ => Err(format!("give frames per second, from {MIN_RATE_HZ:.4} to {MAX_RATE_HZ}")),
    }
}

fn parse_frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(frequency) if frequency.is_finite() && frequency >= 0.0 => Ok(frequency),
        _ => Err("give a frequency in Hz, 0 or greater".into()),
    }
}
