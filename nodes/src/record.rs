//! `record`: the frames of services, in an MCAP file.

mod left_out;
mod output;
mod progress;
mod source;
mod split;
mod summary;
mod wanted;

use std::path::PathBuf;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};
use isochrone_engine::parse_seconds;
use isochrone_ipc::Participant;
use isochrone_ipc::ipc::Service;
use isochrone_processes::Stop;
use isochrone_timing::units::counted;

use self::left_out::LeftOut;
use self::output::{Broken, Output};
use self::progress::Progress;
use self::source::Source;
use self::split::Split;
use self::summary::Summary;
use self::wanted::{EVERY, RecordSelection};
use crate::base::failure::Failure;
use crate::base::{domain, stop, terminal};

/// Record frames of services in an MCAP file, every frame and bit for bit
///
/// Foxglove, PlotJuggler, `ros2 bag info` and Python's `mcap` read the file as it is; `export` makes CSV of it.
/// A NODE stands for all services that it publishes. What does not exist yet is recorded as soon as it
/// does. Lost frames are counted, and marked in the file where they are missing. What was recorded up to a
/// second ago is in the file even if the recorder is killed. The exit status is 1 if a frame that was received could
/// not be written, or a service that was wanted was left out.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone record -o all.mcap\n  \
    isochrone record plant/level plant/analog -o level.mcap --seconds 60\n  \
    isochrone record level -o shift.mcap --split 1h\n\n\
    No file is replaced: where level.mcap is there, level_0002.mcap is written, and so on. With --split, \
    the files are shift_0001.mcap, shift_0002.mcap and so on.")]
pub(crate) struct Args {
    /// Services or control nodes; default: all services, also those to come, but for those of isochrone itself
    // Shells complete services where they are called so.
    #[arg(id = "service", value_name = "SERVICE|NODE")]
    wanted: Vec<String>,
    /// File to write
    #[arg(short, long, value_name = "OUT.mcap")]
    output: PathBuf,
    /// Stop after this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Begin another file after this time or about this size: 10min, 1h, 500MB, 1GB
    #[arg(long, value_name = "TIME|SIZE", value_parser = split::parse, allow_negative_numbers = true)]
    split: Option<Split>,
    /// At the end, print what was recorded as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// How often services that are yet to come are looked for.
const SEARCH_INTERVAL_NS: u64 = 10_000_000;
/// How often everything is handed to the system.
const FLUSH_INTERVAL_NS: u64 = 1_000_000_000;
/// How many frames of one service are taken before it is the turn of the next.
const TURN: usize = 64;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut output = Output::open(&args.output, args.split)?;
    let stop = stop::on_signal(args.seconds)?;
    let participant = args.domain.join("isochrone/record")?;
    let wanted = RecordSelection::new(&args.wanted);
    let mut recorder = Recorder { participant: &participant, wanted, sources: Vec::new() };
    let ended = recorder.run(&mut output, &stop);
    let mut left_out = recorder.wanted.left_out();
    if !matches!(ended, Err(Ended::Unbegun(_))) {
        left_out.extend(recorder.unheard());
    }
    let summary = Summary::new(&recorder.sources, &output, &left_out);
    match (args.json, &ended) {
        (true, _) => terminal::print_json(&summary)?,
        (false, Err(Ended::Unbegun(_))) => {}
        (false, _) => terminal::note(&summary.text()),
    }
    match ended {
        Err(Ended::Unbegun(failure)) => Err(failure),
        Err(Ended::Broken(broken)) => Err(broken.failure(summary.unwritten_frames)),
        Ok(()) => recorder.outcome(&output, &left_out),
    }
}

/// Why a recording ends before it is to stop.
enum Ended {
    /// Something that was requested cannot be recorded.
    Unbegun(Failure),
    /// The file cannot be written any more.
    Broken(Broken),
}

impl From<Broken> for Ended {
    fn from(broken: Broken) -> Self {
        Self::Broken(broken)
    }
}

/// The services that are recorded, and the names that are yet to be found.
struct Recorder<'a> {
    participant: &'a Participant<Service>,
    wanted: RecordSelection,
    sources: Vec<Source<'a>>,
}

impl Recorder<'_> {
    /// Records until it is to stop, and closes the file.
    fn run(&mut self, output: &mut Output, stop: &Stop) -> Result<(), Ended> {
        let _prompt = PromptWakeUps::in_this_thread();
        let progress = Progress::default();
        self.wanted.begin(self.participant, &mut self.sources).map_err(Ended::Unbegun)?;
        self.wanted.say_waiting(self.participant);
        let services = counted(self.sources.len(), "service");
        let file = output.file().display();
        terminal::note(&format!("recording {services} in {file}. Press Ctrl-C to end it."));
        let (mut search_ns, mut flush_ns) = (0, Monotonic.now_ns() + FLUSH_INTERVAL_NS);
        // Once it is to stop and nothing more lies there, only frames that wait for their layout are written.
        let mut has_all = false;
        loop {
            let is_due = stop.is_due();
            let mut has_news = false;
            for source in &mut self.sources {
                if has_all {
                    source.write_waiting(output)?;
                } else {
                    has_news |= source.write(TURN, output)?;
                }
            }
            has_all |= is_due && !has_news;
            let now_ns = Monotonic.now_ns();
            if is_due {
                // What comes from now on is not wanted any more.
                search_ns = u64::MAX;
            }
            if now_ns >= search_ns {
                search_ns = now_ns + SEARCH_INTERVAL_NS;
                self.wanted.find(self.participant, &mut self.sources);
            }
            if now_ns >= flush_ns {
                flush_ns = now_ns + FLUSH_INTERVAL_NS;
                output.flush()?;
                progress.show(&self.sources, output);
            }
            if has_all && !self.sources.iter().any(Source::is_waiting) {
                return Ok(output.close()?);
            }
            if !has_news {
                let looks = self.sources.iter_mut().map(Source::next_look_ns);
                let look_ns = looks.min().unwrap_or(search_ns);
                Monotonic.sleep_until_ns(look_ns.min(search_ns).min(flush_ns));
            }
        }
    }

    /// Services without a frame, although they have a publisher.
    fn unheard(&self) -> Vec<LeftOut> {
        let silent: Vec<_> = self.sources.iter().filter(|source| source.frames() == 0).collect();
        if !silent.is_empty() {
            // A killed publisher no longer counts.
            self.participant.clean_up();
        }
        let is_named = self.wanted.is_named();
        silent.iter().filter_map(|source| source.unheard(self.participant, is_named)).collect()
    }

    /// An empty recording is a failure, whatever the reason, and so is one that lacks a requested service.
    fn outcome(&self, output: &Output, left_out: &[LeftOut]) -> Result<(), Failure> {
        if output.frames() > 0 || left_out.iter().any(|it| !it.is_absent) {
            let each = left_out.iter().map(|LeftOut { service, why, .. }| match &**service {
                EVERY => format!("services that came later: {why}"),
                service => format!("\"{service}\": {why}"),
            });
            return match each.collect::<Vec<_>>() {
                none if none.is_empty() => Ok(()),
                services => Err(Failure::found(format!("not recorded: {}", services.join("; ")))),
            };
        }
        let way_out = "start what publishes them, or see `isochrone list` for what there is";
        Err(Failure::nobody(match &self.sources[..] {
            [] => format!("there is no service to record; {way_out}"),
            sources => {
                let names: Vec<String> =
                    sources.iter().map(|source| format!("\"{}\"", source.service())).collect();
                format!("nothing was sent on {}; {way_out}", names.join(", "))
            }
        }))
    }
}
