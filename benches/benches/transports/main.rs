//! What other middleware takes for the way that `isochrone bench latency` measures: ZeroMQ and zenoh,
//! each behind a feature of its name, beside this product's ports.
//!
//! Two processes. Paced, one sends at absolute instants and the other receives; back to back, a sample
//! is half of a round trip. Every value is written and read. Each process's main thread has a CPU. Ports poll; the others wait as their
//! library does, so what is compared is what a user gets, wake-ups included.
//!
//! ```text
//! cargo bench -p isochrone-benches --bench transports --features zeromq,zenoh -- --seconds 5
//! ```

mod cpu;
mod message;
mod peer;
mod ports;
mod turn;
#[cfg(feature = "zenoh")]
mod zenoh_arm;
#[cfg(feature = "zeromq")]
mod zeromq_arm;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::{Parser, Subcommand};
use isochrone_benches::{Failure, take_turns};
use isochrone_cyclic::{Clock, Monotonic, prepare_process};
use isochrone_ipc::IsolatedDomain;
use isochrone_machine::{Environment, Machine};
use isochrone_report::{LinkArm, Report, Turns};
use isochrone_runtime::warning;
use isochrone_timing::{Distribution, LinkReport};

use crate::message::Wire;
use crate::peer::{Order, Peer};

/// Arms that this was built with; the others are compared with the first.
const ARMS: &[&str] = &[
    "ports",
    #[cfg(feature = "zeromq")]
    "zeromq",
    #[cfg(feature = "zenoh")]
    "zenoh",
];

#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    peer: Option<Other>,
    /// Messages per second, and 0 for back to back
    #[arg(long, value_delimiter = ',', default_value = "1000,0")]
    pace: Vec<f64>,
    /// Values in a message
    #[arg(long, value_delimiter = ',', default_value = "1,64,4096")]
    values: Vec<usize>,
    /// Time for each arm, at each pace and size
    #[arg(long, default_value_t = 5.0)]
    seconds: f64,
    /// Length of a turn
    #[arg(long, alias = "block", default_value_t = 0.5)]
    turn: f64,
    /// Write the report (JSON), which `isochrone compare` reads
    #[arg(long)]
    report: Option<PathBuf>,
    /// Only see whether every arm runs
    #[arg(long)]
    test: bool,
    /// Given by `cargo bench`
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Subcommand)]
enum Other {
    /// The process at the other end
    #[command(hide = true)]
    Peer { arm: String, place: String, values: usize },
}

fn main() -> Result<(), Failure> {
    let mut args = Args::parse();
    if let Some(Other::Peer { arm, place, values }) = &args.peer {
        return peer::serve(arm, place, *values);
    }
    if args.test {
        (args.seconds, args.turn) = (0.2, 0.1);
    }
    let mut report = Report::new(std::env::args().skip(1).collect(), Environment::read());
    // Page faults would make turns invalid.
    report.warnings.extend(prepare_process().refusals.iter().map(warning));
    let domain = IsolatedDomain::new("transports")?;
    let origin_ns = Monotonic.now_ns();
    for values in &args.values {
        let mut arms = Vec::new();
        for name in ARMS {
            let place = place(name, &domain)?;
            let listening = listen(name, &place, *values)?;
            let peer = Peer::start(name, &place, *values)?;
            arms.push(Arm { name, wire: listening()?, peer });
        }
        for hz in &args.pace {
            report.links.extend(measure(&args, &mut arms, *values, *hz, origin_ns)?);
        }
        for mut arm in arms {
            arm.peer.dismiss();
        }
    }
    report.compare_arms();
    if let Some(file) = &args.report {
        std::fs::write(file, serde_json::to_string_pretty(&report)?)?;
    }
    println!("{report}");
    Ok(())
}

struct Arm {
    name: &'static str,
    wire: Box<dyn Wire>,
    peer: Peer,
}

/// Lets the arms take turns at one pace (0: back to back) and size.
fn measure(
    args: &Args,
    arms: &mut [Arm],
    values: usize,
    hz: f64,
    origin_ns: u64,
) -> Result<Vec<LinkArm>, Failure> {
    struct Line<'a> {
        arm: &'a mut Arm,
        turns: Turns,
    }
    let mut lines: Vec<Line<'_>> =
        arms.iter_mut().map(|arm| Line { arm, turns: Turns::default() }).collect();
    let _pinned = cpu::pin(0)?;
    let rounds = (args.seconds / args.turn).round().max(1.0) as usize;
    let turn_ns = (args.turn * 1e9) as u64;
    let thread = rustix::thread::gettid().as_raw_nonzero().get().cast_unsigned();
    let machine = Machine::here();
    let mut samples = Distribution::new();
    take_turns(rounds, &mut lines, |line| {
        let start_ns = Monotonic.now_ns() + 5_000_000;
        let order = Order {
            start_ns,
            end_ns: start_ns + turn_ns,
            period_ns: if hz > 0.0 { (1e9 / hz).round() as u64 } else { 0 },
        };
        let from_ns = start_ns + turn_ns / 10;
        samples.clear();
        line.arm.peer.order(&order)?;
        let before = machine.disturbance(None, Some(thread));
        let wire = line.arm.wire.as_mut();
        let lost = match order.period_ns {
            0 => turn::ping(wire, values, from_ns, order.end_ns, &mut samples)?,
            _ => turn::receive(wire, values, from_ns, &mut samples)?,
        };
        line.arm.peer.finish()?;
        let disturbance = machine.disturbance(None, Some(thread)).since(before);
        let at_s = from_ns.saturating_sub(origin_ns) as f64 / 1e9;
        let elapsed_ns = order.end_ns - from_ns;
        line.turns.push(at_s, elapsed_ns, &samples, lost, disturbance);
        Ok(())
    })?;
    let link = |line: &Line<'_>| {
        let all = line.turns.all();
        let link = LinkReport {
            service: line.arm.name.to_owned(),
            frames: all.count(),
            lost: line.turns.missed(),
            one_way_ns: all.summary(),
            histograms: [("one_way_ns".to_owned(), all.encode())].into(),
            ..LinkReport::default()
        };
        LinkArm {
            link,
            values: values as u64,
            paced_hz: (hz > 0.0).then_some(hz),
            turns: line.turns.reports().to_vec(),
            ..LinkArm::default()
        }
    };
    Ok(lines.iter().map(link).collect())
}

/// Where both ends of an arm meet: a folder, or an address that is free.
fn place(arm: &str, domain: &IsolatedDomain) -> Result<String, Failure> {
    match arm {
        "ports" => Ok(domain.file().display().to_string()),
        _ => Ok(std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.to_string()),
    }
}

/// What is left to do when the peer is there.
type Listening = Box<dyn FnOnce() -> Result<Box<dyn Wire>, Failure>>;

/// Opens the measuring end.
fn listen(arm: &str, place: &str, values: usize) -> Result<Listening, Failure> {
    match arm {
        "ports" => ports::listen(place, values),
        #[cfg(feature = "zeromq")]
        "zeromq" => zeromq_arm::listen(place),
        #[cfg(feature = "zenoh")]
        "zenoh" => zenoh_arm::listen(place),
        other => Err(no_such_arm(other)),
    }
}

/// Opens the peer's end.
fn connect(arm: &str, place: &str, values: usize) -> Result<Box<dyn Wire>, Failure> {
    match arm {
        "ports" => ports::connect(place, values),
        #[cfg(feature = "zeromq")]
        "zeromq" => zeromq_arm::connect(place),
        #[cfg(feature = "zenoh")]
        "zenoh" => zenoh_arm::connect(place),
        other => Err(no_such_arm(other)),
    }
}

fn no_such_arm(arm: &str) -> Failure {
    format!("no arm \"{arm}\" is built in; there are: {}", ARMS.join(", ")).into()
}

/// Ends the bench if a turn takes far longer than it may: a library's wait has no end of its own.
fn watchdog(limit: Duration) -> Arc<AtomicBool> {
    let over = Arc::new(AtomicBool::new(false));
    let is_over = over.clone();
    std::thread::spawn(move || {
        std::thread::sleep(limit);
        if !is_over.load(Ordering::Relaxed) {
            eprintln!("a turn did not end: a message was lost, or the peer has gone");
            std::process::exit(1);
        }
    });
    over
}
