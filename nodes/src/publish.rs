//! `publish`: a publisher process.

mod args;
mod from;
mod pace;
mod signals;

use std::sync::Arc;

use isochrone_cyclic::{Clock, EPOCH_GRID_NS, Monotonic, PromptWakeUps};
use isochrone_ipc::{Announcing, FrameLayout, FramePublisher, Stamp, ipc};
use isochrone_timing::units::{counted, duration};

pub(crate) use self::args::Args;
use self::args::refuse_reserved;
use self::pace::Pace;
use self::signals::Signals;
use crate::base::failure::Failure;
use crate::base::numbers;
use crate::base::rows;
use crate::base::stop;
use crate::base::{configuration, terminal};

const DEFAULT_RATE_HZ: f64 = 1000.0;
/// The longest default. 150 us is no multiple of 100 us, so it lies between the releases of most tasks; and it is
/// early enough for tasks that wait some 300 us for the frames that they follow.
const LONGEST_DEFAULT_PHASE_NS: u64 = 150_000;

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if let Some(file) = &args.from.from {
        return from::run(args, file);
    }
    let [service] = &args.services[..] else {
        return Err(Failure::usage(
            "--value, --wave and --csv publish on one service; name one, and start another publisher for each \
             other one",
        ));
    };
    configuration::service_name(service)?;
    refuse_reserved(service)?;
    let signals = Signals::new(&args.source)?;
    let pace = pace(args, &signals)?;
    let layout = FrameLayout { signals: signals.specs().to_vec(), period_ns: pace.period_ns() };
    layout.check().map_err(Failure::usage)?;
    let stop = stop::on_signal(None)?;
    let participant = Arc::new(args.take_over.of(args.domain.join("isochrone/publish")?));
    participant.refuse_far_writers(&[service]).map_err(Failure::found)?;
    let mut publisher = FramePublisher::<ipc::Service>::open(&participant, service, &layout)
        .map_err(Failure::found)?;
    let rows = signals.table().map(|table| table.len() as u64);
    let count = args.count.or(rows);
    let announcing = Announcing::start(&participant, service, "publish", &layout);
    let _announcing = announcing.map_err(Failure::found)?;
    let names = layout.signals.iter().map(|signal| signal.name.as_str()).collect::<Vec<_>>();
    terminal::note(&format!(
        "publishing {} on \"{}\" at {}. Press Ctrl-C to end it.",
        names.join(", "),
        service,
        said(&pace, args, &signals)
    ));
    // Readers that wait learn first what the frames will be.
    let now_ns = Monotonic.now_ns();
    let first_ns = pace.first_ns(now_ns + Announcing::HEAD_START_NS);
    let stop = stop::after(stop, args.seconds, first_ns - now_ns);
    stop.keep_time()?;
    let mut pacer = pace.start(first_ns, stop.flag());
    let _prompt = PromptWakeUps::in_this_thread();
    let mut frame = 0;
    while count.is_none_or(|count| frame < count) && !stop.is_due() {
        let Some(due) = pacer.wait() else { break };
        if let Some(values) = publisher.values_mut() {
            // A wave follows the grid, a recording the frames: no row is left out.
            let time_s = due.cycle as f64 * pace.period_ns().unwrap_or_default() as f64 / 1e9;
            signals.write(frame, time_s, values);
        }
        let stamp = Stamp {
            cycle: due.cycle,
            release_ns: due.release_ns,
            missed: due.missed,
            ..Stamp::default()
        };
        publisher.send(stamp, || Monotonic.now_ns());
        publisher.prepare();
        frame += 1;
    }
    let missed = pacer.missed();
    let counters = publisher.counters();
    let unsent = counters.unsent + counters.send_errors;
    let summary = Summary { service, frames: counters.sent, unsent, missed };
    if args.json {
        return terminal::print_json(&summary);
    }
    terminal::print(&summary.text())
}

/// The summary of what was published.
#[derive(serde::Serialize)]
struct Summary<'a> {
    service: &'a str,
    frames: u64,
    unsent: u64,
    missed: u64,
}

impl Summary<'_> {
    /// For people.
    fn text(&self) -> String {
        let Self { service, frames, unsent, missed } = *self;
        let (frames, missed) = (counted(frames, "frame"), counted(missed, "release"));
        format!(
            "published {frames} on \"{service}\", {unsent} could not be sent, {missed} missed\n"
        )
    }
}

/// The requested rate, the recorded pace, or the default rate.
fn pace(args: &Args, signals: &Signals) -> Result<Pace, Failure> {
    let recorded = signals.table().and_then(Pace::recorded).filter(|_| args.rate.is_none());
    let Some(recorded) = recorded else {
        let period_ns = (1e9 / args.rate.unwrap_or(DEFAULT_RATE_HZ)).round() as u64;
        let phase_ns = args.phase.unwrap_or(LONGEST_DEFAULT_PHASE_NS.min(period_ns / 2));
        if phase_ns >= period_ns {
            let [phase, period] = [phase_ns, period_ns].map(|ns| duration(ns as f64));
            return Err(Failure::usage(format!(
                "--phase {phase} is not less than the {period} between two frames; give the rest of its division by \
                 that, or another --rate"
            )));
        }
        if args.phase.is_some() && !EPOCH_GRID_NS.is_multiple_of(period_ns) {
            let of_tasks = if period_ns.is_multiple_of(EPOCH_GRID_NS) {
                "tasks whose period does not divide 20 ms"
            } else {
                "tasks"
            };
            terminal::note(&format!(
                "note: how --phase puts the frames to the releases of {of_tasks} is another at each start, because \
                 20 ms are no multiple of the {} between two frames",
                duration(period_ns as f64)
            ));
        }
        return Ok(Pace::Grid { period_ns, phase_ns });
    };
    if args.phase.is_some() {
        return Err(Failure::usage(
            "--phase is for frames at a rate, and these keep their recorded pace; give --rate too, or leave --phase out",
        ));
    }
    Ok(recorded)
}

/// A pace as text.
fn said(pace: &Pace, args: &Args, signals: &Signals) -> String {
    let hz = pace
        .period_ns()
        .map(|period_ns| format!("{} Hz", numbers::six_digits(1e9 / period_ns as f64)));
    match (pace, hz) {
        (Pace::Grid { .. }, Some(hz)) if args.rate.is_none() && signals.table().is_some() => {
            format!("{hz}, as the file has no column {}; --rate sets another", rows::TIME)
        }
        (Pace::Grid { .. }, hz) => hz.unwrap_or_default(),
        (Pace::Recorded { .. }, Some(hz)) => format!("its recorded pace, {hz}"),
        (Pace::Recorded { .. }, None) => "its recorded pace".into(),
    }
}
