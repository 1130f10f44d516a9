//! `chain`: how long values take from a source through the nodes behind it.

mod display;
mod path;
mod service;

use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_engine::parse_seconds;
use isochrone_processes::Stop;
use isochrone_timing::ChainTiming;
use isochrone_timing::units::duration;

use self::display::Measured;
use self::service::{End, MeasuredService};
use crate::failure::Failure;
use crate::{configuration, domain, stop, terminal};

/// Measure how long values take through a chain of nodes
///
/// Name the services in their order, the source first. For each hop and for the whole way, shows the
/// percentiles of the latency: from the sending of a frame to the sending of the first frame that is
/// computed from it. Every frame names the time of its oldest source, by which frames are matched. Each
/// service has one more reader meanwhile.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  isochrone chain plant/analog plant/level plant/valve\n  \
    isochrone chain plant/analog plant/level --seconds 60 --json > chain.json\n\n\
    `wait p50` is the part of the latency before the release of the cycle that sent. `lost` counts frames \
    that nothing was computed from, although something was from later ones: a slower node takes only the \
    newest. `repeated` counts frames computed from the same frame as one before. `unknown` counts frames \
    that go back to no frame of the service before: where a node reads several inputs, the oldest sample \
    hides the others.\n\n\
    Ends with 1 if a service stopped sending, and with 4 if no frame was followed the whole way.")]
pub(crate) struct Args {
    /// Services in their order, the source first: each is published by a node that reads the one before
    #[arg(required = true, num_args = 2.., value_name = "SERVICE")]
    service: Vec<String>,
    /// Measure for this time: 10, 500ms, 5min
    #[arg(long, value_name = "TIME", default_value = "10", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: f64,
    /// Print one JSON document instead of the table, with the distributions
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    domain: domain::Args,
}

/// Between two looks for layouts.
const LOOK_INTERVAL: Duration = Duration::from_millis(1);
/// How long frames are held back before they are matched, in ns: a publisher that loses its CPU while it sends
/// may have served the next node and not yet this program.
const HOLD_NS: u64 = 200_000_000;
/// The same at the end.
const LAST_LOOK: Duration = Duration::from_millis(20);
/// Publishers announce their layout to a new reader within 20 ms, and repeat it every 500 ms.
const ANSWER: Duration = Duration::from_secs(1);

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    for service in &args.service {
        configuration::service_name(service)?;
    }
    let stop = stop::on_signal(None)?;
    let participant = args.domain.join("isochrone/chain")?;
    let nodes = path::nodes(&participant, &args.service)?;
    let mut measured_services = MeasuredService::open_all(&participant, &args.service)?;
    learn_layouts(&mut measured_services, &stop);
    if let Some(far) = measured_services.iter().find(|service| service.is_foreign()) {
        return Err(Failure::usage(format!(
            "service \"{}\" is sent by another machine, whose clock does not compare with the one here; \
             measure there the part of the chain that runs there",
            far.service()
        )));
    }
    terminal::note(&format!(
        "measuring {} for {}. Press Ctrl-C to end it.",
        args.service.join(" -> "),
        duration(args.seconds * 1e9)
    ));
    let stop = stop::after(stop, Some(args.seconds), 0);
    let measured = measure(&args.service, &mut measured_services, &stop);
    if args.json {
        terminal::print_json(&display::Document::of(&measured, &measured_services, &nodes))?;
    } else {
        terminal::print(&display::text(&measured, &nodes))?;
        display::notes(&measured, &measured_services).iter().for_each(|note| terminal::note(note));
    }
    verdict(&measured, &measured_services)
}

/// Learns who writes the services, as far as that is announced.
fn learn_layouts(measured_services: &mut [MeasuredService<'_>], stop: &Stop) {
    let began = Instant::now();
    while measured_services.iter().any(|service| !service.is_announced())
        && began.elapsed() < ANSWER
        && !stop.is_due()
    {
        thread::sleep(LOOK_INTERVAL);
        // A reader learns layouts while it takes frames.
        measured_services.iter_mut().for_each(MeasuredService::receive);
    }
}

/// Follows the frames until it is time to end, or a service has ended.
fn measure(
    services: &[String],
    measured_services: &mut [MeasuredService<'_>],
    stop: &Stop,
) -> Measured {
    let mut timing = ChainTiming::new(services.len());
    let began = Instant::now();
    let begin_ns = Monotonic.now_ns();
    measured_services.iter_mut().for_each(MeasuredService::discard);
    let mut take_in = |measured_services: &mut [MeasuredService<'_>], until_ns: u64| {
        // From the last to the first: what a frame was computed from has then been sent and is read.
        measured_services.iter_mut().rev().for_each(MeasuredService::receive);
        for (index, service) in measured_services.iter_mut().enumerate() {
            service.taken(until_ns).for_each(|frame| timing.record(index, &frame));
        }
    };
    // Only stamps are measured: the frames need only be taken before newer ones displace them.
    let nap_ns =
        measured_services.iter().map(MeasuredService::longest_nap_ns).min().unwrap_or_default();
    let mut ended = None;
    while !stop.is_due() && ended.is_none() {
        take_in(measured_services, Monotonic.now_ns().saturating_sub(HOLD_NS));
        ended = measured_services.iter().find_map(MeasuredService::ended);
        thread::sleep(Duration::from_nanos(nap_ns));
    }
    let (elapsed, end_ns) = (began.elapsed(), Monotonic.now_ns());
    let end = ended
        .or_else(|| measured_services.iter().find_map(|service| service.silence(begin_ns, end_ns)));
    thread::sleep(LAST_LOOK);
    take_in(measured_services, end_ns);
    Measured { chain: timing.report(services), elapsed, end }
}

/// The exit status of the measurement.
fn verdict(measured: &Measured, measured_services: &[MeasuredService<'_>]) -> Result<(), Failure> {
    if let Some(end) = &measured.end {
        return Err(Failure::found(end));
    }
    if measured.chain.latency_ns.count > 0 {
        return Ok(());
    }
    if let Some(silent) = measured_services.iter().find(|service| service.frames() == 0) {
        let service = silent.service().to_owned();
        return Err(Failure::found(End::Never { service }));
    }
    let broken = measured.chain.hops.iter().find(|hop| hop.latency_ns.count == 0);
    let why = match broken {
        Some(hop) => format!(
            "no frame of \"{}\" goes back to a frame of \"{}\"; see that its signals are computed from \
             that input, and that no older input stands beside it, or measure for longer (--seconds)",
            hop.to, hop.from
        ),
        None => "each hop was seen, but never one after the other; measure for longer (--seconds)"
            .into(),
    };
    Err(Failure::inconclusive(why))
}
