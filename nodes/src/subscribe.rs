//! `subscribe`: a subscriber process.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FrameHeader, FrameSubscriber, LayoutWatcher, Participant, Repair, SenderClock, Stamps,
    ipc,
};
use isochrone_timing::{Environment, FrameRecord, LinkReport, LinkTiming, Report, Warning};

use crate::domain::{self, Domain};
use crate::failure::Failure;
use crate::result_file::ResultFile;
use crate::stop::{Stop, parse_seconds};
use crate::transcript::{Sink, Taken, Transcript};
use crate::{alarms, load, terminal};

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
/// While waiting for the service.
const SEARCH_INTERVAL: Duration = Duration::from_millis(5);
/// How often layouts, peers and connections are looked after.
const CARE_INTERVAL_NS: u64 = 10_000_000;
/// A frame that is older than any wait here by so much has a stamp of another clock.
const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;
/// How long a publisher may be silent, or three of its periods, before that is a fault.
const SILENCE_NS: u64 = 1_000_000_000;

type Service = ipc::Service;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    load::service_name(&args.service)?;
    let csv = args.csv.as_deref().map(create).transpose()?;
    let report_file = args.report.as_deref().map(ResultFile::open).transpose()?;
    let stop = Stop::on_signal(args.seconds)?;
    let domain = Domain::find(&args.domain)?;
    let participant = domain.join("isochrone/subscribe")?;
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
    report.links = vec![link];
    if let Some(file) = report_file {
        file.write_report(&report)?;
    }
    if args.stats {
        match args.json {
            true => terminal::print_json(&report)?,
            false => terminal::print(&report.to_string())?,
        }
    } else if let [link] = &report.links[..] {
        terminal::note(&format!("{} frames, {} lost", link.frames, link.lost));
    }
    outcome
}

/// The frames of a service, and all that is to be said of them.
struct Line<'a> {
    participant: &'a Participant<Service>,
    service: &'a str,
    subscriber: FrameSubscriber<Service>,
    watcher: LayoutWatcher<Service>,
    repair: Repair,
    timing: LinkTiming,
    past_stamps: u64,
    alarms: Vec<Warning>,
    opened_ns: u64,
    now_ns: u64,
    /// When nothing waited to be received.
    idle_ns: u64,
    care_ns: u64,
}

impl<'a> Line<'a> {
    /// Waits for the service; `None` if it is to stop before.
    fn open(
        participant: &'a Participant<Service>,
        service: &'a str,
        stop: &Stop,
    ) -> Result<Option<Self>, Failure> {
        let subscriber = loop {
            let found = FrameSubscriber::open_existing(participant, service, Depth::All);
            match found.map_err(Failure::found)? {
                Some(subscriber) => break subscriber,
                None if stop.is_due() => return Ok(None),
                None => thread::sleep(SEARCH_INTERVAL),
            }
        };
        let watcher = LayoutWatcher::open(participant, service).map_err(Failure::found)?;
        let (repair, now_ns) = (subscriber.repair(), Monotonic.now_ns());
        Ok(Some(Self {
            participant,
            service,
            subscriber,
            watcher,
            repair,
            timing: LinkTiming::new(),
            past_stamps: 0,
            alarms: Vec::new(),
            opened_ns: now_ns,
            now_ns,
            idle_ns: now_ns,
            care_ns: now_ns,
        }))
    }

    /// Receives the next frame; `false` if none waits.
    fn receive(&mut self, transcript: &mut Transcript) -> bool {
        let Some(frame) = self.subscriber.next(self.now_ns) else {
            self.now_ns = Monotonic.now_ns();
            self.idle_ns = self.now_ns;
            return false;
        };
        let received_ns = Monotonic.now_ns();
        let header = *frame.header();
        // It may be written only when its layout is known.
        let channels = frame.values().len();
        let values = if transcript.wants_values() { frame.values().to_vec() } else { Vec::new() };
        self.now_ns = received_ns;
        let stamps = self.judge(&header);
        match stamps {
            Stamps::Foreign => self.timing.count(received_ns),
            Stamps::Believed | Stamps::Future => self.timing.record(&FrameRecord {
                publish_ns: header.publish_ns,
                source_ns: header.source_ns,
                received_ns,
            }),
        }
        let number = self.timing.frames();
        transcript.take(Taken { header, channels, values, received_ns, stamps, number });
        true
    }

    /// Looks after layouts, peers and connections, if it is time.
    fn care(&mut self) {
        if self.now_ns < self.care_ns {
            return;
        }
        self.care_ns = self.now_ns + CARE_INTERVAL_NS;
        self.repair.tend(self.participant);
        self.subscriber.maintain();
        if self.watcher.look(self.participant)
            && let Some(announced) = self.watcher.newest()
        {
            self.subscriber.set_period(announced.layout.period_ns.unwrap_or_default());
        }
        if self.subscriber.counters().other_writers > 0 {
            self.raise(alarms::other_writer(self.service));
        }
    }

    /// Says what the stamps of a frame are worth that was received now.
    fn judge(&mut self, header: &FrameHeader) -> Stamps {
        let announced = self.watcher.find(header.layout);
        let clock = announced.map_or(SenderClock::Shared, |announced| announced.clock());
        let stamps = header.credible(clock, self.now_ns).stamps;
        let age_ns = self.now_ns.saturating_sub(header.publish_ns);
        let waited_ns = self.now_ns.saturating_sub(self.idle_ns);
        match stamps {
            Stamps::Future => {
                let ahead_ns = header.publish_ns.saturating_sub(self.now_ns);
                self.raise(alarms::future_stamps(self.service, ahead_ns));
            }
            Stamps::Foreign => {
                let publisher = announced.map_or_else(String::new, |a| a.publisher.clone());
                self.raise(alarms::foreign_host(self.service, &publisher));
            }
            Stamps::Believed if age_ns > waited_ns.saturating_add(CREDIBLE_DELAY_NS) => {
                self.past_stamps += 1;
                self.raise(alarms::past_stamps(self.service, age_ns));
            }
            Stamps::Believed => {}
        }
        stamps
    }

    /// Raises an alarm, the first of its kind.
    fn raise(&mut self, alarm: Warning) {
        if self.alarms.iter().all(|raised| raised.code != alarm.code) {
            tracing::warn!("{}", alarms::sentence(&alarm));
            self.alarms.push(alarm);
        }
    }

    fn report(&self) -> LinkReport {
        let counters = self.subscriber.counters();
        LinkReport {
            lost: counters.lost,
            restarts: counters.restarts,
            other_writers: counters.other_writers,
            past_stamps: self.past_stamps,
            ..self.timing.report(self.service)
        }
    }

    /// Nothing received is no success, whatever the reason.
    fn outcome(&self) -> Result<(), Failure> {
        let service = self.service;
        if self.timing.frames() > 0 {
            return Ok(());
        }
        // One that was killed is no publisher any more.
        self.participant.clean_up();
        if self.subscriber.publishers() == 0 {
            return Err(Failure::nobody(format!("service \"{service}\" has no publisher")));
        }
        let counters = self.subscriber.counters();
        let period_ns = self.watcher.newest().and_then(|announced| announced.layout.period_ns);
        let patience_ns = period_ns.unwrap_or_default().saturating_mul(3).max(SILENCE_NS);
        let waited_ns = self.now_ns.saturating_sub(self.opened_ns);
        if counters.connect_errors + counters.receive_errors == 0 && waited_ns < patience_ns {
            return Err(Failure::nobody(format!("service \"{service}\" sent nothing")));
        }
        Err(Failure::found(format!(
            "service \"{service}\" has a publisher, but nothing of it arrived in {:.1} s: the two could not connect, or it does not send; see that the file descriptors (ulimit -n) and the memory of both suffice, and that both run as one user",
            waited_ns as f64 / 1e9
        )))
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
